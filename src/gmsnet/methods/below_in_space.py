"""The tetrahedra below a target: Newton's method on powers of q, or of 1/θ, at the free nodes of these cells alone.

As in the plane (methods/below.py), rounds go to the cells that miss it yet, with powers that rise. For a minimum η it
is the sweep of the barrier, (q/q_target)^p; where dihedral angles are asked for, that of kernels/methods/descent3.py,
with the η that must be kept, or is asked for, beside them, and what the largest angles lack to 180°: so that none
comes as near to that as the smallest ones are to 0°.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import descent3
from gmsnet.kernels.methods.barrier3 import K3, Power3, sweep3
from gmsnet.kernels.simplex.objectives3 import DIHEDRAL, Aim3
from gmsnet.kernels.star.guard import STAR, Guard
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.measure.target import Target
from gmsnet.methods.base import Field, Smoother, Tally, over_stars
from gmsnet.methods.below import MANY, SMALL
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume

NO_SIZES = np.empty(0)
MANY_ANGLES = 0.06  # of the cells: of so many no smallest angle is bettered without another falling


class Round(NamedTuple):
    """number: k of p = 3·2^k, of angles of p = 2^k. visits: to each node."""

    number: int
    visits: int


SHAPES = (Round(0, 1), Round(1, 1), Round(2, 2), Round(3, 2), Round(4, 4), Round(5, 6))
ANGLES = (Round(3, 1), Round(4, 2), Round(4, 2), Round(5, 4), Round(5, 4), Round(6, 6), Round(6, 6))


class BelowInSpace(Smoother):
    """See the module; one sweep, all rounds.

    floor: of D/S^(3/2), which for dihedral angles stands in the place of the guard's, but at the level of stars.
    everywhere: the first round visits all free nodes there are.
    """

    target: Target
    floor: float
    everywhere: bool
    converged: bool
    target_reached: bool

    def __init__(self, target: Target, floor: float, everywhere: bool) -> None:
        self.target, self.floor, self.everywhere = target, floor, everywhere
        self.converged = self.target_reached = False

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        topology, tally = field.topology, np.zeros(3, dtype=np.int64)
        assert isinstance(topology, Volume)
        self.converged, cells = True, topology.changeable
        rows, _ = self.target.tetrahedra_missing(field.points, cells)
        self.target_reached = not len(rows)
        many = MANY if self.target.dihedral is None else MANY_ANGLES
        if self.target_reached or len(rows) > max(many * cells.cell_count, SMALL):
            return tally
        guard, everywhere = field.guard(executor), self.everywhere
        if self.target.dihedral is not None and field.level != STAR:
            guard = guard._replace(floor=self.floor)
        for each in SHAPES if self.target.dihedral is None else ANGLES:
            chosen = topology.near_free.copy()
            if not everywhere:
                chosen[:] = False
                chosen[cells.rows[rows]] = True
                chosen &= topology.near_free
            stars, visit = topology.stars_of(np.flatnonzero(chosen)), self._visit(field.points, guard, each.number)
            for _ in range(each.visits):
                tally += over_stars(visit, stars, field.points, executor)
            everywhere = False
            rows, _ = self.target.tetrahedra_missing(field.points, cells)
            if not len(rows):
                break
        self.target_reached = not len(rows)
        return tally

    def _visit(
        self, points: NDArray[np.float64], guard: Guard, number: int
    ) -> Callable[[SpaceBlocks, int, int, Tally], None]:
        """What visits a range of blocks."""
        quality, dihedral = self.target.quality, self.target.dihedral
        if dihedral is None:
            assert quality is not None
            power = Power3.of(number, quality**-3.0)

            def by_shape(blocks: SpaceBlocks, first: int, last: int, counts: Tally) -> None:
                sweep3(points, blocks, first, last, guard, power, 1.0, counts)

            return by_shape
        bound = max(guard.floor, 0.0, 0.0 if quality is None else math.sqrt(quality**3 / K3))
        enough = math.radians(dihedral) if quality is None else math.inf
        aim = Aim3(DIHEDRAL, number, 1.0, enough, bound)

        def by_angle(blocks: SpaceBlocks, first: int, last: int, counts: Tally) -> None:
            descent3.sweep3(points, blocks, first, last, guard, aim, 1, NO_SIZES, counts)

        return by_angle
