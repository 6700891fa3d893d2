"""From cheap to thorough: Laplacian sweeps on the bad stars, the barrier on patches that grow, the barrier on all."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gmsnet.untangle.guarded import worst_nodes
from gmsnet.untangle.harmonic import harmonic
from gmsnet.untangle.lbfgs import whole
from gmsnet.untangle.newton import keep_gains, newton
from gmsnet.untangle.patch import Patch
from gmsnet.untangle.reasons import freeze_hopeless
from gmsnet.untangle.result import UntanglingStep
from gmsnet.untangle.state import UntanglingState

LAPLACIAN_SWEEPS = 8
MEDIANS, WEIGHING = 2, 5  # the first sweeps are to medians of the rings, by so many steps from the mean
RINGS = (2, 6, 20, 60, 10**9)  # of the patches around what is left to mend
LEAP = 10  # how many times as many nodes the largest patch may have as the one before
MOST = 0.5  # a patch of a larger share of the free nodes becomes one of all
FEW = 0.25  # harmonic places are a better start if they leave no more than this share of the cells to mend
PATIENCE, LAST_PATIENCE = 3, 8  # of L-BFGS, and where the patch cannot grow any more


def escalate(tangle: UntanglingState) -> Iterator[UntanglingStep]:
    """Untangles; yields what each step has done, and ends when nothing is left or nothing is left to try."""
    if not tangle.left:
        return
    yield worst_nodes(tangle)
    if not tangle.left:
        return
    yield bad_stars(tangle)
    points, bad, left = tangle.points.copy(), tangle.bad.copy(), tangle.left  # the best so far
    tried: Patch | None = None
    for rings in RINGS:
        patch = tangle.around(rings)
        if patch.count > MOST * tangle.reach.free:
            patch = tangle.around(RINGS[-1])
        if not patch.count or (tried and np.array_equal(patch.every, tried.every)):
            break
        if tried and rings == RINGS[-1] and patch.count > LEAP * tried.count:
            break  # what so large a patch could not mend is not untangled by one of all nodes either
        tried = patch
        last = patch.count == tangle.reach.free
        where = "all nodes" if last else "all rings" if rings == RINGS[-1] else f"{rings} rings"
        yield from mend(tangle, patch, where, LAST_PATIENCE if last else PATIENCE)
        if tangle.left < left:
            points, bad, left = tangle.points.copy(), tangle.bad.copy(), tangle.left
        if tangle.left and freeze_hopeless(tangle, points, bad):
            keep_gains(tangle, points, bad)
    if tangle.left:
        keep_gains(tangle, points, bad)


def bad_stars(tangle: UntanglingState) -> UntanglingStep:
    """Laplacian sweeps over the stars that have a bad cell at the time."""
    chosen = tangle.bad_nodes()
    visited = chosen.copy()
    sweeps = 0
    while sweeps < LAPLACIAN_SWEEPS and chosen.any():
        tangle.average(tangle.in_order(chosen), WEIGHING if sweeps < MEDIANS else 0)
        chosen = tangle.bad_among(chosen)
        visited |= chosen
        sweeps += 1
    tangle.look()
    return UntanglingStep("Laplacian, bad stars", int(visited.sum()), sweeps, tangle.left)


def mend(tangle: UntanglingState, patch: Patch, where: str, patience: int) -> Iterator[UntanglingStep]:
    """The barrier on a patch: Newton sweeps; from harmonic places if these are better; L-BFGS on what is left."""
    points = tangle.points[patch.every]
    open_, sweeps = newton(tangle, patch, points)
    tangle.put(points, patch)
    yield UntanglingStep(f"barrier, Newton, {where}", patch.count, sweeps, tangle.look())
    if not open_.any():
        return
    hard = patch.only(tangle.topology, open_)
    points = tangle.points[hard.every]
    start = harmonic(points, hard)
    if tangle.uncertified(start, hard) <= FEW * tangle.uncertified(points, hard):
        open_, sweeps = newton(tangle, hard, start)
        tangle.put(start, hard)
        yield UntanglingStep(f"harmonic and barrier, Newton, {where}", hard.count, sweeps, tangle.look())
        if not open_.any():
            return
    else:
        open_ = np.ones(hard.parts, dtype=bool)
    moved = iterations = 0
    for piece in hard.pieces(tangle.topology, open_):
        moved += piece.count
        iterations += whole(tangle, piece, patience)
    yield UntanglingStep(f"barrier, L-BFGS, {where}", moved, iterations, tangle.look())
