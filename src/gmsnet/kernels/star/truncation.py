"""Truncation: shifts that the guard does not allow are halved, as the paper's Algorithm 1 does, or dropped."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, part
from gmsnet.kernels.star.block import (
    CENTRE,
    CORNERS,
    DROPPED,
    FLOORS,
    KEPT,
    MARGIN,
    MOVED,
    REACH,
    SHARE,
    SIZE,
    TARGET,
    TRUNCATED,
)
from gmsnet.kernels.star.certificate import certify_stars
from gmsnet.kernels.star.constraint import follow, on_curve
from gmsnet.kernels.star.guard import margin_above, permitted
from gmsnet.kernels.star.pattern import count_of, pair_of, weights_of

HALVINGS, FEW_HALVINGS = 20, 6


@part
def halve_in_lanes(n, pattern, centre, workspace, shift, guard):
    """Halves the shifts of the lanes that are not allowed, all at once, until none is left or FEW_HALVINGS are made.

    For the level STAR, which refuses many moves whatever their length: those that make the worst cell of a star worse
    to first order. Row MARGIN: positive where the target is allowed; −∞ where the shift is to be dropped; else the
    scalar form, which knows inverted cells, is to try. Row SHARE: how much of the shift is left, 0 if none is allowed.
    """
    star, work = workspace.star, workspace.work
    for lane in range(LANES):
        work[SHARE * LANES + lane] = 1.0
    for _ in range(FEW_HALVINGS):
        refused = 0
        for lane in range(LANES):
            halve = not work[MARGIN * LANES + lane] > 0.0
            refused += halve
            share = work[SHARE * LANES + lane] * (0.5 if halve else 1.0)
            work[SHARE * LANES + lane] = share
            size = work[SIZE * LANES + lane] * share
            work[TARGET * LANES + lane] = work[CENTRE * LANES + lane] + size * shift[lane]
            work[(TARGET + 1) * LANES + lane] = work[(CENTRE + 1) * LANES + lane] + size * shift[LANES + lane]
        if guard.single:
            for k in range(TARGET * LANES, (TARGET + 2) * LANES):
                work[k] = np.float64(np.float32(work[k]))
        snap_back(guard.constraint, centre, work)
        if refused == 0:
            return
        certify_stars(star, n, pattern, 1.0, guard.unit, guard.grain, work)
    for lane in range(LANES):
        allowed_now = work[MARGIN * LANES + lane] > 0.0
        work[SHARE * LANES + lane] = work[SHARE * LANES + lane] if allowed_now else 0.0
    for k in range(2 * LANES):
        work[KEPT * LANES + k] = work[TARGET * LANES + k]
        work[TARGET * LANES + k] = work[CENTRE * LANES + k]
    certify_stars(star, n, pattern, 0.0, guard.unit, guard.grain, work)  # the stars as they are
    for lane in range(LANES):
        margin = -np.inf if work[MARGIN * LANES + lane] > 0.0 else 0.0
        work[MARGIN * LANES + lane] = 1.0 if work[SHARE * LANES + lane] > 0.0 else margin
    for k in range(2 * LANES):
        work[TARGET * LANES + k] = work[KEPT * LANES + k]


@part
def truncate(points, i, n, pattern, lane, workspace, shift, guard, tally):
    """Halves the shift of one lane until it is allowed (Algorithm 1), or drops it.

    Below a floor a triangle comes by its first-order change, so that more than FEW_HALVINGS hardly ever help.
    """
    single, halvings = guard.single, HALVINGS if guard.floor <= 0.0 else FEW_HALVINGS
    star, work = workspace.star, workspace.work
    x, y, size = star[2 * lane], star[2 * lane + 1], work[SIZE * LANES + lane]
    dx = size * shift[lane]
    dy = size * shift[LANES + lane]
    if not (np.isfinite(dx) and np.isfinite(dy)):
        tally[DROPPED] += 1
        return
    for halving in range(halvings):
        tx = x + dx
        ty = y + dy
        if single:
            tx, ty = np.float64(np.float32(tx)), np.float64(np.float32(ty))
        tx, ty = on_curve(guard.constraint, i, tx, ty)
        if tx == x and ty == y:
            break
        delta = guard.unit * max(work[REACH * LANES + lane], max(abs(tx), abs(ty))) + guard.grain
        # Above a positive floor no triangle is inverted; what was inverted is for the whole rule to judge.
        if (
            clear(tx, ty, star, n, pattern, lane, delta, guard.floor)
            if guard.floor > 0.0
            else allowed(tx, ty, star, n, pattern, lane, delta, work)
        ):
            points[i, 0] = tx
            points[i, 1] = ty
            follow(guard.constraint, i, tx, ty)
            tally[MOVED] += 1
            tally[TRUNCATED] += halving > 0
            return
        dx *= 0.5
        dy *= 0.5
    tally[DROPPED] += 1


@part
def snap_back(constraint, centre, work):
    """The targets of the nodes that slide go to their curves."""
    if constraint is not None:
        for lane in range(LANES):
            tx, ty = on_curve(constraint, centre[lane], work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane])
            work[TARGET * LANES + lane], work[(TARGET + 1) * LANES + lane] = tx, ty


@part
def clear(tx, ty, star, n, pattern, lane, delta, floor):
    """Is each triangle of one lane certified above a floor that is not negative, with the free node at (tx, ty)?"""
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        a, b = 2 * ((i + 1) * LANES + lane), 2 * ((j + 1) * LANES + lane)
        px, py, qx, qy = star[a] - tx, star[a + 1] - ty, star[b] - tx, star[b + 1] - ty
        if not margin_above(px, py, qx, qy, delta, floor, weights_of(pattern, k, np.float64)) > 0.0:
            return False
    return True


@part
def allowed(tx, ty, star, n, pattern, lane, delta, work):
    """May the free node of one lane move to (tx, ty)? The scalar form of the rule, which also knows inverted cells.

    Rows of work: reads those from FLOORS on.
    """
    half, end = len(work) - CORNERS // 2, len(work)
    was, now = work[half - CORNERS // 2 : half], work[half:end]
    was[4], was[5], now[4], now[5] = star[2 * lane], star[2 * lane + 1], tx, ty
    for k in range(count_of(pattern, n)):
        i, j = pair_of(pattern, n, k)
        a, b = 2 * ((i + 1) * LANES + lane), 2 * ((j + 1) * LANES + lane)
        was[0], was[1], was[2], was[3] = star[a], star[a + 1], star[b], star[b + 1]
        for c in range(4):  # an assignment of slices would take seconds to compile
            now[c] = was[c]
        if not permitted(was, now, delta, work[(FLOORS + k) * LANES + lane], weights_of(pattern, k, np.float64)):
            return False
    return True
