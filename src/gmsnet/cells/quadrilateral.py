"""Quadrilaterals. The ideal one is a square.

The Jacobian determinant of a planar one is linear along each axis of the square. So it is least at a corner.
"""

from __future__ import annotations

from gmsnet.cells.kind import CellKind, higher_order

_SQUARE = ((1.0, 0.0), (0.0, 1.0))

QUADRILATERAL = CellKind(
    "quad",
    dimension=2,
    nodes=4,
    corners=4,
    edges=((0, 1), (1, 2), (2, 3), (3, 0)),
    facets=((0, 1), (1, 2), (2, 3), (3, 0)),
    simplices=((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2)),
    ideal=(_SQUARE,) * 4,
    exact=True,
)

KINDS = (QUADRILATERAL, higher_order(QUADRILATERAL, "quad8", 8), higher_order(QUADRILATERAL, "quad9", 9))
