"""Triangles. The ideal one is equilateral."""

from __future__ import annotations

from gmsnet.cells.kind import CellKind, higher_order

_U = 0.57735026918962576451  # 1/√3

TRIANGLE = CellKind(
    "triangle",
    dimension=2,
    nodes=3,
    corners=3,
    edges=((0, 1), (1, 2), (2, 0)),
    facets=((0, 1), (1, 2), (2, 0)),
    simplices=((0, 1, 2),),
    ideal=(((1.0, -_U), (0.0, 2 * _U)),),
    exact=True,
)

KINDS = (
    TRIANGLE,
    higher_order(TRIANGLE, "triangle6", 6),
    higher_order(TRIANGLE, "triangle7", 7),
    higher_order(TRIANGLE, "triangle10", 10, order=3),
)
