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
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.dihedral import ratios_of, renew
from gmsnet.methods.base import Field, Smoother, Tally, over_stars
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]

# The share of all cells, k of p = 3·2^k, and how many sweeps. Of small meshes MORE times as many, up to FEWEST.
CYCLES = ((0.004, 2, 4), (0.002, 4, 8), (0.001, 5, 12))
MORE, FEWEST, LEAST = 2.0, 225_000.0, 12  # FEWEST: times the share


class WorstInSpace(Smoother):
    """One sweep is all CYCLES, of so many ``times`` as many cells.

    least: the minimum η after the last one; gained: what it has brought.
    """

    gained: float
    least: float

    least = gained = -math.inf

    def __init__(self, times: float = 1.0) -> None:
        self.times = times

    def sweep(self, field: Field, executor: Executor, test: object) -> Tally:
        """See Smoother."""
        topology, tally = field.topology, np.zeros(3, dtype=np.int64)
        assert isinstance(topology, Volume)
        guard, cells = field.guard(executor), topology.changeable
        ratios = ratios_of(field.points, cells, executor)
        tangled = _set_aside(ratios, cells, topology.near_free)
        before = after = _most(ratios, executor)
        every = executor.counted(np.ones(len(ratios), dtype=bool))
        for share, number, sweeps in CYCLES:
            nodes = sorted_unique(cells.rows[executor.lowest_rows(-ratios, how_many(self.times * share, every))])
            nodes = nodes[topology.near_free[nodes]]
            stars = topology.stars_of(nodes.astype(np.int64))
            power = Power3.of(number, min(after / K3, 1e30))

            def visit(blocks: SpaceBlocks, first: int, last: int, counts: Tally, power: Power3 = power) -> None:
                sweep3(field.points, blocks, first, last, guard, power, 1.0, counts)

            for _ in range(sweeps):
                tally += over_stars(visit, stars, field.points, executor)
            if tangled:
                ratios = ratios_of(field.points, cells, executor)
                _set_aside(ratios, cells, topology.near_free)
            else:
                renew(ratios, field.points, cells, nodes, executor)
            after = _most(ratios, executor)
        least = (K3 / after) ** (1.0 / 3.0)
        self.least, self.gained = least, least - (K3 / before) ** (1.0 / 3.0)
        field.floor.watch(np.arange(len(ratios), dtype=np.int32), -ratios, executor)
        return tally


def _most(ratios: Floats, executor: Executor) -> float:
    """The largest of all, or of a regular tetrahedron."""
    return -executor.minimum(-float(ratios.max(initial=K3)))


def how_many(share: float, cells: int) -> int:
    """The cells of a cycle."""
    return max(LEAST, math.ceil(share * max(cells, min(MORE * cells, FEWEST))))


def _set_aside(ratios: Floats, cells: Tetrahedra, free: NDArray[np.bool_]) -> bool:
    """Makes those 0, and so the last to be chosen, where no node moves: stars with an inverted cell stay.

    free: (N,) which nodes are. Returns whether there are inverted cells.
    """
    inverted = np.isinf(ratios)
    if not inverted.any():
        return False
    movable = free.copy()
    movable[cells.rows[inverted]] = False
    ratios[~movable[cells.rows].any(axis=1)] = 0.0
    return True
