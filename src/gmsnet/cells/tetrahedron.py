"""Tetrahedra. The ideal one is regular."""

from __future__ import annotations

from gmsnet.cells.kind import CellKind, higher_order

_U = 0.57735026918962576451  # 1/√3
_V = 0.40824829046386301637  # 1/√6
_H = 1.22474487139158904910  # √(3/2), one over the height

TETRAHEDRON = CellKind(
    "tetra",
    dimension=3,
    nodes=4,
    corners=4,
    edges=((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    facets=((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    simplices=((0, 1, 2, 3),),
    ideal=(((1.0, -_U, -_V), (0.0, 2 * _U, -_V), (0.0, 0.0, _H)),),
    exact=True,
)

KINDS = (TETRAHEDRON, higher_order(TETRAHEDRON, "tetra10", 10))
