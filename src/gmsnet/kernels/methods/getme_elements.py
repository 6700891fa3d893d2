"""The elements of GETMe, and how each kind is transformed into a more regular one.

Vartziotis, Wipper: The GETMe Mesh Smoothing Framework (2018), chapter 5. A counter-clockwise polygon z₀ … z_{n−1}
becomes, with indices modulo n and J(x, y) = (y, −x),

    z″_k = z_k + c₁·J(z_{k+1} − z_{k−1}) + c₂·(z_{k−1} + z_{k+1} − 2·z_k),    c₁ = (1 − λ)·tan θ,  c₂ = λ(1 − λ) − c₁²,

which is two passes of erecting similar triangles with the base angle θ on its sides. As complex numbers z_k is a sum of
regular polygons aₘ·ωᵏᵐ, ω = exp(2πi/n), and each of them is multiplied by

    ηₘ = 1 − 2c₂(1 − cos 2πm/n) + 2c₁ sin 2πm/n:

a₀ is the centroid and stays, a₁ the regular counter-clockwise part, all others fade against it if η₁ is the largest.

Of a triangle the last bracket is −3(z_k − g), g the centroid, so that

    z″_k − g = (1 − 3c₂)·(z_k − g) + c₁·J(z_{k+1} − z_{k−1}).

η₁ = 1 − 3c₂ + √3·c₁ and η₂ = 1 − 3c₂ − √3·c₁: the clockwise part fades if c₁ > 0 and c₂ < 1/3, also if it is the
larger at first: an inverted triangle turns positive on the way to equilateral.

Of a quad η₁ = 1 − 2c₂ + 2c₁, η₂ = 1 − 4c₂ (two opposite corners come in, the others go out) and η₃ = 1 − 2c₂ − 2c₁.
With θ = π/4 and λ = ½, which is c₁ = ½ and c₂ = 0, they are 2, 1 and 0: each transformation halves what is not square,
and the clockwise part is gone at once. (With λ = 0 there is no square at the end unless θ < π/4: η₂ > η₁.)

The result is scaled about g to the perimeter before, and taken by the share ρ: (1 − ρ)·z + ρ·z″.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex import mean_ratio2
from gmsnet.kernels.simplex.mean_ratio2 import SQUARE, TINY, TWO_SQRT3, WEIGHTS, Weights

QUAD_THETA, QUAD_LAMBDA = math.pi / 4.0, 0.5
SQUARE_A, SQUARE_B, SQUARE_OPPOSITE = (float(weight) for weight in WEIGHTS[SQUARE])


class Transformation(NamedTuple):
    """straight: 1 − 3c₂. across: c₁. relaxation: ρ. exponent: η, which only the simultaneous variant reads.

    quad_across, quad_inward: c₁ and c₂ of quads.
    """

    straight: float
    across: float
    relaxation: float
    exponent: int
    quad_across: float
    quad_inward: float

    @classmethod
    def of(cls, theta: float, lambda_: float, relaxation: float, exponent: int = 0) -> Transformation:
        """From the base angle θ and λ of triangles, ρ and η; quads have QUAD_THETA and QUAD_LAMBDA."""
        across = (1.0 - lambda_) * math.tan(theta)
        quad_across = (1.0 - QUAD_LAMBDA) * math.tan(QUAD_THETA)
        return cls(
            1.0 - 3.0 * (lambda_ * (1.0 - lambda_) - across**2), across, relaxation, exponent,
            quad_across, QUAD_LAMBDA * (1.0 - QUAD_LAMBDA) - quad_across**2,
        )  # fmt: skip


class Elements(NamedTuple):
    """The triangles and quads that have a free node.

    corners: (E, 3) nodes, counter-clockwise where the element is valid; (E, 4) where there are quads, −1 in the last
    column for triangles. free: (N,) bool. around, start: the elements of each node in CSR form, start (N + 1). quad:
    (E,) bool, None where all are triangles.
    """

    corners: NDArray[np.int32]
    free: NDArray[np.bool_]
    start: NDArray[np.int32]
    around: NDArray[np.int32]
    quad: NDArray[np.bool_] | None = None


@inlined
def corners_of(quad, e):
    """How many corners element e has. quad: (E,) bool, or None."""
    if quad is None:
        return 3
    return 4 if quad[e] else 3


@inlined
def square_corner():
    """The weights of a square corner (kernels.simplex.mean_ratio2)."""
    return Weights(SQUARE_A, SQUARE_B, SQUARE_OPPOSITE, 0.5)


@part
def shape_of(points, elements, e):
    """1/q of an element, with the sign of its area (kernels.simplex.measures); of a quad that of its worst corner."""
    corners = elements.corners
    if corners_of(elements.quad, e) == 4:
        worst = np.inf
        for k in range(4):
            v, a, b = corners[e, k], corners[e, (k + 1) % 4], corners[e, (k + 3) % 4]
            px, py = points[a, 0] - points[v, 0], points[a, 1] - points[v, 1]
            qx, qy = points[b, 0] - points[v, 0], points[b, 1] - points[v, 1]
            worst = min(worst, mean_ratio2.shape_of(px, py, qx, qy, square_corner()))
        return worst
    a, b, c = corners[e, 0], corners[e, 1], corners[e, 2]
    return shape(
        points[b, 0] - points[a, 0], points[b, 1] - points[a, 1],
        points[c, 0] - points[a, 0], points[c, 1] - points[a, 1],
    )  # fmt: skip


@part
def shape(px, py, qx, qy):
    """1/q of the triangle 0, p, q, in the order of operations on which results have rested from the start."""
    rx, ry = qx - px, qy - py
    lengths = px * px + py * py + qx * qx + qy * qy + rx * rx + ry * ry
    return TWO_SQRT3 * (px * qy - py * qx) / max(lengths, TINY)


@inlined
def square_shape(ax, ay, dx, dy, bx, by):
    """1/q of the worst corner of the quad 0, a, d, b."""
    square = square_corner()
    one = min(
        mean_ratio2.shape_of(ax, ay, bx, by, square),
        mean_ratio2.shape_of(dx - ax, dy - ay, -ax, -ay, square),
    )
    other = min(
        mean_ratio2.shape_of(bx - dx, by - dy, ax - dx, ay - dy, square),
        mean_ratio2.shape_of(-bx, -by, dx - bx, dy - by, square),
    )
    return min(one, other)


@part
def transformed(px, py, qx, qy, straight, across):
    """The triangle 0, p, q transformed and scaled: its centroid, and the new place of each corner from there."""
    gx, gy = (px + qx) / 3.0, (py + qy) / 3.0
    ox, oy = across * (py - qy) - straight * gx, across * (qx - px) - straight * gy
    ux, uy = straight * (px - gx) + across * qy, straight * (py - gy) - across * qx
    vx, vy = straight * (qx - gx) - across * py, straight * (qy - gy) + across * px
    old = length(px, py) + length(qx, qy) + length(qx - px, qy - py)
    new = length(ux - ox, uy - oy) + length(vx - ox, vy - oy) + length(vx - ux, vy - uy)
    s = old / max(new, TINY)
    return gx, gy, s * ox, s * oy, s * ux, s * uy, s * vx, s * vy


@part
def transformed_quad(z, across, inward):
    """A quad z (x, y of each corner) transformed and scaled, in its place: each corner from the centroid, returned."""
    gx, gy = (z[0] + z[2] + z[4] + z[6]) / 4.0, (z[1] + z[3] + z[5] + z[7]) / 4.0
    # z_{k−1} + z_{k+1} is the sum of the other diagonal's ends.
    ax, ay, bx, by = z[2] - z[6], z[3] - z[7], z[4] - z[0], z[5] - z[1]
    even_x, even_y, odd_x, odd_y = z[0] + z[4], z[1] + z[5], z[2] + z[6], z[3] + z[7]
    old = side(z, 0, 2) + side(z, 2, 4) + side(z, 4, 6) + side(z, 6, 0)
    for k in range(4):
        x, y, sign = z[2 * k], z[2 * k + 1], 1.0 if k < 2 else -1.0
        if k % 2 == 0:
            ex, ey, sx, sy = sign * ax, sign * ay, odd_x, odd_y
        else:
            ex, ey, sx, sy = sign * bx, sign * by, even_x, even_y
        z[2 * k] = x + across * ey + inward * (sx - 2.0 * x) - gx
        z[2 * k + 1] = y - across * ex + inward * (sy - 2.0 * y) - gy
    new = side(z, 0, 2) + side(z, 2, 4) + side(z, 4, 6) + side(z, 6, 0)
    s = old / max(new, TINY)
    for k in range(8):
        z[k] *= s
    return gx, gy


@inlined
def side(z, i, j):
    """The distance of two corners."""
    return length(z[j] - z[i], z[j + 1] - z[i + 1])


@part
def length(x, y):
    """Of a vector; coordinates are near 1 or in single precision, so that squares neither under- nor overflow."""
    return math.sqrt(x * x + y * y)
