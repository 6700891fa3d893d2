"""CGNS meshes in HDF5 (needs h5py): one base with one unstructured zone. Only the coordinates are written again.

Sections of elements are regions and markers by name; boundary conditions that list nodes are node sets.
Source: CGNS Standard Interface Data Structures, and its SIDS-to-HDF5 mapping.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS, nodes_of
from gmsnet.errors import FormatError
from gmsnet.io.cell_table import check_range
from gmsnet.io.cells import distinct
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.exodus_elements import ORDERS
from gmsnet.io.hdf5 import File, Node, shown
from gmsnet.io.stored import Part, coordinates
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "CGNS"
suffixes: tuple[str, ...] = (".cgns",)

Ints = NDArray[np.int64]

DATA = " data"
KINDS = {
    2: "vertex", 3: "line", 4: "line3", 5: "triangle", 6: "triangle6", 7: "quad", 8: "quad8", 9: "quad9",
    10: "tetra", 11: "tetra10", 12: "pyramid", 13: "pyramid14", 14: "wedge", 15: "wedge15", 16: "wedge18",
    17: "hexahedron", 18: "hexahedron20", 19: "hexahedron27", 21: "pyramid13",
}  # fmt: skip
# Middles as in Exodus files, but for the centres: of a hexahedron its faces −z, −y, x, y, −x, z, then its inside.
CGNS_ORDERS = ORDERS | {"hexahedron27": (*range(12), *range(16, 20), *range(12, 16), 24, 22, 21, 23, 20, 25, 26)}
MIXED, NGON, NFACE = 20, 22, 23


class Section(NamedTuple):
    """Elements of a section. first: the number of its first element in the zone, from 1."""

    name: str
    first: int
    blocks: list[tuple[str, Ints]]


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".cgns"]
    file = File(data)
    bases = _labelled(file.root, "CGNSBase_t")
    zones = [zone for base in bases for zone in _labelled(base, "Zone_t")]
    if len(zones) != 1:
        raise FormatError(f"the file has {len(zones)} zones: only files of one unstructured zone are smoothed")
    zone = zones[0]
    kind = zone.get("ZoneType/" + DATA)
    if kind is None or kind.text() != "Unstructured":
        raise FormatError(f"{shown(zone.path)}: the zone is structured: convert it to an unstructured one first")
    grids = _labelled(zone, "GridCoordinates_t")
    if len(grids) != 1:
        raise FormatError(f"{shown(zone.path)}: {len(grids)} sets of coordinates: a grid that moves is not smoothed")
    axes = [found for axis in "XYZ" if (found := grids[0].get(f"Coordinate{axis}/{DATA}")) is not None]
    if len(axes) < 2:
        raise FormatError(f"{shown(grids[0].path)}: CoordinateX and CoordinateY are missing")
    points, slots, single = coordinates([Part(node, (k,)) for k, node in enumerate(axes)], data)
    sections = sorted((_section(node, len(points)) for node in _labelled(zone, "Elements_t")), key=lambda s: s.first)
    cells, names = list[CellBlock](), dict[tuple[int, int], str]()
    for number, section in enumerate(sections, 1):
        for of, nodes in section.blocks:
            cells.append(CellBlock(of, nodes, np.full(len(nodes), number)))
            names[CELLS[of].dimension, number] = section.name
    sets = dict(_conditions(zone, len(points)))
    unread = [what for label, what in (("FlowSolution_t", "solutions"), ("ZoneGridConnectivity_t", "interfaces"),
              ("ZoneBC_t", "boundary conditions")) if _labelled(zone, label)]  # fmt: skip
    return Parsed(points, cells, slots, names, single=single, unread=unread, node_sets=sets)


def _labelled(node: Node, label: str) -> list[Node]:
    """The children of one CGNS type."""
    return [child for child in node.members() if not child.is_data and child.attribute("label") == label]


def _title(node: Node) -> str:
    return "".join(c if c.isprintable() else " " for c in node.name)


def _section(node: Node, count: int) -> Section:
    head, bounds = (node.need(path).integers().reshape(-1) for path in (DATA, f"ElementRange/{DATA}"))
    if len(head) < 1 or len(bounds) != 2:
        raise FormatError(f"{shown(node.path)}: the type or the range of its elements is missing")
    code, number = int(head[0]), int(bounds[1]) - int(bounds[0]) + 1
    if code in (NGON, NFACE):
        raise FormatError(f"{shown(node.path)}: polyhedra (NGON, NFACE) are not read: write cells by their type")
    listed = node.need(f"ElementConnectivity/{DATA}").integers().reshape(-1)
    if code == MIXED:
        blocks = list(_mixed(node, listed, number, count))
    elif code in KINDS:
        width = nodes_of(KINDS[code])
        if len(listed) != number * width:
            raise FormatError(f"{shown(node.path)}: {len(listed)} nodes do not make {number} cells of {width}")
        blocks = [(KINDS[code], _ordered(node, KINDS[code], listed.reshape(-1, width) - 1, count))]
    else:
        raise FormatError(f"{shown(node.path)}: elements of the type {code} are not known")
    return Section(_title(node), int(bounds[0]), [(kind, nodes) for kind, nodes in blocks if len(nodes)])


def _mixed(node: Node, listed: Ints, number: int, count: int) -> Iterator[tuple[str, Ints]]:
    """Blocks of elements that each have their type in front, in the order of the types."""
    starts, at = np.empty(max(0, min(number, len(listed))), dtype=np.int64), 0
    values = listed.tolist()
    for k in range(len(starts)):
        if at >= len(values) or values[at] not in KINDS:
            raise FormatError(f"{shown(node.path)}: element {k} (counted from 0) has a type that is not known")
        starts[k], at = at, at + 1 + nodes_of(KINDS[values[at]])
    if at != len(values) or len(starts) != number:
        raise FormatError(f"{shown(node.path)}: the nodes of the elements do not fit their types")
    codes = listed[starts]
    for code in distinct(codes):
        width = nodes_of(KINDS[code])
        nodes = listed[starts[codes == code][:, None] + np.arange(1, width + 1)] - 1
        yield KINDS[code], _ordered(node, KINDS[code], nodes, count)


def _ordered(node: Node, kind: str, nodes: Ints, count: int) -> Ints:
    def fail(index: int, message: str) -> Any:
        raise FormatError(f"{shown(node.path)}: {message} (counted from 0)")

    check_range(nodes.reshape(-1), count, fail)
    return np.ascontiguousarray(nodes[:, CGNS_ORDERS[kind]]) if kind in CGNS_ORDERS else nodes


def _conditions(zone: Node, count: int) -> Iterator[tuple[str, Ints]]:
    """The nodes of boundary conditions that list nodes."""
    for group in _labelled(zone, "ZoneBC_t"):
        for condition in _labelled(group, "BC_t"):
            place, listed = condition.get(f"GridLocation/{DATA}"), condition.get(f"PointList/{DATA}")
            if listed is None or (place is not None and place.text() != "Vertex"):
                continue
            nodes = listed.integers().reshape(-1) - 1
            if len(nodes) and 0 <= nodes.min() <= nodes.max() < count:
                yield _title(condition), np.unique(nodes)


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
