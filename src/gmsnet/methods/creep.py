"""Whether nodes creep: neighbours all move one way, sweep after sweep, each by little.

Sweeps over single stars even out what differs from node to node at once. What they leave to later sweeps are long
waves, in which the shifts of neighbours are alike. Of the nodes of a window, neighbours in memory and so in the plane,
the coherence of their shifts is |Σ shift|²/(n Σ |shift|²): 1/n for shifts of their own, 1 for shifts in common. After
five sweeps it is 0.05 to 0.2 on random and jittered meshes, 0.6 to 0.95 on sheared or swirled ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.methods.base import Field
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial

WINDOW, WINDOWS = 64, 64  # nodes; windows at most, evenly taken
FEWEST = 4  # windows: smaller meshes are done by sweeps
COHERENT = 0.35  # over all windows
# Of the whole mesh: a wave as long as the mesh, which moves by so much a sweep, has this share of Σq to lose.
WORTHWHILE = 0.01


class Creep:
    """Some nodes, and where they were before a sweep.

    nodes: (K,) places in memory of those that are here. numbers: (K,) theirs among those that are free. free: how many
    move.
    """

    nodes: NDArray[np.intp]
    numbers: NDArray[np.int64]
    free: int

    def __init__(self, nodes: NDArray[np.intp], numbers: NDArray[np.int64], free: int) -> None:
        self.nodes, self.numbers, self.free = nodes, numbers, free
        self.before: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, field: Field, executor: Executor = serial) -> Creep | None:
        """Of a mesh; None for small ones."""
        free, numbers = np.flatnonzero(field.topology.near_free), executor.free_numbers(field.topology.near_free)
        every = int(executor.total(np.array(len(free))))
        count = every // WINDOW
        if count < FEWEST:
            return None
        windows = np.unique(np.linspace(0, count - 1, min(count, WINDOWS)).astype(int))
        chosen = (WINDOW * windows[:, None] + np.arange(WINDOW)).ravel()
        at = np.searchsorted(numbers, chosen)
        here = at[at < len(numbers)][numbers[at[at < len(numbers)]] == chosen[at < len(numbers)]]
        return cls(free[here], numbers[here], every)

    def start(self, points: NDArray[np.float64]) -> None:
        """A sweep begins."""
        self.before = points.take(self.nodes, axis=0)

    def is_one(self, points: NDArray[np.float64], executor: Executor = serial) -> bool:
        """Did the nodes creep in the sweep that began last? No, if none has begun since this was asked."""
        if self.before is None:
            return False
        now, before = (
            executor.in_order(self.numbers, each).reshape(-1, WINDOW, points.shape[1])
            for each in (points.take(self.nodes, axis=0), self.before)
        )
        shifts = now - before
        self.before = None
        square = float((shifts * shifts).sum())
        if not square > 0.0:
            return False
        together = shifts.sum(axis=1)
        if not float((together * together).sum()) / (WINDOW * square) >= COHERENT:  # so it is on most meshes
            return False
        edges = np.diff(now, axis=1)
        edge = float((edges * edges).sum()) / edges[..., 0].size
        rows = math.sqrt(self.free) / math.pi
        return square / shifts[..., 0].size * rows * rows >= WORTHWHILE * edge
