"""From cheap to thorough: Laplacian sweeps on the bad stars, the barrier on patches that grow, the barrier on all."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gmsnet.kernels import untangle as kernels
from gmsnet.kernels import untangle_barrier as barrier
from gmsnet.kernels.quality import TWO_SQRT3
from gmsnet.untangle.harmonic import harmonic
from gmsnet.untangle.lbfgs import minimise
from gmsnet.untangle.patch import Flags, Floats, Patch, free_nodes_of, in_order
from gmsnet.untangle.reasons import proven
from gmsnet.untangle.result import Stage
from gmsnet.untangle.tangle import Tangle

LAPLACIAN_SWEEPS = 8
MEDIANS, WEIGHING = 2, 5  # the first sweeps are to medians of the rings, by so many steps from the mean
RINGS = (2, 6, 20, 10**9)  # of the patches around what is left to mend
MOST = 0.75  # a patch of a larger share of the free nodes becomes one of all
NEWTON_SWEEPS = 12
FEW = 0.25  # harmonic places are a better start if they leave no more than this share of the cells to mend
ROUNDS, ITERATIONS = 30, 60  # of L-BFGS: so many values of ε, so many iterations for each
PATIENCE, LAST_PATIENCE = 3, 8
POLISH, SLIVER = 3, 0.01  # so many sweeps at the end where a cell that was moved has a 1/q below this
LEAST_EPSILON = 1e-3  # in local areas
CLOSING = 0.2  # ε as a share of the worst cell's D while that is negative: Garanzha et al., their listing 1
AVERAGING = 4  # rounds of averaging for the local area


def follow(tangle: Tangle) -> Iterator[Stage]:
    """Untangles; yields what each stage has done, and ends when nothing is left or nothing is left to try."""
    if not tangle.left:
        return
    yield bad_stars(tangle)
    points, bad, left = tangle.points.copy(), tangle.bad.copy(), tangle.left  # the best so far
    tried: Patch | None = None
    for rings in RINGS:
        patch = tangle.around(rings)
        if patch.count > MOST * len(tangle.topology.free):
            patch = tangle.around(RINGS[-1])
        if not patch.count or (tried and np.array_equal(patch.every, tried.every)):
            break
        tried = patch
        last = patch.count == len(tangle.topology.free)
        yield from mend(tangle, patch, "all nodes" if last else f"{rings} rings", LAST_PATIENCE if last else PATIENCE)
        if tangle.left < left:
            points, bad, left = tangle.points.copy(), tangle.bad.copy(), tangle.left
        if proven(tangle.topology, points, bad):
            break
    if tangle.left:
        keep_gains(tangle, points, bad)


def keep_gains(tangle: Tangle, before: Floats, bad: Flags) -> None:
    """Pieces that have moved since some points (N, 2), without fewer cells being bad than were then, go back there."""
    topology = tangle.topology
    patch = Patch.of(topology, in_order(topology, (tangle.points != before).any(axis=1)))
    piece = np.full(len(tangle.points), -1, dtype=np.int32)
    piece[patch.nodes] = patch.part
    of_cell = piece[topology.near].max(axis=1)  # no cell has moved nodes of two
    was, now = (np.bincount(of_cell[flags & (of_cell >= 0)], minlength=patch.parts) for flags in (bad, tangle.bad))
    useless = patch.nodes[(now >= was)[patch.part]]
    tangle.points[useless] = before[useless]
    tangle.look()


def bad_stars(tangle: Tangle) -> Stage:
    """Laplacian sweeps over the stars that have a bad cell at the time."""
    chosen = tangle.bad_nodes()
    visited = chosen.copy()
    sweeps = 0
    while sweeps < LAPLACIAN_SWEEPS and chosen.any():
        tangle.average(in_order(tangle.topology, chosen), WEIGHING if sweeps < MEDIANS else 0)
        chosen = tangle.bad_among(chosen)
        visited |= chosen
        sweeps += 1
    tangle.look()
    return Stage("Laplacian, bad stars", int(visited.sum()), sweeps, tangle.left)


def mend(tangle: Tangle, patch: Patch, where: str, patience: int) -> Iterator[Stage]:
    """The barrier on a patch: Newton sweeps; from harmonic places if these are better; L-BFGS on what is left."""
    points = tangle.points[patch.every]
    open_, sweeps = newton(tangle, patch, points)
    tangle.put(points, patch)
    yield Stage(f"barrier, Newton, {where}", patch.count, sweeps, tangle.look())
    if not open_.any():
        return
    hard = patch.only(tangle.topology, open_)
    points = tangle.points[hard.every]
    start = harmonic(points, hard)
    if tangle.uncertified(start, hard) <= FEW * tangle.uncertified(points, hard):
        open_, sweeps = newton(tangle, hard, start)
        tangle.put(start, hard)
        yield Stage(f"harmonic and barrier, Newton, {where}", hard.count, sweeps, tangle.look())
        if not open_.any():
            return
    else:
        open_ = np.ones(hard.parts, dtype=bool)
    moved = iterations = 0
    for piece in hard.pieces(tangle.topology, open_):
        moved += piece.count
        iterations += whole(tangle, piece, patience)
    yield Stage(f"barrier, L-BFGS, {where}", moved, iterations, tangle.look())


def newton(tangle: Tangle, patch: Patch, points: Floats) -> tuple[Flags, int]:
    """Sweeps with an ε of its own for each piece, until all cells are certified; which pieces are not, and sweeps.

    points: (m, 2) of the patch, changed.
    """
    precision = tangle.precision
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    worst = np.empty(patch.parts)
    for done in range(NEWTON_SWEEPS + 1):
        barrier.least(points, patch.cells, scale, patch.part, precision.unit, precision.grain, worst)
        if (worst > 0.0).all() and tangle.certified(points, patch):
            return worst <= 0.0, done
        if done < NEWTON_SWEEPS:
            epsilon = closing(worst)[patch.part]
            sweep(tangle, patch, points, scale, epsilon, barrier.FREELY)
    return ~(worst > 0.0), NEWTON_SWEEPS


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


def whole(tangle: Tangle, patch: Patch, patience: int) -> int:
    """L-BFGS on a piece until all its cells are certified; takes over where it has come to; returns iterations.

    patience: after so many values of ε that have not made the worst cell any better, it is given up.
    """
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
        if since > patience:
            break
        iterations += minimise(points, patch, scale, float(closing(worst)[0]), ITERATIONS)
    tangle.put(points, patch)
    return iterations


def polish(tangle: Tangle) -> Stage:
    """A few Newton sweeps on the stars of slivers that untangling has left; certified stars stay so."""
    slivers, topology = np.empty(len(tangle.bad), dtype=bool), tangle.topology
    kernels.find_slivers(
        tangle.points, tangle.before, topology.near, topology.near_turn, SLIVER / TWO_SQRT3, slivers
    )  # fmt: skip
    patch = Patch.of(topology, in_order(topology, free_nodes_of(topology, slivers)))
    points = tangle.points[patch.every]
    scale = barrier.local_area(points, patch.cells, AVERAGING)
    epsilon = np.full(patch.count, LEAST_EPSILON)
    for _ in range(POLISH):
        sweep(tangle, patch, points, scale, epsilon, barrier.CERTIFIED)
    tangle.put(points, patch)
    return Stage("barrier, slivers", patch.count, POLISH, tangle.left)  # no cell changes its sign by that
