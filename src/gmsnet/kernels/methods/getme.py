"""GETMe: elements are transformed into more regular ones, and nodes follow.

Vartziotis, Wipper: The GETMe Mesh Smoothing Framework (2018), chapters 5 and 6. A counter-clockwise triangle z₀, z₁, z₂
becomes, with indices modulo 3 and J(x, y) = (y, −x),

    z″_k = z_k + c₁·J(z_{k+1} − z_{k−1}) + c₂·(z_{k−1} + z_{k+1} − 2·z_k),    c₁ = (1 − λ)·tan θ,  c₂ = λ(1 − λ) − c₁²,

which is two passes of erecting similar triangles with the base angle θ on its sides. Of a triangle the last bracket is
−3(z_k − g), g the centroid, so

    z″_k − g = (1 − 3c₂)·(z_k − g) + c₁·J(z_{k+1} − z_{k−1}).

As complex numbers z_k − g = a·ωᵏ + b·ω⁻ᵏ with ω = exp(2πi/3): a is the triangle's equilateral part, b a clockwise one.
One transformation multiplies a by 1 − 3c₂ + √3·c₁ and b by 1 − 3c₂ − √3·c₁. So b fades against a if c₁ > 0 and
c₂ < 1/3, also if it is the larger at first: an inverted triangle turns positive on the way to equilateral.
The result is scaled about g to the perimeter before, and taken by the share ρ: (1 − ρ)·z + ρ·z″.

Here: the transformation, and the sequential smoother (section 6.1.3). The worst element, by 1/q plus its penalty, is
transformed; its free nodes go along. If that would break a triangle at one of them, all go back. The book starts from
valid meshes; see ``rank`` for inverted elements.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.methods.heap import build, update
from gmsnet.kernels.simplex.mean_ratio2 import TINY, TWO_SQRT3
from gmsnet.kernels.star.block import DROPPED, MOVED
from gmsnet.kernels.star.guard import WITH_FLOORS, permitted

INVALID, SUCCESS, REPEATED = 1e-4, 1e-3, 1e-5  # penalties: added, taken off (down to 0 at most), and added
LAST, STUCK = 0, 1  # in ``memory``: the element that was transformed last (−1: none), and whether it was put back


class Transformation(NamedTuple):
    """straight: 1 − 3c₂. across: c₁. relaxation: ρ. exponent: η, which only the simultaneous variant reads."""

    straight: float
    across: float
    relaxation: float
    exponent: int

    @classmethod
    def of(cls, theta: float, lambda_: float, relaxation: float, exponent: int = 0) -> Transformation:
        """From the base angle θ, λ, ρ and η."""
        across = (1.0 - lambda_) * math.tan(theta)
        return cls(1.0 - 3.0 * (lambda_ * (1.0 - lambda_) - across**2), across, relaxation, exponent)


class Elements(NamedTuple):
    """The triangles that have a free node.

    corners: (E, 3) nodes, counter-clockwise where the triangle is valid. free: (N,) bool. around, start: the elements
    of each node in CSR form, start (N + 1).
    """

    corners: NDArray[np.int32]
    free: NDArray[np.bool_]
    start: NDArray[np.int32]
    around: NDArray[np.int32]


class Queue(NamedTuple):
    """The elements by their keys, rank of 1/q + penalty (kernels.methods.heap), and what a step must know of the
    last one."""

    heap: NDArray[np.int32]
    place: NDArray[np.int32]
    key: NDArray[np.float64]
    shape: NDArray[np.float64]
    penalty: NDArray[np.float64]
    memory: NDArray[np.int64]


@kernel
def fill(queue, points, elements):
    """Measures all elements and arranges them; no penalties yet."""
    for e in range(len(elements.corners)):
        queue.shape[e] = shape_of(points, elements.corners, e)
        queue.penalty[e] = 0.0
        queue.key[e] = rank(queue.shape[e])
    build(queue.heap, queue.place, queue.key)
    queue.memory[LAST] = -1
    queue.memory[STUCK] = 0


@part
def shape_of(points, corners, e):
    """1/q of an element, with the sign of its area (kernels.simplex.measures)."""
    a, b, c = corners[e, 0], corners[e, 1], corners[e, 2]
    return shape(
        points[b, 0] - points[a, 0], points[b, 1] - points[a, 1],
        points[c, 0] - points[a, 0], points[c, 1] - points[a, 1],
    )  # fmt: skip


@part
def shape(px, py, qx, qy):
    """1/q of the triangle 0, p, q."""
    rx, ry = qx - px, qy - py
    lengths = px * px + py * py + qx * qx + qy * qy + rx * rx + ry * ry
    return TWO_SQRT3 * (px * qy - py * qx) / max(lengths, TINY)


@part
def rank(value):
    """What an element of this 1/q is ordered by, without its penalty.

    Inverted ones, which the book does not know, come first, the worst before the others, but not by more than one
    penalty: at the full distance of 1/q a hopeless one would be tried ten thousand times before any other.
    """
    return value if value > 0.0 else INVALID * value


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
def length(x, y):
    """Of a vector; coordinates are near 1 or in single precision, so that squares neither under- nor overflow."""
    return math.sqrt(x * x + y * y)


@kernel
def steps(points, elements, queue, transformation, guard, count, tally):
    """So many times the element with the minimum key is transformed. tally: counts of moved and dropped nodes, added
    to.

    An element that is put back gets a penalty; one that is transformed loses some of its own; one that is chosen twice
    running gets a little more. While the same element is put back again and again nothing else changes, so it is not
    transformed anew each time.
    """
    memory, penalty = queue.memory, queue.penalty
    old, target, workspace = np.empty(6), np.empty(6), np.empty(12)
    for _ in range(count):
        e = queue.heap[0]
        repeated = e == memory[LAST]
        if repeated:
            penalty[e] += REPEATED
        movable = 0
        for k in range(3):
            movable += elements.free[elements.corners[e, k]]
        if not (repeated and memory[STUCK]):
            propose(points, elements, e, transformation, guard.single, old, target)
            memory[STUCK] = not moved(points, elements, e, old, target, guard, workspace)
        if memory[STUCK]:
            penalty[e] += INVALID
            tally[DROPPED] += movable
            queue.key[e] = rank(queue.shape[e]) + penalty[e]
            update(queue.heap, queue.place, queue.key, e)
        else:
            penalty[e] = max(0.0, penalty[e] - SUCCESS)
            for k in range(6):
                tally[MOVED] += k % 2 == 0 and (target[k] != old[k] or target[k + 1] != old[k + 1])
            arrange(points, elements, e, queue)
        memory[LAST] = e


@part
def propose(points, elements, e, transformation, single, old, target):
    """Where the corners of an element are (x, y each) and where its free ones are to go; the others stay."""
    a, b, c = elements.corners[e, 0], elements.corners[e, 1], elements.corners[e, 2]
    for k in range(3):
        old[2 * k], old[2 * k + 1] = points[elements.corners[e, k], 0], points[elements.corners[e, k], 1]
    gx, gy, ox, oy, ux, uy, vx, vy = transformed(
        points[b, 0] - points[a, 0], points[b, 1] - points[a, 1],
        points[c, 0] - points[a, 0], points[c, 1] - points[a, 1],
        transformation.straight, transformation.across,
    )  # fmt: skip
    target[0], target[1] = ox, oy
    target[2], target[3] = ux, uy
    target[4], target[5] = vx, vy
    for k in range(3):
        # The shift is relaxed, not the place: far from the origin it has digits that the place has not.
        dx = transformation.relaxation * ((points[a, 0] - old[2 * k]) + gx + target[2 * k])
        dy = transformation.relaxation * ((points[a, 1] - old[2 * k + 1]) + gy + target[2 * k + 1])
        target[2 * k], target[2 * k + 1] = old[2 * k], old[2 * k + 1]
        if elements.free[elements.corners[e, k]]:
            target[2 * k] += dx
            target[2 * k + 1] += dy
            if single:
                target[2 * k], target[2 * k + 1] = np.float32(target[2 * k]), np.float32(target[2 * k + 1])


@part
def moved(points, elements, e, old, target, guard, workspace):
    """Moves the corners of an element to their targets if that breaks no triangle; tells whether it has."""
    for k in range(3):
        i = elements.corners[e, k]
        points[i, 0], points[i, 1] = target[2 * k], target[2 * k + 1]
    for k in range(3):
        i = elements.corners[e, k]
        if elements.free[i]:
            for at in range(elements.start[i], elements.start[i + 1]):
                f = elements.around[at]
                if seen(elements, e, k, f):
                    continue
                if not allowed(points, elements.corners, f, e, old, guard, workspace):
                    for m in range(3):
                        j = elements.corners[e, m]
                        points[j, 0], points[j, 1] = old[2 * m], old[2 * m + 1]
                    return False
    return True


@part
def seen(elements, e, k, f):
    """Has element f been met already at one of the free corners of e before the k-th?"""
    for m in range(k):
        i = elements.corners[e, m]
        if elements.free[i]:
            for n in range(3):
                if elements.corners[f, n] == i:
                    return True
    return False


@part
def allowed(points, corners, f, e, old, guard, workspace):
    """May element f be as it is now that the corners of e have left their old places? The rule of
    kernels.star.guard."""
    x, was = workspace[:6], workspace[6:]
    reach, floor = 0.0, guard.floor
    for k in range(3):
        i = corners[f, k]
        if len(guard) == WITH_FLOORS:
            floor = max(floor, guard.floors[i])
        x[2 * k], x[2 * k + 1] = points[i, 0], points[i, 1]
        was[2 * k], was[2 * k + 1] = points[i, 0], points[i, 1]
        for m in range(3):
            if corners[e, m] == i:
                was[2 * k], was[2 * k + 1] = old[2 * m], old[2 * m + 1]
        for m in range(2 * k, 2 * k + 2):
            reach = max(reach, max(abs(x[m]), abs(was[m])))
    return permitted(was, x, guard.unit * reach + guard.grain, floor, None)


@part
def arrange(points, elements, e, queue):
    """Measures the elements around the free corners of e anew, and arranges them."""
    for k in range(3):
        i = elements.corners[e, k]
        if elements.free[i]:
            for at in range(elements.start[i], elements.start[i + 1]):
                f = elements.around[at]
                if seen(elements, e, k, f):
                    continue
                queue.shape[f] = shape_of(points, elements.corners, f)
                queue.key[f] = rank(queue.shape[f]) + queue.penalty[f]
                update(queue.heap, queue.place, queue.key, f)
