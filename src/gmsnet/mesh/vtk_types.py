"""VTK's numbers of the kinds of cells, for its files and for the objects of PyVista."""

from __future__ import annotations

from collections.abc import Mapping

POLYVERTEX, POLYLINE, POLYGON = 2, 4, 7  # of any number of nodes; the first two are cut into vertices and lines
STRIP, PIXEL, VOXEL, POLYHEDRON = 6, 8, 11, 42

VTK_KINDS: Mapping[int, str] = {
    1: "vertex", POLYVERTEX: "vertex", 3: "line", POLYLINE: "line", 5: "triangle", POLYGON: "polygon", PIXEL: "quad",
    9: "quad", 10: "tetra", VOXEL: "hexahedron", 12: "hexahedron", 13: "wedge", 14: "pyramid", 21: "line3",
    22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20", 26: "wedge15", 27: "pyramid13", 28: "quad9",
    29: "hexahedron27", 32: "wedge18", 34: "triangle7", 35: "line4", POLYHEDRON: "polyhedron",
}  # fmt: skip
# Where VTK lists the nodes in another order (row by row), the place in its list of each of a Mesh's nodes.
VTK_ORDERS: Mapping[int, tuple[int, ...]] = {PIXEL: (0, 1, 3, 2), VOXEL: (0, 1, 3, 2, 4, 5, 7, 6)}
