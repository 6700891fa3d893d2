"""From cheap to thorough: Laplacian sweeps on the bad stars, the barrier on patches that grow, the barrier on all."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gmsnet.kernels import untangle_barrier as barrier
from gmsnet.untangle.lbfgs import minimise
from gmsnet.untangle.patch import Flags, Floats, Patch, in_order
from gmsnet.untangle.result import Stage
from gmsnet.untangle.tangle import Tangle

LAPLACIAN_SWEEPS = 8
MEDIANS, WEIGHING = 2, 5  # the first sweeps are to medians of the rings, by so many steps from the mean
RINGS = (2, 6, 20, 10**9)  # of the patches around what is left to mend
NEWTON_SWEEPS = 30
ROUNDS, ITERATIONS = 30, 60  # of L-BFGS: so many values of ε, so many iterations for each
POLISH = 3
LEAST_EPSILON = 1e-3  # in local areas
CLOSING = 0.2  # ε as a share of the worst cell's D while that is negative: Garanzha et al., their listing 1
AVERAGING = 4  # rounds of averaging for the local area


def follow(tangle: Tangle) -> Iterator[Stage]:
    """Untangles; yields what each stage has done, and ends when nothing is left or nothing is left to try."""
    if not tangle.left:
        return
    yield bad_stars(tangle)
    patch = None
    for rings in RINGS:
        if not tangle.left:
            return
        wider = tangle.around(rings)
        if not wider.count or (patch is not None and np.array_equal(patch.every, wider.every)):
            return
        patch = wider
        yield from mend(tangle, patch, "all nodes" if rings == RINGS[-1] else f"{rings} rings")


def bad_stars(tangle: Tangle) -> Stage:
    """Laplacian sweeps over the stars that have a bad cell at the time."""
    visited = np.zeros(len(tangle.points), dtype=bool)
    sweeps = 0
    while tangle.left and sweeps < LAPLACIAN_SWEEPS:
        chosen = tangle.bad_nodes()
        visited |= chosen
        tangle.average(in_order(tangle.topology, chosen), WEIGHING if sweeps < MEDIANS else 0)
        tangle.look()
        sweeps += 1
    return Stage("Laplacian, bad stars", int(visited.sum()), sweeps, tangle.left)


def mend(tangle: Tangle, patch: Patch, where: str) -> Iterator[Stage]:
    """The barrier on a patch: Newton sweeps, then L-BFGS on the pieces that those have not mended."""
    points = tangle.points[patch.every]
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    open_, sweeps = newton(tangle, patch, points, scale)
    tangle.put(points, patch)
    yield Stage(f"barrier, Newton, {where}", patch.count, sweeps, tangle.look())
    if not open_.any():
        return
    moved = iterations = 0
    for piece in patch.pieces(tangle.topology, open_):
        moved += piece.count
        iterations += whole(tangle, piece)
    yield Stage(f"barrier, L-BFGS, {where}", moved, iterations, tangle.look())


def newton(tangle: Tangle, patch: Patch, points: Floats, scale: Floats) -> tuple[Flags, int]:
    """Sweeps with an ε of its own for each piece, until all cells are certified; which pieces are not, and sweeps."""
    precision = tangle.precision
    worst = np.empty(patch.parts)
    for done in range(NEWTON_SWEEPS + 1):
        barrier.least(points, patch.cells, scale, patch.part, precision.unit, precision.grain, worst)
        if (worst > 0.0).all() and tangle.certified(points, patch):
            polish(tangle, patch, points, scale)
            return worst <= 0.0, done
        if done < NEWTON_SWEEPS:
            epsilon = closing(worst)[patch.part]
            sweep(tangle, patch, points, scale, epsilon, barrier.FREELY)
    polish(tangle, patch, points, scale)
    return worst <= 0.0, NEWTON_SWEEPS


def sweep(
    tangle: Tangle, patch: Patch, points: Floats, scale: Floats, epsilon: Floats, mode: int, floor: float = -math.inf
) -> int:
    """One sweep of Newton steps over the moved nodes of a patch; see the kernel."""
    precision, nodes = tangle.precision, np.arange(patch.count, dtype=np.int32)
    single = mode != barrier.FREELY and precision.single
    moved: int = barrier.sweep(
        points, nodes, patch.start, patch.ring, scale, epsilon, mode, precision.unit, precision.grain, single, floor
    )
    return moved


def closing(worst: Floats) -> Floats:
    """ε for the worst D over the local area: so wide that the cell still feels it, and narrower as it gets better."""
    return np.sqrt(LEAST_EPSILON**2 + (CLOSING * np.minimum(worst, 0.0)) ** 2)


def whole(tangle: Tangle, patch: Patch) -> int:
    """L-BFGS on a piece until all its cells are certified; takes over where it has come to; returns iterations."""
    precision = tangle.precision
    points = tangle.points[patch.every]
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    worst = np.empty(patch.parts)
    iterations, best, since = 0, -math.inf, 0
    for _ in range(ROUNDS):
        barrier.least(points, patch.cells, scale, patch.part, precision.unit, precision.grain, worst)
        if worst[0] > 0.0 and tangle.certified(points, patch):
            break
        since = 0 if worst[0] > best + 0.01 * abs(best) else since + 1
        best = max(best, float(worst[0]))
        if since > 5:
            break
        iterations += minimise(points, patch, scale, float(closing(worst)[0]), ITERATIONS)
    polish(tangle, patch, points, scale)
    tangle.put(points, patch)
    return iterations


def polish(tangle: Tangle, patch: Patch, points: Floats, scale: Floats) -> None:
    """A few Newton sweeps on certified stars, which stay so, unless rounding would undo that."""
    epsilon = np.full(patch.count, LEAST_EPSILON)
    before, was_certified = points.copy(), tangle.certified(points, patch)
    for _ in range(POLISH):
        sweep(tangle, patch, points, scale, epsilon, barrier.CERTIFIED)
    if was_certified and not tangle.certified(points, patch):
        points[:] = before
