"""The smallest dihedral angles of a volume first: Newton's method on Σ(s/θ)^p at the free nodes of few cells.

A cell's measure is the lesser of its smallest dihedral angle and of what its largest lacks to 180°, times a weight. A
cycle takes the cells of the least measure, a share of all, and visits their nodes (kernels/methods/descent3.py), but
those around which no cell is as bad as the best of these any more. The floor of the guard is part of the objective:
along it angles can gain where straight against it they cannot.

Powers of q do not do that, for a needle and a cap of the same η have different angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from gmsnet.kernels.methods.descent3 import sweep3
from gmsnet.kernels.simplex.objectives3 import DIHEDRAL, Aim3
from gmsnet.kernels.star.guard import STAR, Guard, MeshGuard
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.dihedral import WIDE, ratios_of, renew, worst
from gmsnet.methods.again import over_changing
from gmsnet.methods.base import Field, Smoother, Tally
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume

NO_SIZES = np.empty(0)


class Cycle(NamedTuple):
    """share: of all cells. doublings: p = 2^doublings. sweeps: over their free nodes."""

    share: float
    doublings: int
    sweeps: int


CYCLES = (Cycle(0.001, 4, 3), Cycle(0.0005, 5, 4), Cycle(0.0003, 6, 6))
LARGE_CYCLES = (Cycle(0.0004, 5, 5),)  # of large meshes, where the cycles above take a fifth of a whole call
FEWEST = 12  # cells


class Dihedral(Smoother):
    """One sweep is all cycles.

    floor: of D/S^(3/2) in the place of the guard's, but at the level of stars. goal: a measure in degrees of which no
    more is asked. wide: the weight of what angles lack to 180°. before, after: the least measure.
    """

    cycles: Sequence[Cycle]
    floor: float | None
    goal: float
    wide: float

    phase = "dihedral angles"
    before: float = math.inf
    after: float = math.inf

    def __init__(
        self, cycles: Sequence[Cycle] = CYCLES, floor: float | None = None, goal: float = math.inf, wide: float = WIDE
    ) -> None:
        self.cycles, self.floor, self.goal, self.wide = cycles, floor, goal, wide

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        topology, tally = field.topology, np.zeros(3, dtype=np.int64)
        assert isinstance(topology, Volume)
        cells = topology.changeable
        guard: Guard
        if self.floor is None or field.level == STAR:
            guard = field.guard(executor)
        else:
            guard = MeshGuard(*field.precision, self.floor, field.constraint)
        ratios = ratios_of(field.points, cells, executor)
        for number, cycle in enumerate(self.cycles):
            every = executor.counted(np.ones(len(cells.rows), dtype=bool))
            count = min(max(FEWEST, math.ceil(cycle.share * every)), every)
            ranked = worst(field.points, cells, count, self.wide, executor, ratios)
            self.after = ranked.least
            self.before = self.before if number else self.after
            chosen = ranked.rows[ranked.measure < self.goal]
            if not ranked.least < self.goal:
                return tally
            nodes = sorted_unique(cells.rows[chosen])
            nodes = nodes[topology.near_free[nodes]]
            enough = min(ranked.most, self.goal)
            aim = Aim3(DIHEDRAL, cycle.doublings, self.wide, math.radians(enough), max(guard.floor, 0.0))

            def visit(blocks: SpaceBlocks, first: int, last: int, counts: Tally, aim: Aim3 = aim) -> None:
                sweep3(field.points, blocks, first, last, guard, aim, 1, NO_SIZES, counts)

            tally += over_changing(visit, nodes, cycle.sweeps, field, executor)
            renew(ratios, field.points, cells, nodes, executor)
        self.after = worst(field.points, cells, 1, self.wide, executor, ratios).least
        return tally
