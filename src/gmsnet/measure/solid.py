"""Validity of volume cells everywhere in them: certified in float64, exact where that leaves a doubt."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.jacobian import JacobianForm, form_of
from gmsnet.kernels.simplex.jacobian3 import DEPTH
from gmsnet.kernels.simplex.validity3 import INVALID, UNDECIDED, VALID, judge_solids
from gmsnet.kernels.star.guard import Precision

Floats = NDArray[np.float64]
Signs = NDArray[np.int8]
BUDGET = 400  # parts of a cell that exact arithmetic looks at
AT_ONCE = 4096  # cells whose whole numbers are in memory at a time


def judge_volumes(
    points: Floats, cells: NDArray[np.int32], name: str, orientation: Signs,
    precision: Precision = Precision(), depth: int = DEPTH,  # noqa: B008 (a tuple of constants)
) -> tuple[Signs, Floats]:  # fmt: skip
    """(C,) the sign of orientation × det J throughout each cell, and (C, 3) where a cell is not valid.

    points: (N, 3 or more) float64, C-contiguous. cells: (C, n) of one kind in the order of VTK; ``name`` is meshio's.
    The sign is VALID = 1 where det J is positive everywhere in the cell, corners included. INVALID = −1: it is not, at
    the place given in reference coordinates. UNDECIDED = 0: even exact arithmetic does not tell after ``depth``
    halvings of the cell, DEPTH at most. The place of a valid cell is nan. KeyError for kinds without a form, see
    ``gmsnet.cells.jacobian.has_form``. Source: see there.
    """
    form = form_of(name)
    sign, place = np.zeros(len(cells), dtype=np.int8), np.full((len(cells), 3), np.nan)
    judge_solids(points, cells, form, orientation, precision.unit, precision.grain, depth, 0, len(cells), sign, place)
    doubtful = np.flatnonzero(sign == UNDECIDED)
    for first in range(0, len(doubtful), AT_ONCE):
        some = doubtful[first : first + AT_ONCE]
        sign[some], place[some] = exact_signs_of(points[cells[some], :3], form, orientation[some], depth)
    return sign, place


def exact_signs_of(nodes: Floats, form: JacobianForm, orientation: Signs, depth: int = DEPTH) -> tuple[Signs, Floats]:
    """``judge_volumes`` of some cells (C, n, 3) in whole numbers."""
    coefficients, known = _coefficients(nodes, form)
    coefficients = coefficients * orientation.astype(object)
    corner = _table(form.ints, form.corner, form.corners)
    sign, place = np.full(len(nodes), VALID, dtype=np.int8), np.full((len(nodes), 3), np.nan)
    for c in np.flatnonzero(~(coefficients > 0).all(axis=0)).tolist():
        sign[c], place[c] = _by_halving(coefficients[:, c], form, corner, depth)
    sign[~known] = UNDECIDED
    return sign, place


def _table(packed: NDArray[Any], begin: int, count: int) -> NDArray[Any]:
    return packed[begin : begin + count]


def _coefficients(nodes: Floats, form: JacobianForm) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """(K, C) times a common positive number, and which cells have numbers for coordinates."""
    known = np.asarray(np.isfinite(nodes).all(axis=(1, 2)))
    mantissa, exponent = np.frexp(np.where(np.isfinite(nodes), nodes, 0.0))
    whole = np.ldexp(mantissa, 53).astype(np.int64)  # a float is a whole number times a power of two
    least = np.where(whole == 0, 2000, exponent).min(axis=(1, 2), keepdims=True)
    shift = np.where(whole == 0, 0, exponent - least)
    at = np.left_shift(whole.astype(object), shift.astype(object)).transpose(1, 2, 0)
    at = at - at[0]
    ints, eight = form.ints, np.rint(8 * form.floats).astype(np.int64).astype(object)
    rows = form.u + form.v + form.w
    start = _table(ints, form.start, rows + 1)
    values = []
    for r in range(rows):
        total = 0 * at[0]
        for e in range(start[r], start[r + 1]):
            total = total + eight[form.weight + e] * at[ints[form.node + e]]
        values.append(total)
    crosses: list[Any] = [0] * form.products
    for i in range(form.u):
        for j in range(form.v):
            a, b = values[i], values[form.u + j]
            cross = np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
            p = ints[form.product + form.v * i + j]
            crosses[p] = crosses[p] + cross
    found: list[Any] = [0] * form.terms
    for p in range(form.products):
        for j in range(form.w):
            k = ints[form.coefficient + form.w * p + j]
            found[k] = found[k] + (crosses[p] * values[form.u + form.v + j]).sum(axis=0)
    many = np.rint(_table(form.floats, form.multinomial, form.terms)).astype(np.int64)
    common = int(np.lcm.reduce(many))
    return np.array([value * (common // int(m)) for value, m in zip(found, many, strict=True)], dtype=object), known


def _by_halving(coefficients: NDArray[Any], form: JacobianForm, corner: NDArray[Any], depth: int) -> tuple[int, Floats]:
    """The sign of one cell, and the place where it is not valid, or of what is undecided."""
    frame = _table(form.floats, form.frame, 3 * form.vertices).reshape(-1, 3)
    parts, looked = [(coefficients, frame, 0)], 0
    while parts:
        whole, frame, level = parts.pop()
        looked += 1
        at = int(np.argmin(whole[corner]))
        if whole[corner[at]] <= 0:
            return INVALID, _place(frame, form, at)
        if (whole > 0).all():
            continue
        if level == depth or looked == BUDGET:
            return UNDECIDED, _place(frame, form, at)
        parts += _halves(whole, frame, level, form)
    return VALID, np.full(3, np.nan)


def _place(frame: Floats, form: JacobianForm, corner: int) -> Floats:
    """The reference coordinates of a corner of a part."""
    vertices = _table(form.ints, form.at + 3 * corner, 3)
    place: Floats = frame[vertices[vertices >= 0]].sum(axis=0)
    return place


def _halves(
    whole: NDArray[Any], frame: Floats, level: int, form: JacobianForm
) -> list[tuple[NDArray[Any], Floats, int]]:
    """Both halves of a part, the coefficients times a power of two."""
    g = level % form.cuts
    i, j = _table(form.ints, form.cut + 2 * g, 2)
    parts = []
    for half in range(2):
        begin = form.half_start + form.terms * (2 * g + half)
        start = _table(form.ints, begin, form.terms + 1)
        source = _table(form.ints, form.half_from, int(start[-1]))
        weight = np.rint(64 * _table(form.floats, form.half_weight, int(start[-1]))).astype(np.int64).astype(object)
        inner = np.array([(weight[a:b] * whole[source[a:b]]).sum() for a, b in pairwise(start)], dtype=object)
        moved = frame.copy()
        moved[i if half else j] = (frame[i] + frame[j]) / 2
        parts.append((inner, moved, level + 1))
    return parts
