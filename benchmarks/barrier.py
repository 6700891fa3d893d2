"""Whole-mesh L-BFGS on Σ (q/top)^p over the simplices of a mesh or of a part of it, with p a power of two.

The simplices are triangles, whose ideal is equilateral, and the corners of quads, whose ideal is half a square. A
barrier: q of a simplex of area zero or less is +∞. With the corner at the origin, the others at a and b
counter-clockwise, D = a×b and w = ∇D = (a_y − b_y, b_x − a_x), derivatives by the corner's place:

    q = α(|a|² + |b|² − γ a·b)/D,   ∇q = −(α(2 − γ)(a + b) + q w)/D,   ∇²q = (2α(2 − γ)I − w∇qᵀ − ∇q wᵀ)/D

with α = 1/√3, γ = 1 for an equilateral ideal, α = 1/2, γ = 0 for a right one. By the other end of a the numerator has
the derivative α(2a − γb) and the second one 2αI. q^p has p q^{p−1} ∇q and p q^{p−1} ∇²q + p(p − 1) q^{p−2} ∇q∇qᵀ. In
the coordinates of one node it is convex, so the 2×2 blocks of the Hessian on the diagonal are positive definite: their
inverses, at the place where the step starts or some steps before it, are L-BFGS's H₀ (times the usual γ; Nocedal,
Wright: Numerical Optimization, section 7.2). Cells of q 1e6 beside cells of q 1 need that. The line search brackets a
step that fulfils the weak Wolfe conditions (Lewis, Overton: Nonsmooth optimization via quasi-Newton methods, 2013,
algorithm 4.6) between 0 and the largest step at which no triangle has come to area zero, which is exact: D is a
quadratic function of the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gmsnet.kernels.jit.compile import kernel

KAPPA = 1.0 / math.sqrt(3.0)
PAIRS = 12  # steps that L-BFGS remembers
ARMIJO, WOLFE = 1e-4, 0.9
TRIALS = 60  # of one line search
INSIDE = 0.95  # of the way to where a first triangle has area zero
UNSTEADY, REFRESH = 100, 20  # the blocks are computed in each of the first iterations, then in every so many


@dataclass(frozen=True, eq=False)
class Problem:
    """triangles: (T, 3) rows of points, counter-clockwise, the corner first. free: (N,) bool, which points may move.

    right: (T,) bool, which of the triangles are corners of quads.
    """

    triangles: np.ndarray
    free: np.ndarray
    right: np.ndarray

    def part(self, cells: np.ndarray, rings: int) -> tuple[Problem, np.ndarray]:
        """The problem of the free nodes of some cells and of so many rings around them; and its points' rows here."""
        moves = np.zeros(len(self.free), dtype=bool)
        moves[self.triangles[cells]] = True
        for _ in range(rings):
            moves[self.triangles[moves[self.triangles].any(axis=1)]] = True
        moves &= self.free
        touched = moves[self.triangles].any(axis=1)
        nodes, local = np.unique(self.triangles[touched], return_inverse=True)
        return Problem(local.reshape(-1, 3).astype(np.int32), moves[nodes], self.right[touched]), nodes


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where L-BFGS ended.

    points: (N, 2). value: the mean of (q/top)^p. gradient: the Euclidean norm of its derivative. step: the longest
    Newton step that a node alone would still take, over its mean distance from neighbours. iterations, evaluations:
    how many. converged: whether ``step`` came below what was asked for.
    """

    points: np.ndarray
    value: float
    gradient: float
    step: float
    iterations: int
    evaluations: int
    converged: bool


@kernel
def aspects(points, triangles, right, out):
    """(T,) q of each triangle; +∞ from area zero on."""
    for t in range(len(triangles)):
        alpha, gamma = (0.5, 0.0) if right[t] else (KAPPA, 1.0)
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        d = ax * by - ay * bx
        numerator = alpha * (ax * ax + ay * ay + bx * bx + by * by - gamma * (ax * bx) - gamma * (ay * by))
        out[t] = numerator / d if d > 0.0 else np.inf


@kernel
def evaluate(points, triangles, right, top, doublings, gradient, blocks):
    """The mean of (q/top)^p, p = 2^doublings; +∞ where a triangle has no area.

    gradient: (N, 2). blocks: (N, 3) xx, xy, yy of the Hessian, or of length 0 if not wanted.
    """
    gradient[:] = 0.0
    blocks[:] = 0.0
    with_blocks = len(blocks) > 0
    total, p, inverse = 0.0, 2.0**doublings, 1.0 / len(triangles)
    for t in range(len(triangles)):
        alpha, gamma = (0.5, 0.0) if right[t] else (KAPPA, 1.0)
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        d = ax * by - ay * bx
        if not d > 0.0:
            return np.inf
        over = 1.0 / d
        q = alpha * (ax * ax + ay * ay + bx * bx + by * by - gamma * (ax * bx) - gamma * (ay * by)) * over
        power = q / top
        for _ in range(doublings):
            power *= power
        total += power
        slope = p * power / q * inverse
        bend = (p - 1.0) / q
        for corner in range(3):  # (nx, ny) = −∇ of the numerator, curve half its second derivative
            if corner == 0:
                node, curve = i, alpha * (2.0 - gamma)
                ux, uy, vx, vy = ax, ay, bx, by
                nx, ny = curve * (ux + vx), curve * (uy + vy)
            elif corner == 1:
                node, curve = j, alpha
                ux, uy, vx, vy = bx - ax, by - ay, -ax, -ay
                nx, ny = alpha * ((gamma * bx - ax) - ax), alpha * ((gamma * by - ay) - ay)
            else:
                node, curve = k, alpha
                ux, uy, vx, vy = -bx, -by, ax - bx, ay - by
                nx, ny = alpha * ((gamma * ax - bx) - bx), alpha * ((gamma * ay - by) - by)
            wx, wy = uy - vy, vx - ux
            gx = -(nx + q * wx) * over
            gy = -(ny + q * wy) * over
            gradient[node, 0] += slope * gx
            gradient[node, 1] += slope * gy
            if with_blocks:
                blocks[node, 0] += slope * (2.0 * (curve - wx * gx) * over + bend * gx * gx)
                blocks[node, 1] += slope * (-(wx * gy + wy * gx) * over + bend * gx * gy)
                blocks[node, 2] += slope * (2.0 * (curve - wy * gy) * over + bend * gy * gy)
    return total * inverse


@kernel
def largest_step(points, triangles, direction):
    """The least step along the direction at which a triangle of positive area has area zero; +∞ if none has."""
    least = np.inf
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        bx, by = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1]
        ux, uy = direction[j, 0] - direction[i, 0], direction[j, 1] - direction[i, 1]
        vx, vy = direction[k, 0] - direction[i, 0], direction[k, 1] - direction[i, 1]
        # D(s) = c + b s + a s² with c > 0: the least positive root, by the form without cancellation.
        c, b, a = ax * by - ay * bx, ax * vy - ay * vx + ux * by - uy * bx, ux * vy - uy * vx
        inside = b * b - 4.0 * a * c
        if inside >= 0.0:
            root = math.sqrt(inside)
            if b < 0.0:
                least = min(least, 2.0 * c / (root - b))
            elif a < 0.0:
                least = min(least, (-b - root) / (2.0 * a))
    return least


@kernel
def solve(blocks, free, vector, out):
    """out = the inverses of the blocks times the vector, zero where a node is held."""
    for i in range(len(free)):
        xx, xy, yy = blocks[i, 0], blocks[i, 1], blocks[i, 2]
        determinant = xx * yy - xy * xy
        if free[i] and determinant > 0.0:
            out[i, 0] = (yy * vector[i, 0] - xy * vector[i, 1]) / determinant
            out[i, 1] = (xx * vector[i, 1] - xy * vector[i, 0]) / determinant
        else:
            out[i, 0] = out[i, 1] = 0.0


@kernel
def mean_distance(points, triangles, out):
    """(N,) of each node to the other corners of its triangles."""
    count = np.zeros(len(out))
    out[:] = 0.0
    for t in range(len(triangles)):
        for side in range(3):
            i, j = triangles[t, side], triangles[t, (side + 1) % 3]
            length = math.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1])
            out[i] += length
            out[j] += length
            count[i] += 1.0
            count[j] += 1.0
    for i in range(len(out)):
        out[i] /= max(count[i], 1.0)


@kernel
def dot(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1]
    return total


@kernel
def add(target, factor, other):
    for i in range(len(target)):
        target[i, 0] += factor * other[i, 0]
        target[i, 1] += factor * other[i, 1]


@kernel
def descent(gradient, blocks, free, steps, changes, first, count, work, out):
    """out = −H·gradient by the two loops, over the pairs first, first − 1, … (a ring buffer of PAIRS)."""
    alpha, rho = np.zeros(PAIRS), np.zeros(PAIRS)
    work[:] = gradient
    for back in range(count):
        k = (first - back) % PAIRS
        rho[k] = 1.0 / dot(steps[k], changes[k])
        alpha[k] = rho[k] * dot(steps[k], work)
        add(work, -alpha[k], changes[k])
    solve(blocks, free, work, out)
    if count > 0:
        solve(blocks, free, changes[first], work)
        gamma = 1.0 / (rho[first] * dot(changes[first], work))
        for i in range(len(out)):
            out[i, 0] *= gamma
            out[i, 1] *= gamma
    for back in range(count - 1, -1, -1):
        k = (first - back) % PAIRS
        add(out, alpha[k] - rho[k] * dot(changes[k], out), steps[k])
    for i in range(len(out)):
        out[i, 0], out[i, 1] = -out[i, 0], -out[i, 1]


def minimise(problem: Problem, start: np.ndarray, power: int, *, top: float = 1.0, tolerance: float = 1e-6,
             most: int = 20_000) -> Minimum:  # fmt: skip
    """Minimises the mean of (q/top)^power over the free points, from points (N, 2) without a triangle of no area.

    tolerance: of ``Minimum.step``. most: iterations. Raises ValueError for a start outside the barrier, or a power
    that is not a power of two.
    """
    doublings = power.bit_length() - 1
    if power < 1 or power != 1 << doublings:
        raise ValueError(f"the power must be 1, 2, 4, 8, …; got {power}")
    triangles, free, right = problem.triangles, problem.free, problem.right
    points = start.copy()
    gradient, blocks = np.empty_like(points), np.empty((len(points), 3))
    trial_gradient, none = np.empty_like(points), np.empty((0, 3))
    steps, changes = np.zeros((PAIRS, *points.shape)), np.zeros((PAIRS, *points.shape))
    work, direction, sizes = np.empty_like(points), np.empty_like(points), np.empty(len(points))
    mean_distance(points, triangles, sizes)
    value = evaluate(points, triangles, right, top, doublings, gradient, blocks)
    if not np.isfinite(value):
        raise ValueError("a triangle of the start has no area: there is no barrier to stay inside of")
    gradient[~free] = 0.0
    first, count, evaluations, step = 0, 0, 1, math.inf
    for iteration in range(most + 1):
        solve(blocks, free, gradient, work)
        step = float((np.hypot(work[:, 0], work[:, 1]) / sizes).max(initial=0.0))
        if step <= tolerance or iteration == most:
            break
        descent(gradient, blocks, free, steps, changes, first, count, work, direction)
        slope = dot(gradient, direction)
        if not slope < 0.0:
            if count == 0:
                break
            count = 0  # the pairs are stale: steepest descent in the metric of the blocks
            continue
        low, high = 0.0, INSIDE * largest_step(points, triangles, direction)
        length = min(1.0, high)
        for _ in range(TRIALS):
            trial = points + length * direction
            found = evaluate(trial, triangles, right, top, doublings, trial_gradient, none)
            evaluations += 1
            trial_gradient[~free] = 0.0
            if not found <= value + ARMIJO * length * slope:
                high = length
            elif dot(trial_gradient, direction) < WOLFE * slope and length < high:
                low = length
            else:
                break
            length = 0.5 * (low + high) if high < math.inf else 2.0 * length
        if not found < value:
            if count == 0:
                break  # rounding
            count = 0
            continue
        first = (first + 1) % PAIRS
        steps[first], changes[first] = trial - points, trial_gradient - gradient
        count = min(count + 1, PAIRS) if dot(steps[first], changes[first]) > 0.0 else 0
        points = trial
        value, gradient, trial_gradient = found, trial_gradient, gradient
        if iteration < UNSTEADY or iteration % REFRESH == 0:
            evaluate(points, triangles, right, top, doublings, gradient, blocks)
            gradient[~free] = 0.0
            mean_distance(points, triangles, sizes)
    return Minimum(points, value, float(np.linalg.norm(gradient)), step, iteration, evaluations, step <= tolerance)
