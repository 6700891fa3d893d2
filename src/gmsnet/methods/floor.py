"""What a sweep at the level WORST must keep: a bound of the worst cell, without a look at all of them each time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods.barrier3 import K3
from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.block import DROPPED, TRUNCATED
from gmsnet.kernels.star.guard import Precision, ratio_upper_bounds
from gmsnet.kernels.star.guard3 import ratio_upper_bounds3
from gmsnet.kernels.star.shell_simplices import ShellSimplices, ratio_upper_bounds_of_shell
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume


class Floor:
    """The floor of the level WORST. Any cell's D/L is an upper bound of the worst one's, and so a floor that keeps it.

    Which blocks of triangles hold the worst changes slowly. Therefore only those that were the worst, one in SHARE, are
    looked at LOOKS times, and from then on until stars are held back, which a floor that is too high can do. Some
    methods always hold some back: a look at all that finds the worst where it was looked for anyway doubles the number
    of looks before the next one, up to MOST_LOOKS; one that does not brings it back to LOOKS. A method that knows the
    worst cells can name them (``watch``).
    """

    enough: int
    looks: int
    unhindered: int
    first: float | None = None  # what the first look has found

    LOOKS, MOST_LOOKS, SHARE, FEWEST = 3, 12, 16, 64
    WATCHED = 64  # cells

    def __init__(self) -> None:
        self.blocks: NDArray[np.int32] | None = None
        self.enough = self.LOOKS  # with that many looks the blocks may be chosen anew
        self.looks = self.unhindered = 0  # looks, and sweeps in which no star was held back, since these were chosen

    def watch(self, cells: NDArray[np.int32], shape: NDArray[np.floating[Any]], executor: Executor = serial) -> None:
        """From now on looks at the blocks of the worst of these cells (rows of ``Topology.changeable``), by their 1/q.

        The worst of all must be among them.
        """
        few = executor.lowest_rows(shape.astype(np.float64, copy=False), self.WATCHED, cells)
        self.enough = self.LOOKS
        self._watch(executor.blocks_with(cells[few], LANES))

    def forget(self) -> None:
        """All nodes may be elsewhere: which blocks hold the worst is not known."""
        self.blocks = None

    def swept(self, tally: NDArray[np.int64]) -> None:
        """Takes note of what happened to the shifts of a whole sweep."""
        self.unhindered += not (tally[TRUNCATED] or tally[DROPPED])

    def of(
        self, points: NDArray[np.float64], topology: Topology | Volume, precision: Precision, executor: Executor
    ) -> float:
        """An upper bound of the minimum D/L of the cells with a free node as they are now, of tetrahedra D/S^(3/2)."""
        simplices = topology.changeable
        blocks = self.blocks
        if blocks is None or self.unhindered < self.looks >= self.enough:
            watched, blocks = blocks, np.arange(-(-len(simplices.rows) // LANES), dtype=np.int32)
            least = _least(points, simplices, blocks, precision, executor)
            floor = executor.minimum(float(least.min(initial=math.inf)))
            if watched is not None:
                there = executor.minimum(float(least[watched].min(initial=math.inf))) == floor
                self.enough = min(2 * self.enough, self.MOST_LOOKS) if there else self.LOOKS
            self._watch(executor.lowest(least, self.SHARE, self.FEWEST))
        else:
            least = _least(points, simplices, blocks, precision, executor)
            floor = executor.minimum(float(least.min(initial=math.inf)))
        self.looks += 1
        self.first = floor if self.first is None else self.first
        return floor

    def _watch(self, blocks: NDArray[np.int32]) -> None:
        self.blocks, self.looks, self.unhindered = blocks, 0, 0


def _least(
    points: NDArray[np.float64],
    simplices: Simplices | Tetrahedra | ShellSimplices,
    blocks: NDArray[np.int32],
    precision: Precision,
    executor: Executor,
) -> NDArray[np.float64]:
    """An upper bound of the minimum D/L in each of these blocks of simplices."""
    least = np.empty(len(blocks))

    bounds = ratio_upper_bounds3 if isinstance(simplices, Tetrahedra) else ratio_upper_bounds
    bounds = ratio_upper_bounds_of_shell if isinstance(simplices, ShellSimplices) else bounds

    def look(first: int, last: int) -> None:
        bounds(points, simplices, blocks, precision.unit, precision.grain, first, last, least)

    executor.map(look, 0, len(blocks))
    return least


def floor_of(shape: float) -> float:
    """c of D/S^(3/2) for an η."""
    return math.sqrt(shape**3 / K3)
