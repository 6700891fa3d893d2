"""The worst cells of a volume first: sweeps of Newton's method on high powers of q over the stars of their nodes alone.

A cycle ranks all cells, takes a share of them, and makes blocks of the stars of their free nodes. The sweeps over these
are those of the barrier (kernels/methods/barrier3.py), with q relative to the worst of all.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods.barrier3 import K3, Power3, sweep3
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.space import SpaceBlocks
from gmsnet.measure.dihedral import ratios_of
from gmsnet.methods.base import Field, Smoother, Tally, over_stars
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]

# The share of all cells, k of p = 3·2^k, and how many sweeps.
CYCLES = ((0.004, 2, 4), (0.002, 4, 8), (0.001, 5, 12))
FEWEST, WATCHED = 12, 64  # cells


class WorstInSpace(Smoother):
    """One sweep is all CYCLES. least: the minimum η after the last one; gained: what it has brought."""

    gained: float
    least: float

    least = gained = -math.inf

    def sweep(self, field: Field, executor: Executor, test: object) -> Tally:
        """See Smoother."""
        topology, tally = field.topology, np.zeros(3, dtype=np.int64)
        assert isinstance(topology, Volume)
        guard, cells = field.guard(executor), topology.changeable
        ratios = _ratios(field.points, cells, topology.near_free, executor)
        before = after = float(ratios.max(initial=K3))
        for share, number, sweeps in CYCLES:
            nodes = np.unique(cells.rows[_largest(ratios, max(FEWEST, math.ceil(share * len(ratios))))])
            stars = topology.stars_of(nodes[topology.near_free[nodes]].astype(np.int64))
            power = Power3.of(number, min(after / K3, 1e30))

            def visit(blocks: SpaceBlocks, first: int, last: int, counts: Tally, power: Power3 = power) -> None:
                sweep3(field.points, blocks, first, last, guard, power, 1.0, counts)

            for _ in range(sweeps):
                tally += over_stars(visit, stars, field.points, executor)
            ratios = _ratios(field.points, cells, topology.near_free, executor)
            after = float(ratios.max(initial=K3))
        least = (K3 / after) ** (1.0 / 3.0)
        self.least, self.gained = least, least - (K3 / before) ** (1.0 / 3.0)
        few = _largest(ratios, WATCHED)
        field.floor.watch(few, 1.0 / np.maximum(ratios[few], 1.0))
        return tally


def _largest(values: Floats, count: int) -> NDArray[np.int32]:
    """Where so many of the largest values stand, or all, if they are fewer."""
    rest = max(len(values) - count, 0)
    return np.argpartition(values, rest)[rest:].astype(np.int32)


def _ratios(points: Floats, cells: Tetrahedra, free: NDArray[np.bool_], executor: Executor) -> Floats:
    """S³/D² of each; 0, and so the last to be chosen, where no node moves: stars with an inverted cell stay.

    free: (N,) which nodes are.
    """
    out = ratios_of(points, cells, executor)
    inverted = np.isinf(out)
    if inverted.any():
        movable = free.copy()
        movable[cells.rows[inverted]] = False
        out[~movable[cells.rows].any(axis=1)] = 0.0
    return out
