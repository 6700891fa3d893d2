"""The mean ratio of a corner simplex in the plane: the one place that knows its formula.

With the spokes a and b from a vertex v, counter-clockwise, D = a × b and the ideal corner W,

    q = ‖A W⁻¹‖²_F/(2 det(A W⁻¹)),  A = (a b).

‖A W⁻¹‖² is a quadratic form of the edges, and so a sum of *weighted squared edges*, whichever vertex is v:

    1/q = 2√3·D/L,   L = w_a |a|² + w_b |b|² + w_o |b − a|².

The weights are 1, 1, 1 where W is equilateral (L is then the sum of the squared sides), and √3, √3, 0 at a square
corner, 0 for the edge opposite to it (1/q = 2D/(|e₁|² + |e₂|²), Knupp: Algebraic mesh quality metrics, SIAM Journal on
Scientific Computing 23, 2001). The edge b − a does not depend on v, so that of N = L/2 and Q = N/D = √3·q

    ∇N = −(w_a a + w_b b),   ∇²N = (w_a + w_b) I,   w = ∇D = (a_y − b_y, b_x − a_x),
    G = −∇Q = (w_a a + w_b b + Q w)/D,   ∇²Q = ((w_a + w_b) I + w Gᵀ + G wᵀ)/D.

Q is a convex quadratic over a linear function, and so convex where D > 0.

``weights`` is a ``Weights``, or None for the equilateral ones: the formula is then shorter, and chosen when a kernel is
compiled.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES, inlined

# Of the squared edges 01, 02 and 12 of a corner simplex whose corner is its node 0, by the number of its shape.
EQUILATERAL, SQUARE = range(2)
WEIGHTS = np.array([[1.0, 1.0, 1.0], [math.sqrt(3.0), math.sqrt(3.0), 0.0]])
TWO_SQRT3 = 2.0 * math.sqrt(3.0)
TINY = 1e-300  # stands in for a length of zero: the quotient is then zero, not a division by zero


class Weights(NamedTuple):
    """Of |a|², |b|² and |b − a|² in L. half: 0.5 in their type."""

    a: float
    b: float
    opposite: float
    half: float


class Simplices(NamedTuple):
    """Corner simplices of cells.

    rows: (S, 3) nodes, the corner first. orientation: (S,) ±1, −1 where a row is to be read backwards. shapes: (S,) the
    number of the ideal shape of each, None where all are equilateral. cells: (S,) the cell of each, those of one cell
    one after the other; None where each is a cell.
    """

    rows: NDArray[np.int32]
    orientation: NDArray[np.int8]
    shapes: NDArray[np.uint8] | None = None
    cells: NDArray[np.int32] | None = None

    @property
    def cell_count(self) -> int:
        """How many cells they belong to."""
        if self.cells is None:
            return len(self.rows)
        return int(np.count_nonzero(self.cells[1:] != self.cells[:-1])) + (len(self.cells) > 0)

    def take(self, rows: NDArray[np.integer[Any]]) -> Simplices:
        """Some of them."""
        shapes = None if self.shapes is None else self.shapes.take(rows)
        cells = None if self.cells is None else self.cells.take(rows)
        return Simplices(self.rows.take(rows, axis=0), self.orientation.take(rows), shapes, cells)


@inlined
def weights_at_first(shapes, t, forth):
    """The weights of row t of some corner simplices, seen from its node 0; None: all are equilateral.

    shapes: (S,) of each, or None. forth: its nodes stand counter-clockwise; else the other two are swapped.
    """
    if shapes is None:
        return None
    shape = shapes[t]
    return Weights(WEIGHTS[shape, 0 if forth else 1], WEIGHTS[shape, 1 if forth else 0], WEIGHTS[shape, 2], 0.5)


@inlined
def weights_at_last(shapes, t, forth):
    """The same, seen from its node 2: of the edges 20, 21 and 01."""
    if shapes is None:
        return None
    shape = shapes[t]
    return Weights(WEIGHTS[shape, 1 if forth else 2], WEIGHTS[shape, 2 if forth else 1], WEIGHTS[shape, 0], 0.5)


@inlined
def same_cell(cells, one, other):
    """Do the rows ``one`` and ``other`` (which may not exist) belong to one cell? cells: (S,), or None."""
    if cells is None:
        return False
    return other < len(cells) and cells[other] == cells[one]


@inlined
def put_weights(weights, rows, lane):
    """Weights into a lane of three rows of LANES."""
    if weights is not None:
        rows[lane], rows[LANES + lane], rows[2 * LANES + lane] = weights.a, weights.b, weights.opposite


@inlined
def weights_in(shapes, rows, lane):
    """What ``put_weights`` has put there; None where all are equilateral."""
    if shapes is None:
        return None
    return Weights(rows[lane], rows[LANES + lane], rows[2 * LANES + lane], 0.5)


@inlined
def lengths(px, py, qx, qy, weights):
    """L from the squares of the edges: what it is off by is a few roundings of itself, for no term is negative."""
    rx, ry = qx - px, qy - py
    if weights is None:
        return (px * px + py * py) + (qx * qx + qy * qy) + (rx * rx + ry * ry)
    return weights.a * (px * px + py * py) + weights.b * (qx * qx + qy * qy) + weights.opposite * (rx * rx + ry * ry)


@inlined
def sensitivity(weights):
    """What, times δ and the sum of the spokes' absolute components and 4δ, is twice the change of L if coordinates
    change by δ: each squared edge changes by 4δ times its components, and 8δ², and no weight is above √3.
    """
    if weights is None:
        return 16.0
    return 28.0


@inlined
def half_lengths(ax, ay, bx, by, weights):
    """N = L/2."""
    if weights is None:
        return (bx * bx + by * by) + (ay * (ay - by) - ax * (bx - ax))
    ex, ey = bx - ax, by - ay
    twice = weights.a * (ax * ax + ay * ay) + weights.b * (bx * bx + by * by) + weights.opposite * (ex * ex + ey * ey)
    return twice * weights.half


@inlined
def pull(a, b, weights):
    """A component of −∇N."""
    if weights is None:
        return a + b
    return weights.a * a + weights.b * b


@inlined
def roundness(u, weights):
    """u·(w_a + w_b)/2: half of the isotropic part of u·∇²N."""
    if weights is None:
        return u
    return u * ((weights.a + weights.b) * weights.half)


@inlined
def shape_of(px, py, qx, qy, weights):
    """1/q of the simplex (0, p, q)."""
    return TWO_SQRT3 * (px * qy - py * qx) / max(lengths(px, py, qx, qy, weights), TINY)
