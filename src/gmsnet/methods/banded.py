"""Shape within bands of the areas: near walls, where cells are to stay as large as they are.

Newton steps on powers of q with a barrier at the ends of the bands (kernels/methods/banded.py). The powers rise and the
barrier gives way from step to step of PLAN. One sweep is one step of it, in which each node is visited ``passes``
times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import banded as kernels
from gmsnet.kernels.methods import bands, ranking
from gmsnet.kernels.star.block import Blocks
from gmsnet.kernels.star.guard import Guard
from gmsnet.methods.base import Field, StarSmoother, Tally
from gmsnet.methods.sized import places_of
from gmsnet.parallel.executor import Executor
from gmsnet.topology.topology import Topology


class Step(NamedTuple):
    """The power is 2^doublings, the barrier weighs ``weight`` against the worst cell, each node is visited so often."""

    doublings: int
    weight: float
    passes: int


PLAN = (
    Step(1, 0.05, 4), Step(3, 0.1, 20), Step(4, 0.1, 20), Step(4, 0.03, 30), Step(4, 0.01, 30), Step(4, 0.003, 20),
)  # fmt: skip


POOREST = 0.5  # 1/q of a worst cell that others are measured by: by a worse one, the barrier would be all they see


class Kept(NamedTuple):
    """Which cells have bands, and how wide; all (N,), in one order.

    nodes: bool, the cells all of whose corners are among these have bands. blend, room: see kernels.methods.bands.
    heights: of the nodes of a wall how firmly the heights over it are kept, above 0 to 1; of others 0.
    """

    nodes: NDArray[np.bool_]
    blend: NDArray[np.float64]
    room: NDArray[np.float64]
    heights: NDArray[np.float64]

    @classmethod
    def nothing(cls, count: int) -> Kept:
        """No bands for so many nodes."""
        return cls(np.zeros(count, dtype=bool), np.zeros(count), np.ones(count), np.zeros(count))

    @classmethod
    def of_columns(cls, columns: Iterable[NDArray[np.float64]]) -> Kept:
        """From its arrays, all as float64, in their order."""
        nodes, *others = columns
        return cls(nodes > 0.0, *others)

    def taken(self, order: NDArray[np.int32]) -> Kept:
        """The same in another order."""
        return Kept(self.nodes[order], self.blend[order], self.room[order], self.heights[order])

    @property
    def noisy(self) -> bool:
        """Do bands of some cells reach to the mean around?"""
        return bool((self.blend[self.nodes] > 0.0).any())

    @property
    def firm(self) -> Kept:
        """Without the nodes of cells whose areas are nobody's intent."""
        return self._replace(nodes=self.nodes & (self.blend < 1.0))


class Banded(StarSmoother):
    """start: (N, 2) points in memory order, whose areas count. kept: in memory order, too."""

    start: NDArray[np.float64]
    kept: Kept
    at: int
    inverse: float
    converged: bool

    stops_when_idle = False

    def __init__(self, start: NDArray[np.float64], kept: Kept) -> None:
        self.start, self.kept = start, kept
        self.topology: Topology | None = None
        self.bands = bands.bands_for(np.empty(0, dtype=np.int64), 0)
        self.at, self.inverse = -1, 1.0

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        if field.planar is not self.topology:
            self._begin(field.planar, executor)
        self.at += 1
        self.inverse = max(least_shape(field, executor), POOREST)
        tally = np.zeros(3, dtype=np.int64)
        for _ in range(PLAN[self.at].passes):
            tally += super().sweep(field, executor, test)
        self.converged = self.at + 1 == len(PLAN)
        return tally

    def _begin(self, topology: Topology, executor: Executor) -> None:
        self.topology, blocks = topology, topology.stars.blocks
        assert isinstance(blocks, Blocks)
        first, count = places_of(blocks)
        self.bands = bands.bands_for(first, count)
        log_mean, (nodes, blend, room, firm) = np.empty(len(self.start)), self.kept
        bands.mean_areas(self.start, topology.near, log_mean)
        executor.exchange(log_mean)
        bands.limit(self.start, nodes, log_mean, blend, room, firm, blocks, self.bands)

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """See StarSmoother."""
        step = PLAN[self.at]
        kernels.sweep(points, blocks, self.bands, self.inverse, step.doublings, step.weight, first, last, guard, tally)


def least_shape(field: Field, executor: Executor) -> float:
    """The minimum 1/q of the cells with a free node."""
    simplices = field.planar.changeable
    shape = np.empty(len(simplices.rows), dtype=np.float32)

    def look(first: int, last: int) -> None:
        ranking.shapes(field.points, simplices, first, last, shape)

    executor.map(look, 0, -(-len(shape) // LANES))
    return executor.minimum(float(shape.min(initial=1.0)))
