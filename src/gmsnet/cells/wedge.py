"""Wedges (triangular prisms). The ideal one stands upright on an equilateral triangle, as high as its edge."""

from __future__ import annotations

from gmsnet.cells.kind import CellKind, higher_order

_U = 0.57735026918962576451  # 1/√3
_PRISM = ((1.0, -_U, 0.0), (0.0, 2 * _U, 0.0), (0.0, 0.0, 1.0))

WEDGE = CellKind(
    "wedge",
    dimension=3,
    nodes=6,
    corners=6,
    edges=((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    facets=((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    simplices=((0, 1, 2, 3), (1, 2, 0, 4), (2, 0, 1, 5), (3, 5, 4, 0), (4, 3, 5, 1), (5, 4, 3, 2)),
    ideal=(_PRISM,) * 6,
    exact=False,  # the determinant may be negative between positive corners
)

KINDS = (
    WEDGE,
    higher_order(WEDGE, "wedge15", 15),
    higher_order(WEDGE, "wedge18", 18, centres=(None, None, 15, 16, 17)),
)
