"""Fluent meshes, as text or with binary sections (``.msh``, ``.cas``). Only the coordinates are written again.

A file lists faces, each with the cell on either side; cells are put together from them. Zones of cells are regions,
zones of faces on the boundary are markers. Source: the mesh file format in the manual of ANSYS Fluent, appendix.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.cells import distinct
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.fluent_faces import PARENT, PERIODIC, outward, polygons
from gmsnet.io.fluent_ranges import plan as plan
from gmsnet.io.fluent_sections import CELLS, FACES, NAMES, NODES, Section, face_lists, sections
from gmsnet.io.foam_cells import Sides, volumes, walls
from gmsnet.io.places import Lattice, Places
from gmsnet.io.splice import BinarySlots, Points, TextSlots
from gmsnet.io.text import Text, fail
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.mesh import Mesh

name = "Fluent"
suffixes: tuple[str, ...] = (".msh",)

Ints = NDArray[np.int64]

_BY_MESHIO, _A_FACE_SECTION = re.compile(rb'\s*\(1 "meshio '), re.compile(rb"\((20|30)?13\s*\(")


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".msh"]
    if _BY_MESHIO.match(data) and _A_FACE_SECTION.search(data) is None:
        raise FormatError(
            "meshio wrote this file in a form of its own, with the nodes of cells where Fluent's format has faces: "
            'write it with file_format="gmsh22", or as .vtu'
        )
    found = list(sections(data))
    dimension = next((k.head[0] for k in found if k.key == 2 and k.head), 3)
    if dimension not in (2, 3):
        raise FormatError(f"the mesh has {dimension} dimensions instead of 2 or 3")
    points, slots = _points(data, [k for k in found if k.key in NODES and k.body], dimension)
    zones, sizes, nodes, sides = _faces(data, [k for k in found if k.key in FACES and k.body], len(points))
    count = int(sides.max(initial=0))
    if not count or count > len(sizes):
        raise FormatError(f"{len(sizes)} faces name {count} cells: sections of faces are missing, or damaged")
    if dimension == 2 and (sizes != 2).any():
        raise FormatError("a face of a mesh in the plane has two nodes")
    regions = _regions(found, count)
    inner = sides.min(axis=1) > 0
    faces = outward(sizes, nodes, sides, inner)
    around = Sides.of(faces, 0, count)
    blocks = volumes(faces, around, regions) if dimension == 3 else polygons(faces, around, regions)
    blocks += walls(sizes[~inner], nodes[np.repeat(~inner, sizes)], zones[~inner])
    names = dict[tuple[int, int], str]()
    titles = {k.zone: k.title for k in found if k.key in NAMES}
    names |= {(dimension - 1, zone): titles[zone] for zone in distinct(zones[~inner]) if zone in titles}
    names |= {(dimension, zone): titles[zone] for zone in distinct(regions) if zone in titles}
    known = {0, 1, 2, *NODES, *FACES, *CELLS, *NAMES}
    unread = [f"sections of the number {key}" for key in sorted({k.key for k in found} - known)]
    single = isinstance(slots, BinarySlots) and slots.dtype.endswith("4")
    images = _images(found, zones, sizes, nodes)
    unread = ["the faces and their order", *unread]
    return Parsed(points, blocks, slots, names, single=single, unread=unread, images=images)


def _images(found: list[Section], zones: Ints, sizes: Ints, nodes: Ints) -> Ints:
    """The nodes of periodic boundaries."""
    periodic = [k.zone for k in found if k.key in FACES and k.body and len(k.head) > 3 and k.head[3] in PERIODIC]
    return sorted_unique(nodes[np.repeat(np.isin(zones, periodic), sizes)])


def _points(data: Data, found: list[Section], dimension: int) -> tuple[Points, TextSlots | BinarySlots]:
    """The coordinates of all zones of nodes, by their numbers."""
    at = 1
    for first, count in sorted((section.first, section.members) for section in found):
        if first != at:
            raise FormatError(f"the node {at} is missing, or given twice: nodes go on with {first}")
        at += count
    kinds = {section.dtype for section in found}
    if len(kinds) > 1:
        raise FormatError("some nodes are text or of another precision than others: write them in one form")
    if not found:
        raise FormatError("the file has no nodes (section 10)")
    return (_binary if any(kinds) else _texts)(data, found, dimension)


def _texts(data: Data, found: list[Section], dimension: int) -> tuple[Points, TextSlots]:
    text, parts = Text(data, ends=b")"), list[Ints]()
    for section in sorted(found, key=lambda section: section.first):
        assert section.body is not None
        starts, _ = text.until(section.body[1]).tokens(section.body[0])
        _fits(data, section, len(starts), dimension)
        parts.append(starts.reshape(-1, dimension))
    starts = np.ascontiguousarray(np.concatenate(parts))
    points, ends = text.spans(starts)
    return points, TextSlots(starts, ends)


def _binary(data: Data, found: list[Section], dimension: int) -> tuple[Points, BinarySlots]:
    dtype, lattices, nodes = found[0].dtype, list[Lattice](), list[Ints]()
    size = np.dtype(dtype).itemsize
    points = np.empty((sum(section.members for section in found), dimension))
    for section in found:
        assert section.body is not None
        _fits(data, section, (section.body[1] - section.body[0]) // size, dimension)
        lattice = Lattice(section.body[0], section.members, dimension * size, range(0, dimension * size, size))
        rows = np.arange(section.first - 1, section.first - 1 + section.members)
        for axis, column in enumerate(lattice.columns):
            points[rows, axis] = lattice.column(data, column, dtype)
        if not np.isfinite(points[rows]).all():
            fail(data, section.start, "a coordinate is not a finite number")
        lattices.append(lattice)
        nodes.append(rows)
    return points, BinarySlots(Places(*lattices), dtype, np.concatenate(nodes))


def _fits(data: Data, section: Section, count: int, dimension: int) -> None:
    if count != section.members * dimension or not count:
        last = section.first + section.members - 1
        fail(data, section.start, f"{count} coordinates do not fit the nodes {section.first} to {last}")


def _faces(data: Data, found: list[Section], count: int) -> tuple[Ints, Ints, Ints, Ints]:
    """zone (F,), number of nodes (F,), all nodes, cells (F, 2) counted from 1, 0 where there is none."""
    none = np.empty(0, dtype=np.int64)
    zones, sizes, nodes, sides = [none], [none], [none], [np.empty((0, 2), dtype=np.int64)]
    for section in found:
        if len(section.head) > 3 and section.head[3] == PARENT:
            continue
        size, listed, pair = face_lists(data, section)
        zones.append(np.full(len(size), section.zone))
        sizes.append(size)
        nodes.append(listed - 1)
        sides.append(pair)
    all_nodes, all_sides = np.concatenate(nodes), np.concatenate(sides)
    if len(all_nodes) and not 0 <= all_nodes.min() <= all_nodes.max() < count:
        raise FormatError(f"a face names a node that is none of 1 to {count}")
    if (all_sides < 0).any() or (len(all_sides) and not all_sides.any(axis=1).all()):
        raise FormatError("a face lies at no cell")
    return np.concatenate(zones), np.concatenate(sizes), all_nodes, all_sides


def _regions(found: list[Section], count: int) -> Ints:
    """The zone of each cell."""
    regions = np.zeros(count, dtype=np.int64)
    for section in found:
        if section.key in CELLS and len(section.head) > 2 and section.zone:
            first, last = section.head[1:3]
            if 1 <= first <= last:
                regions[first - 1 : last] = section.zone
    return regions


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
