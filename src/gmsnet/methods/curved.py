"""Any method for the corners of second-order cells: it sees cells with straight edges, and middles are taken along."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.commit import all_allowed, all_valid, follow
from gmsnet.kernels.curved.stars import CurvedMesh, dragged
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star.block import MOVED, Blocks
from gmsnet.kernels.star.guard import Guard
from gmsnet.methods.base import Field, Smoother, Tally
from gmsnet.methods.floor import Floor
from gmsnet.parallel.executor import Executor
from gmsnet.topology.topology import Topology

TOGETHER, VAIN = (1.0, 0.5, 0.25), 5  # of the way; times without success after which that is no longer tried
PASSES = 10  # at most, over the corners that are not yet there: what stops one may be a neighbour that goes later


class Curved(NamedTuple):
    """Second-order cells with the offsets of their middles, by places in memory.

    room: the least certified bound over the straight size that a valid cell may come to (kernels.curved.commit).
    """

    mesh: CurvedMesh
    room: float


class Corners(Smoother):
    """Each sweep of the method is made on straight cells, in a copy. Then corners go where it put theirs.

    They go one after the other, in the order in which a sweep visits them, so that straight cells are on the way what
    they were in the copy. Each takes its middles along, as far as the rule for second-order cells allows. Where one is
    stopped the copy goes on from there. Those that are stopped one by one are tried together in the end, as it takes
    where all cells of a ring are the worst.
    """

    smoother: Smoother
    curved: Curved
    stops_when_idle: bool
    order: NDArray[np.int64]
    converged: bool
    target_reached: bool
    looks: bool
    phase: str

    def __init__(self, smoother: Smoother, curved: Curved) -> None:
        self.smoother, self.curved = smoother, curved
        self.stops_when_idle = smoother.stops_when_idle
        self.straight: Field | None = None
        self.order = np.empty(0, dtype=np.int64)
        self.in_vain = 0  # times that all together were not allowed to go

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        if self.straight is None:
            self.straight, self.order = replace(field, points=field.points.copy()), visited(field.planar)
        places = self.straight.points
        guard = replace(field, floor=Floor()).guard(executor)
        tally = np.zeros(3, dtype=np.int64)

        def go() -> None:
            for _ in range(PASSES):
                moved = int(tally[MOVED])
                left = follow(field.points, self.curved.mesh, self.order, places, guard, self.curved.room, tally)
                if not left or tally[MOVED] == moved:
                    break

        def gone() -> bool:
            go()
            return test()

        made = self.smoother.sweep(self.straight, executor, gone)
        go()
        tally[MOVED] += self._go_together(field.points, places, guard)
        places[:] = field.points
        self.converged, self.target_reached = self.smoother.converged, self.smoother.target_reached
        self.looks, self.phase = self.smoother.looks, self.smoother.phase
        tally[MOVED + 1 :] += made[MOVED + 1 :]
        return tally

    def _go_together(self, points: NDArray[np.float64], places: NDArray[np.float64], guard: Guard) -> int:
        """Moves all corners that are not yet there together, or part of the way; returns how many have moved."""
        mesh, order = self.curved.mesh, self.order
        left = order[(points[order] != places[order]).any(axis=1)]
        if not len(left) or self.in_vain == VAIN:
            return 0
        waits = np.zeros(len(points) + 1, dtype=bool)  # the last one is that of −1
        waits[left] = True
        cells = np.flatnonzero(waits[mesh.cells].any(axis=1))
        if not all_valid(points, mesh, cells, guard):
            self.in_vain += 1
            return 0
        before = points.copy()
        for share in TOGETHER:
            there = places[left] if share == 1.0 else before[left] + share * (places[left] - before[left])
            dragged(points, mesh, left, there, guard.single)
            if all_allowed(points, mesh, cells, guard, self.curved.room):
                return len(left)
        points[:] = before
        self.in_vain += 1
        return 0


def visited(topology: Topology) -> NDArray[np.int64]:
    """The free nodes in the order in which a sweep visits them, by places in memory."""
    blocks = topology.stars.blocks
    assert isinstance(blocks, Blocks)
    real = np.arange(LANES) < blocks.filled[:, None]
    return blocks.centre.reshape(-1, LANES)[real].astype(np.int64)
