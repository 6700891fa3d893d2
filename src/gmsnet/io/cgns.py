"""CGNS meshes in HDF5 (needs h5py). Only the coordinates are written again.

Sections of elements are regions and markers by name, as are structured zones; those of several types that one boundary
condition joins are one. Boundary conditions and their families are node sets (cgns_conditions). Of several zones,
points at one place are one node.
Source: CGNS Standard Interface Data Structures, and its SIDS-to-HDF5 mapping.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io.cgns_conditions import has_sets, labelled, node_sets, ranges, united
from gmsnet.io.cgns_elements import DATA, grid, section, structured, tables_of, title
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.hdf5 import File, Node, shown
from gmsnet.io.hdf5_rows import numbers_of, stored_points
from gmsnet.io.merge import Part, merged
from gmsnet.io.ranges import Column, Plan, Table
from gmsnet.io.rows import Ranges, Rows
from gmsnet.io.splice import Share
from gmsnet.io.stored import Part as Axis
from gmsnet.io.stored import coordinates, shared
from gmsnet.io.vtk_ghosts import with_vertices
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "CGNS"
suffixes: tuple[str, ...] = (".cgns",)

Ints = NDArray[np.int64]


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".cgns"]
    zones = [zone for base in labelled(File(data).root, "CGNSBase_t") for zone in labelled(base, "Zone_t")]
    if not zones:
        raise FormatError("the file has no zones: there is nothing to smooth")
    parts, at = list[Parsed](), 1
    for zone in zones:
        parts.append(_zone(zone, data, at, f"{title(zone)}/" if len(zones) > 1 else ""))
        at = 1 + max((int(block.regions[0]) for block in parts[-1].cells), default=at - 1)
    return parts[0] if len(parts) == 1 else _one(parts)


def _one(parts: list[Parsed]) -> Parsed:
    """All zones as one mesh."""
    if len({part.points.shape[1] for part in parts}) > 1:
        raise FormatError("some zones have two axes of coordinates, others three: give all the same")
    if not any(part.cells for part in parts):
        raise FormatError("no zone has cells: there is nothing to smooth")
    whole = merged([Part(part) for part in parts])
    slots = shared([Share(part.slots, node) for part, node in zip(parts, whole.nodes, strict=True)])
    told = zip(parts, whole.nodes, strict=True)
    sets = united((name, node[nodes]) for part, node in told for name, nodes in part.node_sets.items())
    unread = [f"the division into {len(parts)} zones", *dict.fromkeys(whole.parsed.unread)]
    parsed = replace(whole.parsed, slots=slots, node_sets=sets, unread=unread)
    return with_vertices(parsed, whole.held, "coincident points")


def _zone(zone: Node, data: Data, number: int, prefix: str) -> Parsed:
    """A zone by itself. number: of its first region. prefix: of the names of regions and sets."""
    grids = labelled(zone, "GridCoordinates_t")
    if len(grids) != 1:
        raise FormatError(f"{shown(zone.path)}: {len(grids)} sets of coordinates: a grid that moves is not smoothed")
    axes = [found for axis in "XYZ" if (found := grids[0].get(f"Coordinate{axis}/{DATA}")) is not None]
    if len(axes) < 2:
        raise FormatError(f"{shown(grids[0].path)}: CoordinateX and CoordinateY are missing")
    points, slots, single = coordinates([Axis(node, (k,)) for k, node in enumerate(axes)], data)
    sizes: tuple[int, ...] = (len(points),)
    if _is_grid(zone):
        sections, prefix = [structured(zone, points)], ""
        sizes = tuple(zone.need(DATA).integers()[0].tolist())
    else:
        sections = [section(node, len(points)) for node in labelled(zone, "Elements_t")]
    cells, names = list[CellBlock](), dict[tuple[int, int], str]()
    sections.sort(key=lambda each: each.first)
    told = _regions(zone, [(each.first, each.name, [of for of, _ in each.blocks]) for each in sections], number)
    for each, (region, called) in zip(sections, told, strict=True):
        for of, nodes in each.blocks:
            cells.append(CellBlock(of, nodes, np.full(len(nodes), region)))
            names[CELLS[of].dimension, region] = prefix + called
    sets = node_sets(zone, sizes, sections, {prefix + called for _, called in told}, prefix)
    unread = [what for label, what in (("FlowSolution_t", "solutions"), ("ZoneGridConnectivity_t", "interfaces"),
              ("ZoneBC_t", "boundary conditions")) if labelled(zone, label)]  # fmt: skip
    return Parsed(points, cells, slots, names, single=single, unread=unread, node_sets=sets)


def _is_grid(zone: Node) -> bool:
    kind = zone.get("ZoneType/" + DATA)
    return kind is not None and kind.text() == "Structured"


def _regions(zone: Node, sections: Sequence[tuple[int, str, list[str]]], number: int) -> list[tuple[int, str]]:
    """The region of each section, from ``number`` on, and its name.

    sections: the first element, the name and the types of cells of each, ascending. Those of different types that one
    boundary condition has as a range are one region, by its name: a writer can give a section one type alone.
    """
    spans, kinds = list(ranges(zone)), dict[str, list[str]]()
    group = [next((name for low, high, name in spans if low <= first <= high), "") for first, _, _ in sections]
    for of, (_, _, types) in zip(group, sections, strict=True):
        kinds.setdefault(of, []).extend({*types})
    found, known = list[tuple[int, str]](), dict[str, int]()
    for (_, name, _), of in zip(sections, group, strict=True):
        together = bool(of) and group.count(of) > 1 and len({*kinds[of]}) == len(kinds[of])
        region = known.setdefault(of, number) if together else number
        number += region == number
        found.append((region, of if together else name))
    return found


def plan(file: Ranges) -> Plan | None:
    """How the numbers of all zones lie; None where some have polyhedra."""
    columns, tables, nodes, region = list[dict[str, Column]](), list[Table](), [0], 1
    names: dict[tuple[int, int], str] | None = {}
    with File.opened(file.path) as opened:
        several = [zone for base in labelled(opened.root, "CGNSBase_t") for zone in labelled(base, "Zone_t")]
        for zone in several:
            found = _planned(zone, file, nodes[-1], region, f"{title(zone)}/" if len(several) > 1 else "")
            if found is None:
                return None
            columns.append(found.columns)
            tables += found.tables
            count = next(iter(found.columns.values())).rows.rows
            nodes.append(nodes[-1] + count)
            names = None if names is None or found.has_sets else names | found.names
            region = 1 + max([region - 1, *(table.region for table in found.tables)])
    points = [column for of in columns for column in of.values()]
    if not tables or len({len(of) for of in columns}) > 1 or not _are_apart(points):
        return None
    single = any(all(column.rows.dtype[1:] == "f4" for column in of.values()) for of in columns)
    blocks, zones = [[table] for table in tables], list[int]()
    if len(columns) > 1:  # as of all pieces of a mesh
        blocks = [[table for table in tables if table.kind == kind]
                  for kind in dict.fromkeys(table.kind for table in tables)]  # fmt: skip
        zones = nodes
    return Plan(points, blocks, single, encoded=stored_points(columns), zones=zones, names=names)


def _are_apart(points: Sequence[Column]) -> bool:
    """Whether no two columns have the same numbers."""
    begins = [column.rows.start for column in points if isinstance(column.rows, Rows)]
    return len({*begins}) == len(begins)


class _Zone(NamedTuple):
    """The coordinates of a zone by their paths, its cells, the names of its regions, and whether nodes have others."""

    columns: dict[str, Column]
    tables: list[Table]
    names: dict[tuple[int, int], str]
    has_sets: bool


def _planned(zone: Node, file: Ranges, first: int, region: int, prefix: str) -> _Zone | None:
    """first: of all nodes the first of the zone. region: the number of its first one. prefix: of names."""
    grids = labelled(zone, "GridCoordinates_t")
    if len(grids) != 1:
        return None
    columns, axes = dict[str, Column](), [grids[0].get(f"Coordinate{axis}/{DATA}") for axis in "XYZ"]
    for axis, node in enumerate(node for node in axes if node is not None):
        rows = numbers_of(node)
        if rows is None or rows.dtype[1] != "f":
            return None
        columns[node.path] = Column(rows, first, axis)
    counts = [*{column.rows.rows for column in columns.values()}]
    if len(columns) < 2 or len(counts) > 1:
        return None
    if _is_grid(zone):
        points = Plan([column._replace(first=0) for column in columns.values()], (), single=False)
        cells = grid(zone, (counts[0], len(columns)), partial(points.places, file))
        sections, prefix = [(title(zone), (1, [Table(cells.kind, cells, 0)]))], ""
    else:
        found = [(title(node), tables_of(node, file)) for node in labelled(zone, "Elements_t")]
        sections = [(name, each) for name, each in found if each is not None]
        if len(sections) < len(found):
            return None
    tables, names = list[Table](), dict[tuple[int, int], str]()
    sections.sort(key=lambda each: each[1][0])
    told = _regions(zone, [(begin, name, [each.kind for each in some]) for name, (begin, some) in sections], region)
    for (_, (_, some)), (number, called) in zip(sections, told, strict=True):
        for table in some:
            if table.nodes.rows:
                tables.append(table._replace(region=number, zone=(first, counts[0])))
                names[CELLS[table.kind].dimension, number] = prefix + called
    return _Zone(columns, tables, names, has_sets(zone, {prefix + called for _, called in told}, prefix))


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
