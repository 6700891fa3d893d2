"""Pyramids over a quadrilateral. All edges of the ideal one are equally long.

Seen from the apex, the Jacobian determinant is linear along each axis of the base. So it is least at a corner there.
"""

from __future__ import annotations

from gmsnet.cells.kind import CellKind, higher_order

_V = 0.70710678118654752440  # 1/√2, the height
_PYRAMID = ((1.0, 0.0, -_V), (0.0, 1.0, -_V), (0.0, 0.0, 2 * _V))

PYRAMID = CellKind(
    "pyramid",
    dimension=3,
    nodes=5,
    corners=5,
    edges=((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    facets=((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    simplices=((0, 1, 3, 4), (1, 2, 0, 4), (2, 3, 1, 4), (3, 0, 2, 4)),
    ideal=(_PYRAMID,) * 4,
    exact=True,
)

KINDS = (
    PYRAMID,
    higher_order(PYRAMID, "pyramid13", 13),
    higher_order(PYRAMID, "pyramid14", 14, centres=(13, None, None, None, None)),
)
