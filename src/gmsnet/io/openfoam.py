"""Meshes of OpenFOAM cases (``constant/polyMesh``), in text and binary, each file plain or compressed.

The file of points is spliced; faces, owner, neighbour and boundary stay as they are. Patches are markers. Cells of a
zone are a region; points of zones of faces and of points are held.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io.cells import distinct, sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.foam_cells import Faces, Ints, Sides, volumes, walls
from gmsnet.io.foam_lists import coordinates, faces, head_of, labels, list_at, lists_of
from gmsnet.io.foam_patches import ZONES, Patch, patches, zones
from gmsnet.io.foam_plane import Plane, cells_in, plane_of
from gmsnet.io.foam_ranges import plan as plan
from gmsnet.io.places import Places
from gmsnet.io.splice import BinarySlots, Slots, TextSlots
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "OpenFOAM"
suffixes: tuple[str, ...] = ("points", "faces", "owner", "neighbour", "boundary")
optional = ZONES
BETWEEN = "processor"  # the type of patches between processors; processorCyclic is one on the boundary


class Facts(NamedTuple):
    """rows: (N,) the point of the file that is each node. names: of patches between no two processors, and of zones."""

    parsed: Parsed
    rows: Ints
    names: tuple[str, ...]


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format; the names of the files stand for suffixes."""
    return facts(files).parsed


def facts(files: Mapping[str, Data], whole: bool = True) -> Facts:
    """The facts of a mesh. whole: else it is that of one processor, and faces to others are no boundary."""
    points, slots, single = coordinates(files["points"], head_of(files["points"], "points"), "points")
    found = _faces(files, len(points))
    cells = 1 + int(max(found.owner.max(), found.neighbour.max(initial=0)))
    known = patches(files["boundary"], len(found.sizes), len(found.neighbour))
    if not whole:
        known = [patch._replace(faces=0) if patch.kind == BETWEEN else patch for patch in known]
    regions, region_names = _regions(files, cells)
    plane, rows = plane_of(points, found, known, cells), np.arange(len(points))
    held = _of_zones(files, found, len(points))
    none = np.empty(0, dtype=np.int64)
    images = found.points_of(np.concatenate([none, *(patch.members for patch in known if patch.is_periodic)]))
    if plane is not None:
        back = np.ones(len(points), dtype=bool)
        back[plane.points] = False
        blocks = cells_in(plane, found, known, back, regions)
        slots = _in_plane(slots, plane)
        rows = plane.points
        points, held = sealed(points[plane.points][:, plane.axes]), sorted_unique(plane.node[held])
        images = sorted_unique(plane.node[images])
    else:
        blocks = volumes(found, Sides.of(found, 0, cells), regions) + _walls(found, known)
    dimension = 2 if plane is not None else 3
    names = {(dimension, number): region_names[number] for number in distinct(regions) if number}
    names |= {(dimension - 1, number): patch.name for number, patch in enumerate(known, 1) if patch.faces
              and (plane is None or patch.kind != "empty")}  # fmt: skip
    if len(held):
        blocks.append(CellBlock("vertex", held[:, None], np.ones(len(held), dtype=np.int64)))
        names[0, 1] = "zones"
    unread = ["the faces and their order, types of patches"]
    told = (*(patch.name for patch in known if BETWEEN not in patch.kind), *region_names.values())
    return Facts(Parsed(points, blocks, slots, names, single=single, unread=unread, images=images), rows, told)


def is_empty(files: Mapping[str, Data]) -> bool:
    """Whether there are no faces, as where a processor has no cells."""
    return list_at(files["owner"], head_of(files["owner"], "owner").body, "owner")[0] == 0


def _faces(files: Mapping[str, Data], points: int) -> Faces:
    """The faces with their cells. Raises FormatError where the lists do not fit each other."""
    sizes, corners = faces(files["faces"], head_of(files["faces"], "faces"), "faces")
    owner, neighbour = (labels(lists_of(files[key], head), head, head.body, key)[0] for key in ("owner", "neighbour")
                        for head in [head_of(files[key], key)])  # fmt: skip
    if len(owner) == len(neighbour) and (neighbour < 0).any():  # of old versions: −1 for faces of the boundary
        neighbour = neighbour[: int(np.argmax(neighbour < 0))]
    if not len(owner) or len(owner) != len(sizes) or len(neighbour) > len(owner):
        told = f"{len(sizes)} faces, {len(owner)} owners and {len(neighbour)} neighbours"
        raise FormatError(f"{told} do not fit each other: is a file cut off, or of another mesh?")
    if (sizes < 3).any():
        raise FormatError(f"faces: face {int(np.argmin(sizes))} (counted from 0) has {sizes.min()} points")
    if not 0 <= corners.min() <= corners.max() < points:
        raise FormatError(f"faces: a face names the point {corners.max()}, but the points are 0 to {points - 1}")
    most = len(sizes)  # each cell has several
    for key, cells in (("owner", owner), ("neighbour", neighbour)):
        if len(cells) and not 0 <= cells.min() <= cells.max() < most:
            raise FormatError(f"{key}: a face names the cell {cells.max()}, but there are {most} faces in all")
    return Faces(sizes, corners, owner, neighbour)


def _regions(files: Mapping[str, Data], cells: int) -> tuple[Ints, dict[int, str]]:
    """The zone of each cell, counted from 1, and their names; 0 for cells of none."""
    regions, names = np.zeros(cells, dtype=np.int64), dict[int, str]()
    if "cellZones" in files:
        for number, (text, members) in enumerate(zones(files["cellZones"], "cellZones", cells), 1):
            regions[members], names[number] = number, text
    return regions, names


def _of_zones(files: Mapping[str, Data], found: Faces, points: int) -> Ints:
    """The points that zones of faces and of points name."""
    parts = [np.empty(0, dtype=np.int64)]
    if "faceZones" in files:
        for _, members in zones(files["faceZones"], "faceZones", len(found.sizes)):
            parts.append(found.points_of(members))
    if "pointZones" in files:
        parts += [members for _, members in zones(files["pointZones"], "pointZones", points)]
    return sorted_unique(np.concatenate(parts))


def _walls(found: Faces, known: list[Patch]) -> list[CellBlock]:
    """The faces of all patches, those of one size together. They stand one after another, behind the other faces."""
    first = len(found.neighbour)
    markers = np.repeat(np.arange(1, len(known) + 1), [patch.faces for patch in known])
    end = first + len(markers)
    return walls(found.sizes[first:end], found.points[int(found.sizes[:first].sum()) :], markers)


def _in_plane(slots: Slots, plane: Plane) -> Slots:
    """The slots of the two coordinates in a plane, where each point of the file stands for a node of it."""
    node, axes = sealed(plane.node), list(plane.axes)
    if isinstance(slots, TextSlots):
        starts, ends = (np.ascontiguousarray(part[:, axes]) for part in (slots.starts, slots.ends))
        return TextSlots(starts, ends, node)
    assert isinstance(slots, BinarySlots)
    columns = [replace(lattice, columns=tuple(lattice.columns[axis] for axis in axes)) for lattice in
               slots.places.lattices]  # fmt: skip
    return BinarySlots(Places(*columns), slots.dtype, node)


def write(mesh: Mesh) -> Written:
    """Raises FormatError: a case is more than a mesh."""
    raise FormatError(
        "OpenFOAM meshes are written into their own case only: write .msh or .vtu, and convert that (gmshToFoam)"
    )
