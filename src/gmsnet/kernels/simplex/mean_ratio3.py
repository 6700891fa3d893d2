"""The mean ratio of a corner simplex in space: the one place that knows its formula.

With the spokes a, b, c from a vertex v, in the order in which D = a·(b × c) is positive in a valid cell, and the ideal
corner W, let S be ‖A W⁻¹‖²_F, A = (a b c), times a constant: a sum of *weighted squared edges*, whichever vertex is v:

    S = w_a |a|² + w_b |b|² + w_c |c|² + w_ab |b − a|² + w_bc |c − b|² + w_ca |a − c|².

With G = W⁻¹W⁻ᵀ they are w_ab = −G_ab and w_a = G_aa + G_ab + G_ac. The constant is such that for all kinds of cells

    η = 1/q = K·D^(2/3)/S,   K = 6·2^(1/3),

so that one floor serves all of them. The weights are 1 throughout where W is the corner of a regular tetrahedron, and
2·2^(1/3) for the spokes alone at the corner of a cube. η is 12·(3V)^(2/3)/Σl² of a tetrahedron of volume V = D/6 (Liu,
Joe: On the shape of tetrahedra from bisection, Mathematics of Computation 63, 1994). Seen from v, which moves, with the
spokes to fixed places,

    w = (b − a) × (c − a),  D = a·w,  ∇D = −w,  ∇²D = 0,
    s = w_a a + w_b b + w_c c,  σ = w_a + w_b + w_c,  ∇S = −2s,  ∇²S = 2σI.

So f = S^α/D^m has, with s' = (2α/S)s, w' = (m/D)w and v' = ½(1 + 1/m)w' − s',

    −∇f = f·(s' − w'),   ∇²f = f·[(1 − 1/α) s's'ᵀ + w'v'ᵀ + v'w'ᵀ + (2ασ/S) I].

For α = p and m = 2p/3 it is (K q)^p, a convex function of v where D > 0 for p ≥ 1: S is a sum of squares of what is
affine in v, D is affine, and y²/t^(2/3) is convex for t > 0.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined
from gmsnet.kernels.simplex.cube_root import cube_root
from gmsnet.kernels.topology.sorted_unique import sorted_unique

TINY = 1e-300  # stands in for a length of zero: the quotient is then zero, not a division by zero
REGULAR = 6.0 * 2.0 ** (1.0 / 3.0)  # K
THIRD = 1.0 / 3.0
TETRAHEDRON, HEXAHEDRON, WEDGE, PYRAMID = range(4)  # the ideal shapes, and the kinds of cells that have them
_CUBE = 2.0 * 2.0 ** (1.0 / 3.0)
_PRISM = _CUBE * 0.75 ** (1.0 / 3.0)
# (4, 6) the weights of |a|², |b|², |c|², |b − a|², |c − b|² and |a − c|², by the shape; they are those of cells.kind.
WEIGHTS3 = np.array([
    (1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
    (_CUBE, _CUBE, _CUBE, 0.0, 0.0, 0.0),
    (2.0 / 3.0 * _PRISM, 2.0 / 3.0 * _PRISM, _PRISM, 2.0 / 3.0 * _PRISM, 0.0, 0.0),
    (2.0, 2.0, 0.0, -1.0, 2.0, 2.0),
])  # fmt: skip
WEIGHTS3.flags.writeable = False


class Weights3(NamedTuple):
    """Of the squared edges of a corner simplex: the spokes, and the edges opposite to them."""

    a: float
    b: float
    c: float
    ab: float
    bc: float
    ca: float


class Tetrahedra(NamedTuple):
    """Corner simplices of cells in space.

    rows: (S, 4) nodes. orientation: (S,) ±1, −1 where D is to be taken with the other sign. shapes: (S,) the rows of
    WEIGHTS3; None where all cells are tetrahedra. cells: (S,) the number of the cell of each, for simplices of one
    cell stand together; None where each is a cell. solids: those cells, which are valid everywhere or not.
    """

    rows: NDArray[np.int32]
    orientation: NDArray[np.int8]
    shapes: NDArray[np.uint8] | None = None
    cells: NDArray[np.int32] | None = None
    solids: Solids | None = None

    @property
    def cell_count(self) -> int:
        """How many cells they belong to."""
        return len(self.rows) if self.cells is None else len(sorted_unique(self.cells))

    def take(self, rows: NDArray[np.int32]) -> Tetrahedra:
        """Some of them."""
        some = Tetrahedra(self.rows.take(rows, axis=0), self.orientation.take(rows))
        if self.shapes is None or self.cells is None:
            return some
        return some._replace(shapes=self.shapes.take(rows), cells=self.cells.take(rows), solids=self.solids)


class Solids(NamedTuple):
    """Cells of all kinds.

    nodes: (T, 8), of positive sense, behind the corners the first one again. kind: (T,) as above.
    hexahedron, wedge: the forms of their Jacobian determinants (gmsnet.cells.jacobian).
    """

    nodes: NDArray[np.int32]
    kind: NDArray[np.uint8]
    hexahedron: Any
    wedge: Any


@inlined
def same_cell3(cells, t, u):
    """Do the simplices t and u, in this order, belong to one cell?"""
    if cells is None:
        return False
    return u < len(cells) and cells[t] == cells[u]


@inlined
def weights_at(shapes, t):
    """The weights of simplex t; None for tetrahedra."""
    if shapes is None:
        return None
    w = shapes[t]
    return Weights3(WEIGHTS3[w, 0], WEIGHTS3[w, 1], WEIGHTS3[w, 2], WEIGHTS3[w, 3], WEIGHTS3[w, 4], WEIGHTS3[w, 5])


@inlined
def normal(ax, ay, az, bx, by, bz, cx, cy, cz):
    """w = (b − a) × (c − a): the gradient of D with the other sign."""
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@inlined
def determinant(ax, ay, az, bx, by, bz, cx, cy, cz):
    """D = a·(b × c), six times the volume of the simplex."""
    return az * (bx * cy - cx * by) + bz * (cx * ay - ax * cy) + cz * (ax * by - bx * ay)


@inlined
def square(x, y, z):
    """The squared length."""
    return (x * x + y * y) + z * z


@inlined
def shape_of(double, lengths):
    """η of a tetrahedron, with the sign of D. lengths: the sum of its squared edges."""
    size = cube_root(abs(double))
    return math.copysign(REGULAR * size * size / max(lengths, TINY), double)


@inlined
def measured(ax, ay, az, bx, by, bz, cx, cy, cz):
    """D, S, w and s of a corner of a tetrahedron, written for floats and for vectors of them alike."""
    wx, wy, wz = normal(ax, ay, az, bx, by, bz, cx, cy, cz)
    double = (ax * wx + ay * wy) + az * wz
    sx, sy, sz = (ax + bx) + cx, (ay + by) + cy, (az + bz) + cz
    lengths = ((square(ax, ay, az) + square(bx, by, bz)) + square(cx, cy, cz)) * 4.0 - square(sx, sy, sz)
    return double, lengths, wx, wy, wz, sx, sy, sz


@inlined
def measured_by(ax, ay, az, bx, by, bz, cx, cy, cz, wa, wb, wc, wab, wbc, wca):
    """The same of any corner, by its weights."""
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    wx, wy, wz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    double = (ax * wx + ay * wy) + az * wz
    near = (square(ax, ay, az) * wa + square(bx, by, bz) * wb) + square(cx, cy, cz) * wc
    far = (square(ux, uy, uz) * wab + square(vx, vy, vz) * wca) + square(cx - bx, cy - by, cz - bz) * wbc
    sx, sy, sz = (ax * wa + bx * wb) + cx * wc, (ay * wa + by * wb) + cy * wc, (az * wa + bz * wb) + cz * wc
    return double, near + far, wx, wy, wz, sx, sy, sz


@inlined
def measured_as(ax, ay, az, bx, by, bz, cx, cy, cz, weights):
    """The same by six weights, or of a tetrahedron for None."""
    if weights is None:
        return measured(ax, ay, az, bx, by, bz, cx, cy, cz)
    return measured_by(
        ax, ay, az, bx, by, bz, cx, cy, cz, weights.a, weights.b, weights.c, weights.ab, weights.bc, weights.ca
    )


@inlined
def derivatives(f, of_s, of_w, wx, wy, wz, sx, sy, sz, mixed, squared):
    """−∇f and the Hessian of f without its part along I, from f, 2α/S, m/D, w and s, for floats and vectors alike.

    mixed: ½(1 + 1/m). squared: 1 − 1/α. Returns x, y, z, half of xx, yy, zz, and xy, xz, yz.
    """
    sx, sy, sz, wx, wy, wz = sx * of_s, sy * of_s, sz * of_s, wx * of_w, wy * of_w, wz * of_w
    vx, vy, vz = wx * mixed - sx, wy * mixed - sy, wz * mixed - sz
    fx, fy, fz = f * wx, f * wy, f * wz
    g = f * squared
    hx, hy, hz = g * sx, g * sy, g * sz
    return (
        f * sx - fx, f * sy - fy, f * sz - fz,
        fx * vx + hx * sx * 0.5, fy * vy + hy * sy * 0.5, fz * vz + hz * sz * 0.5,
        (fx * vy + fy * vx) + hx * sy, (fx * vz + fz * vx) + hx * sz, (fy * vz + fz * vy) + hy * sz,
    )  # fmt: skip


@inlined
def walled(ratio, wall, steep):
    """f = x/(1 + x) + g and five numbers for ``derivatives``, from x = q^(3/2) and g = w·(q/q_w)^P, P = steep.

    f + g depends on ln q alone. With u = −∇ ln q its gradient is −f₁·u, and its Hessian f₂·uuᵀ + f₁·∇² ln q, as of a
    power p = f₂/f₁ of q that is f₁/p large. f₁ = df/d ln q; f₂ is that of g, and 3/16 of what x/(1 + x) has in f₁, for
    its own is negative. Returns f, f₁/p, 2p, m = 2p/3, ½(1 + 1/m), 1 − 1/p, and f₁ for the part along I.
    """
    share = 1.0 / (ratio + 1.0)
    f = ratio * share
    plain, far = f * share * 1.5, wall * steep
    first, second = plain + far, plain * 0.1875 + far * steep
    inverse = 1.0 / (first * second)
    p, of_p = second * second * inverse, first * first * inverse
    return f + wall, first * of_p, p * 2.0, p * (2.0 / 3.0), of_p * 0.75 + 0.5, of_p * -1.0 + 1.0, first


@inlined
def moved(double, lengths, wx, wy, wz, sx, sy, sz, tx, ty, tz):
    """D and S once the vertex has made the step t."""
    after = double - ((tx * wx + ty * wy) + tz * wz)
    way = ((tx * tx + ty * ty) + tz * tz) * 3.0
    return after, (lengths + way) - ((tx * sx + ty * sy) + tz * sz) * 2.0


@inlined
def moved_by(double, lengths, wx, wy, wz, sx, sy, sz, tx, ty, tz, sigma):
    """The same of any corner, by σ."""
    after = double - ((tx * wx + ty * wy) + tz * wz)
    way = ((tx * tx + ty * ty) + tz * tz) * sigma
    return after, (lengths + way) - ((tx * sx + ty * sy) + tz * sz) * 2.0
