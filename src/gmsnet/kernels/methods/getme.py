"""GETMe, the sequential smoother: the worst element first is made more regular, and nodes follow.

Vartziotis, Wipper: The GETMe Mesh Smoothing Framework (2018), section 6.1.3. The worst element, by 1/q (of a quad that
of its worst corner) plus its penalty, is transformed (kernels.methods.getme_elements); its free nodes go along. If that
would break a cell at one of them, all go back. The book starts from valid meshes; see ``rank`` for inverted elements.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.methods.getme_elements import corners_of, shape_of, square_corner, transformed, transformed_quad
from gmsnet.kernels.methods.heap import build, update
from gmsnet.kernels.star.block import DROPPED, MOVED
from gmsnet.kernels.star.guard import WITH_FLOORS, permitted

INVALID, SUCCESS, REPEATED = 1e-4, 1e-3, 1e-5  # penalties: added, taken off (down to 0 at most), and added
LAST, STUCK = 0, 1  # in ``memory``: the element that was transformed last (−1: none), and whether it was put back


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
        queue.shape[e] = shape_of(points, elements, e)
        queue.penalty[e] = 0.0
        queue.key[e] = rank(queue.shape[e])
    build(queue.heap, queue.place, queue.key)
    queue.memory[LAST] = -1
    queue.memory[STUCK] = 0


@part
def rank(value):
    """What an element of this 1/q is ordered by, without its penalty.

    Inverted ones, which the book does not know, come first, the worst before the others, but not by more than one
    penalty: at the full distance of 1/q a hopeless one would be tried ten thousand times before any other.
    """
    return value if value > 0.0 else INVALID * value


@kernel
def steps(points, elements, queue, transformation, guard, count, tally):
    """So many times the element with the minimum key is transformed. tally: counts of moved and dropped nodes, added
    to.

    An element that is put back gets a penalty; one that is transformed loses some of its own; one that is chosen twice
    running gets a little more. While the same element is put back again and again nothing else changes, so it is not
    transformed anew each time.
    """
    memory, penalty = queue.memory, queue.penalty
    old, target, workspace = np.empty(8), np.empty(8), np.empty(28)
    for _ in range(count):
        e = queue.heap[0]
        corners = corners_of(elements.quad, e)
        repeated = e == memory[LAST]
        if repeated:
            penalty[e] += REPEATED
        movable = 0
        for k in range(corners):
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
            for k in range(2 * corners):
                tally[MOVED] += k % 2 == 0 and (target[k] != old[k] or target[k + 1] != old[k + 1])
            arrange(points, elements, e, queue)
        memory[LAST] = e


@part
def propose(points, elements, e, transformation, single, old, target):
    """Where the corners of an element are (x, y each) and where its free ones are to go; the others stay."""
    corners = corners_of(elements.quad, e)
    a, b, c = elements.corners[e, 0], elements.corners[e, 1], elements.corners[e, 2]
    for k in range(corners):
        old[2 * k], old[2 * k + 1] = points[elements.corners[e, k], 0], points[elements.corners[e, k], 1]
    if corners == 4:
        for k in range(4):
            target[2 * k], target[2 * k + 1] = old[2 * k] - old[0], old[2 * k + 1] - old[1]
        gx, gy = transformed_quad(target, transformation.quad_across, transformation.quad_inward)
    else:
        gx, gy, ox, oy, ux, uy, vx, vy = transformed(
            points[b, 0] - points[a, 0], points[b, 1] - points[a, 1],
            points[c, 0] - points[a, 0], points[c, 1] - points[a, 1],
            transformation.straight, transformation.across,
        )  # fmt: skip
        target[0], target[1] = ox, oy
        target[2], target[3] = ux, uy
        target[4], target[5] = vx, vy
    for k in range(corners):
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
    """Moves the corners of an element to their targets if that breaks no cell; tells whether it has."""
    corners = corners_of(elements.quad, e)
    for k in range(corners):
        i = elements.corners[e, k]
        points[i, 0], points[i, 1] = target[2 * k], target[2 * k + 1]
    for k in range(corners):
        i = elements.corners[e, k]
        if elements.free[i]:
            for at in range(elements.start[i], elements.start[i + 1]):
                f = elements.around[at]
                if seen(elements, e, k, f):
                    continue
                if not allowed(points, elements, f, e, old, guard, workspace):
                    for m in range(corners):
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
            for n in range(corners_of(elements.quad, f)):
                if elements.corners[f, n] == i:
                    return True
    return False


@part
def allowed(points, elements, f, e, old, guard, workspace):
    """May element f be as it is now that the corners of e have left their old places? The rule of
    kernels.star.guard, for each corner simplex that is not what it was."""
    x, was, of_simplex = workspace[:8], workspace[8:16], workspace[16:]
    reach, floor, corners = 0.0, guard.floor, corners_of(elements.quad, f)
    for k in range(corners):
        i = elements.corners[f, k]
        if len(guard) == WITH_FLOORS:
            floor = max(floor, guard.floors[i])
        x[2 * k], x[2 * k + 1] = points[i, 0], points[i, 1]
        was[2 * k], was[2 * k + 1] = points[i, 0], points[i, 1]
        for m in range(corners_of(elements.quad, e)):
            if elements.corners[e, m] == i:
                was[2 * k], was[2 * k + 1] = old[2 * m], old[2 * m + 1]
        for m in range(2 * k, 2 * k + 2):
            reach = max(reach, max(abs(x[m]), abs(was[m])))
    delta = guard.unit * reach + guard.grain
    if corners == 3:
        return permitted(was, x, delta, floor, None)
    for k in range(4):
        before, now, changed = of_simplex[:6], of_simplex[6:], False
        for place, corner in enumerate((k + 1, k + 3, k)):
            for axis in range(2):
                at = 2 * (corner % 4) + axis
                before[2 * place + axis], now[2 * place + axis] = was[at], x[at]
                changed |= was[at] != x[at]
        if changed and not permitted(before, now, delta, floor, square_corner()):
            return False
    return True


@part
def arrange(points, elements, e, queue):
    """Measures the elements around the free corners of e anew, and arranges them."""
    for k in range(corners_of(elements.quad, e)):
        i = elements.corners[e, k]
        if elements.free[i]:
            for at in range(elements.start[i], elements.start[i + 1]):
                f = elements.around[at]
                if seen(elements, e, k, f):
                    continue
                queue.shape[f] = shape_of(points, elements, f)
                queue.key[f] = rank(queue.shape[f]) + queue.penalty[f]
                update(queue.heap, queue.place, queue.key, f)
