"""Hexahedra. The ideal one is a cube."""

from __future__ import annotations

from gmsnet.cells.kind import CellKind, higher_order

_CUBE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

HEXAHEDRON = CellKind(
    "hexahedron",
    dimension=3,
    nodes=8,
    corners=8,
    edges=((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
    facets=((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)),
    simplices=(
        *((0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7)),
        *((4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)),
    ),
    ideal=(_CUBE,) * 8,
    exact=False,  # the determinant may be negative between positive corners
)

KINDS = (
    HEXAHEDRON,
    higher_order(HEXAHEDRON, "hexahedron20", 20),
    higher_order(HEXAHEDRON, "hexahedron27", 27, centres=(20, 21, 22, 23, 24, 25)),
)
