"""CGNS meshes in HDF5 (needs h5py). Only the coordinates are written again.

Sections of elements are regions and markers by name, as are structured zones; boundary conditions that list nodes are
node sets. Of several zones, points at one place are one node.
Source: CGNS Standard Interface Data Structures, and its SIDS-to-HDF5 mapping.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io.cgns_elements import DATA, section, structured, tables_of, title
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.hdf5 import File, Node, shown
from gmsnet.io.hdf5_rows import StoredPoints, rows_of
from gmsnet.io.merge import Part, merged
from gmsnet.io.ranges import Column, Plan
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
    zones = [zone for base in _labelled(File(data).root, "CGNSBase_t") for zone in _labelled(base, "Zone_t")]
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
    sets = {name: np.unique(node[nodes]) for part, node in zip(parts, whole.nodes, strict=True)
            for name, nodes in part.node_sets.items()}  # fmt: skip
    unread = [f"the division into {len(parts)} zones", *dict.fromkeys(whole.parsed.unread)]
    parsed = replace(whole.parsed, slots=slots, node_sets=sets, unread=unread)
    return with_vertices(parsed, whole.held, "coincident points")


def _zone(zone: Node, data: Data, number: int, prefix: str) -> Parsed:
    """A zone by itself. number: of its first region. prefix: of the names of regions and sets."""
    grids = _labelled(zone, "GridCoordinates_t")
    if len(grids) != 1:
        raise FormatError(f"{shown(zone.path)}: {len(grids)} sets of coordinates: a grid that moves is not smoothed")
    axes = [found for axis in "XYZ" if (found := grids[0].get(f"Coordinate{axis}/{DATA}")) is not None]
    if len(axes) < 2:
        raise FormatError(f"{shown(grids[0].path)}: CoordinateX and CoordinateY are missing")
    points, slots, single = coordinates([Axis(node, (k,)) for k, node in enumerate(axes)], data)
    kind = zone.get("ZoneType/" + DATA)
    if kind is not None and kind.text() == "Structured":
        sections, prefix = [structured(zone, points)], ""
    else:
        sections = [section(node, len(points)) for node in _labelled(zone, "Elements_t")]
    cells, names = list[CellBlock](), dict[tuple[int, int], str]()
    for region, each in enumerate(sorted(sections, key=lambda each: each.first), number):
        for of, nodes in each.blocks:
            cells.append(CellBlock(of, nodes, np.full(len(nodes), region)))
            names[CELLS[of].dimension, region] = prefix + each.name
    sets = {prefix + name: nodes for name, nodes in _conditions(zone, len(points))}
    unread = [what for label, what in (("FlowSolution_t", "solutions"), ("ZoneGridConnectivity_t", "interfaces"),
              ("ZoneBC_t", "boundary conditions")) if _labelled(zone, label)]  # fmt: skip
    return Parsed(points, cells, slots, names, single=single, unread=unread, node_sets=sets)


def _labelled(node: Node, label: str) -> list[Node]:
    """The children of one CGNS type."""
    return [child for child in node.members() if not child.is_data and child.attribute("label") == label]


def _conditions(zone: Node, count: int) -> Iterator[tuple[str, Ints]]:
    """The nodes of boundary conditions that list nodes."""
    for group in _labelled(zone, "ZoneBC_t"):
        for condition in _labelled(group, "BC_t"):
            place, listed = condition.get(f"GridLocation/{DATA}"), condition.get(f"PointList/{DATA}")
            if listed is None or (place is not None and place.text() != "Vertex"):
                continue
            nodes = listed.integers().reshape(-1) - 1
            if len(nodes) and 0 <= nodes.min() <= nodes.max() < count:
                yield title(condition), np.unique(nodes)


def plan(file: Ranges) -> Plan | None:
    """How the numbers of an unstructured zone lie; None of several or other zones, and of polyhedra."""
    with File.opened(file.path) as opened:
        zones = [zone for base in _labelled(opened.root, "CGNSBase_t") for zone in _labelled(base, "Zone_t")]
        grids = _labelled(zones[0], "GridCoordinates_t") if len(zones) == 1 else []
        if len(grids) != 1 or ((kind := zones[0].get("ZoneType/" + DATA)) is not None and kind.text() == "Structured"):
            return None
        axes = [found for axis in "XYZ" if (found := grids[0].get(f"Coordinate{axis}/{DATA}")) is not None]
        rows = [rows_of(node) for node in axes]
        points = [Column(each, 0, axis) for axis, each in enumerate(rows) if each is not None and each.width == 1]
        sections = [tables_of(node, file) for node in _labelled(zones[0], "Elements_t")]
    listed = sorted((each for each in sections if each is not None), key=lambda each: each[0])
    told = len(listed) == len(sections) and len(points) == len(axes) > 1
    if not told or len({each.rows.rows for each in points}) > 1 or any(each.rows.dtype[1] != "f" for each in points):
        return None
    blocks = [[table._replace(region=region)]
              for region, (_, tables) in enumerate(listed, 1) for table in tables if table.nodes.rows]  # fmt: skip
    if not blocks:
        return None
    in_place = all(isinstance(each.rows, Rows) for each in points)
    encoded = None if in_place else StoredPoints({node.path: axis for axis, node in enumerate(axes)})
    return Plan(points, blocks, all(each.rows.dtype[1:] == "f4" for each in points), encoded=encoded)


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
