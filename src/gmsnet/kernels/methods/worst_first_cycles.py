"""Visits to the free nodes of the worst cells: see methods/worst_first.py."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.methods.missing import any_missing
from gmsnet.kernels.methods.worst_first import descend, gather, way_there
from gmsnet.kernels.star.block import DROPPED, MOVED, TRUNCATED
from gmsnet.kernels.star.constraint import follow
from gmsnet.kernels.star.pattern import count_of, pattern_at
from gmsnet.kernels.star.truncation import HALVINGS

STILL = 1e-8  # of a spoke's square: a move of less leaves a star be


@kernel
def visit_all(points, nodes, stars, guard, doublings, sweeps, scale, awake, tally):
    """``visit`` without a target."""
    visit(points, nodes, stars, guard, doublings, sweeps, scale, None, awake, None, tally)


@part
def visit(points, nodes, stars, guard, doublings, sweeps, scale, target, awake, tried, tally):
    """Visits the nodes in their order, so many times, p = 2^doublings. tally: (3,), added to.

    stars: of all nodes (kernels.star.pattern). scale: see ``descend``. target: a node is left out while no simplex
    around it misses that (kernels.methods.missing), if there is one. awake: (N,) bool, all False before and
    after: a node is left out while neither it nor a neighbour has moved since it was found to move no more. tried:
    (N,) bool, to become True of the nodes that the target has not left out, if there is one.
    """
    start, around = stars.start, stars.around
    most = 0
    for i in nodes:
        n = start[i + 1] - start[i]
        most = max(most, 2 * n + count_of(pattern_at(stars.patterns, stars.pattern, i), n))
        awake[i] = True
    star = np.empty(most + 1)
    for _ in range(sweeps):
        for i in nodes:
            if not awake[i]:
                continue
            n, pattern = gather(points, i, stars, guard, star)
            x, y = points[i, 0], points[i, 1]
            awake[i] = False
            if target is not None:
                if not any_missing(star, n, pattern, x, y, target[0], target[1]):
                    continue
                tried[i] = True
            tx, ty = descend(star, n, pattern, x, y, scale, doublings, guard.constraint, i)
            if tx == x and ty == y:
                continue
            tx, ty, halvings = way_there(star, n, pattern, x, y, tx, ty, guard, i)
            tally[DROPPED] += halvings == HALVINGS
            tally[TRUNCATED] += 0 < halvings < HALVINGS
            tally[MOVED] += halvings < HALVINGS
            points[i, 0], points[i, 1] = tx, ty
            follow(guard.constraint, i, tx, ty)
            dx, dy, sx, sy = tx - x, ty - y, star[0] - x, star[1] - y
            if dx * dx + dy * dy > STILL * (sx * sx + sy * sy):
                awake[i] = True
                for k in range(start[i], start[i + 1]):
                    awake[around[k]] = True
    for i in nodes:
        awake[i] = False
        for k in range(start[i], start[i + 1]):
            awake[around[k]] = False
