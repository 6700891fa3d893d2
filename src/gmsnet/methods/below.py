"""The cells below a target: Newton's method on high powers of q, at the free nodes of these cells alone.

A round visits the free nodes of the cells that miss the target, the next one those that have such a cell yet, with a
higher power, so that ever more weight is on the cells that miss it. A node whose cells have been untangled by a
neighbour before its turn comes stays where it is. That leaves fewer cells below the target than sweeps over
patches do, in a fraction of the time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods import below as kernels
from gmsnet.kernels.methods import ranking, shell
from gmsnet.kernels.star.guard import Guard
from gmsnet.measure.target import Target
from gmsnet.methods.base import Field, Smoother, Tally
from gmsnet.parallel.executor import Executor
from gmsnet.topology.shell import Shell

MANY = 0.25  # of the cells: where more miss the target, most of them cannot be had, and others would be lost for them
SMALL = 1000  # cells: so few cost nothing
MOST = 4  # visits, times the free nodes there are


class Round(NamedTuple):
    """power: p = 2^power. visits: to each node."""

    power: int
    visits: int


NEAR = (Round(2, 1), Round(3, 1), Round(4, 2), Round(5, 2), Round(6, 2), Round(6, 2))
GENTLE = (Round(1, 1), Round(2, 1), Round(2, 2), Round(3, 2), Round(3, 2))  # for angles: a needle's q is not the worst
WIDE = (Round(5, 2), Round(6, 2), Round(6, 2))


class Below(Smoother):
    """See the module; one sweep, all rounds. everywhere: the first round visits all free nodes there are."""

    least: float
    everywhere: bool
    target: Target
    plan: NDArray[Any]
    limits: tuple[float, float]
    converged: bool
    target_reached: bool

    def __init__(self, target: Target, plan: Sequence[Round], everywhere: bool) -> None:
        self.least, self.plan, self.everywhere = target.shape, np.array(plan), everywhere
        self.target, self.limits = target, target.limits
        self.converged = self.target_reached = False

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother. The visits depend on each other, so that they are made on one thread."""
        if isinstance(field.topology, Shell):
            return self._on_surface(field, field.topology, field.guard(executor))
        topology, tally = field.planar, np.zeros(3, dtype=np.int64)
        simplices = topology.changeable
        self.converged = True
        rows: NDArray[np.int32] = kernels.missed(field.points, simplices, *self.limits)
        self.target_reached = not len(rows)
        if self.target_reached or len(rows) > max(MANY * len(simplices.rows), SMALL):
            return tally
        shape = np.empty(len(rows))
        ranking.shapes_of(field.points, simplices, rows, shape)
        if not self.limits[1]:  # of angles other cells can be the worst
            field.floor.watch(rows, shape)
        free = topology.near_free
        if self.everywhere:
            places = np.flatnonzero(free).astype(np.int32)
            nodes = places[np.argsort(topology.memory[places])]
        else:
            seen = np.zeros(len(free), dtype=np.bool_)
            nodes = ranking.free_nodes(simplices.rows, rows, shape, np.inf, free, topology.memory, seen)
        left = kernels.rounds(
            field.points, nodes, topology.links, free, topology.memory, field.guard(executor), self.plan,
            MOST * len(topology.free), self.least, self.limits, self.everywhere, tally,
        )  # fmt: skip
        self.target_reached = not len(left)
        return tally

    def _on_surface(self, field: Field, topology: Shell, guard: Guard) -> Tally:
        """The same on a surface in space."""
        points, simplices, tally = field.points, topology.changeable, np.zeros(3, dtype=np.int64)
        rows, self.converged = self.target.corners_missing(points, simplices), True
        if len(rows) > max(MANY * len(simplices.rows), SMALL):
            return tally
        seen, everywhere = np.zeros(len(points), dtype=np.bool_), self.everywhere
        for power, visits in self.plan:
            if not len(rows):
                break
            chosen = topology.near_free.copy()
            if not everywhere:
                chosen[:] = False
                chosen[simplices.rows[rows]] = True
                chosen &= topology.near_free
            places = np.flatnonzero(chosen).astype(np.int32)
            nodes, everywhere = places[np.argsort(topology.memory[places])], False
            scale = self.least / math.sqrt(3.0)
            shell.visit(points, topology.stars_of(nodes), nodes, guard, power, visits, scale, seen, tally)
            rows = self.target.corners_missing(points, simplices)
        self.target_reached = not len(rows)
        return tally
