"""Validity and quality of second-order planar cells: certified in float64, exact where that leaves a doubt."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import lcm
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.bernstein import (
    COEFFICIENTS,
    CORNER_COEFFICIENTS,
    CORNERS,
    NODES,
    QUAD9,
    coefficients_of_quad,
    coefficients_of_triangle,
    differences_of_quad,
    differences_of_triangle,
    split_quad,
    split_triangle,
    straighten_edges,
)
from gmsnet.kernels.simplex.jacobian import DEPTH, judge_cells
from gmsnet.kernels.star.guard import Precision

BUDGET = 4000  # parts of a cell that are looked at, of one size


def judge_curved(
    points: NDArray[np.float64],
    cells: NDArray[np.int32],
    kinds: NDArray[np.int8],
    precision: Precision = Precision(),  # noqa: B008 (a tuple of constants)
) -> tuple[NDArray[np.int8], NDArray[np.float64]]:
    """(C,) the sign of det J throughout each cell, and its scaled lower bound.

    points: (N, 2) float64, C-contiguous. cells: (C, 9), counter-clockwise. kinds: (C,), see kernels.simplex.bernstein.
    The sign is +1 where det J is positive everywhere and −1 where it is not. It is 0 where even exact arithmetic on the
    float64 coordinates does not decide it after DEPTH halvings. quality: the lower bound of det J over its mean in the
    straight cell, at most about 1 and 1 for straight triangles and parallelograms; it is not above 0 where float64
    cannot certify the cell.
    Source: A. Johnen, J.-F. Remacle, C. Geuzaine, Journal of Computational Physics 233, 2013.
    """
    sign, quality = np.zeros(len(cells), dtype=np.int8), np.empty(len(cells))
    judge_cells(points, cells, kinds, precision.unit, precision.grain, 0, len(cells), sign, quality)
    for c in np.flatnonzero(sign == 0).tolist():
        sign[c] = exact_sign(points[cells[c, : NODES[kinds[c]]]], int(kinds[c]))
    return sign, quality


def exact_sign(nodes: NDArray[np.float64], kind: int) -> int:
    """The sign of det J throughout one cell (nodes, 2) in rational arithmetic; 0 after DEPTH halvings."""
    todo = [_coefficients(nodes, kind)]
    corners = list(CORNER_COEFFICIENTS[kind])
    for _ in range(DEPTH + 1):
        parts = []
        for whole in todo:
            if min(whole[corners]) <= 0:
                return -1
            if min(whole) <= 0:
                parts += [quarter @ whole for quarter in _quarters(kind)]
        if not parts:
            return 1
        if len(parts) > BUDGET:
            return 0
        todo = parts
    return 0


def _coefficients(nodes: NDArray[np.float64], kind: int) -> NDArray[Any]:
    """The Bernstein coefficients as whole numbers, times a common positive one, by the source of the kernels."""
    exact = [[Fraction(v) for v in p] for p in nodes.tolist()]
    relative = np.zeros((max(len(exact), 2 * CORNERS[kind]), 2), dtype=object)
    relative[: len(exact)] = [[v - w for v, w in zip(p, exact[0], strict=True)] for p in exact]
    if NODES[kind] == CORNERS[kind]:
        _source(straighten_edges)(relative, CORNERS[kind])
    count = 3 if CORNERS[kind] == 3 else 6
    work, first, second, out = (np.zeros(shape, dtype=object) for shape in ((9, 2), (count, 2), (count, 2), 16))
    if CORNERS[kind] == 3:
        _source(differences_of_triangle)(relative, work, first, second)
        _source(coefficients_of_triangle)(first, second, out)
    else:
        _source(differences_of_quad)(relative, kind == QUAD9, work, first, second)
        _source(coefficients_of_quad)(first, second, out)
    values = out[: COEFFICIENTS[kind]]
    common = lcm(*(Fraction(v).denominator for v in values))
    return np.array([int(v * common) for v in values], dtype=object)


def _source(compiled: Any) -> Any:
    """The function that was compiled, for Python's own numbers."""
    return compiled.py_func


@cache
def _quarters(kind: int) -> list[NDArray[Any]]:
    """Four matrices of whole numbers: coefficients on a cell → on its quarters, times 64."""
    count = COEFFICIENTS[kind]
    matrices = np.zeros((4, count, count))
    children = np.zeros((4, 16))
    for k in range(count):
        whole = np.zeros(16)
        whole[k] = 64.0
        if CORNERS[kind] == 3:
            split_triangle(whole, children, 0)
        else:
            split_quad(whole, children, 0, np.empty((2, 16)))
        matrices[:, :, k] = children[:, :count]
    return [np.array(matrix.astype(np.int64).tolist(), dtype=object) for matrix in matrices]
