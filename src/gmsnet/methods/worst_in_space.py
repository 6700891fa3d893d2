"""The worst cells of a volume first: sweeps of Newton's method on high powers of q over the stars of their nodes alone.

A cycle ranks the candidates, which are the worst of all when the list begins, takes a share of all cells, and makes
blocks of the stars of their free nodes. The sweeps over these are those of the barrier (kernels/methods/barrier3.py),
with q relative to the worst of all.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.methods.barrier3 import K3, Power3, sweep3
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.simplex.tetra_measures import cubed_ratios
from gmsnet.kernels.star.space import SpaceBlocks
from gmsnet.methods.base import Field, Smoother, Tally, by_colour
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume

# The share of all cells, k of p = 3·2^k, and how many sweeps.
CYCLES = ((0.004, 2, 4), (0.002, 4, 8), (0.001, 5, 12))
CANDIDATES, FEWEST_CANDIDATES, FEWEST = 0.02, 100, 12


class WorstInSpace(Smoother):
    """One sweep is all CYCLES. least: the minimum η after the last one; gained: what it has brought."""

    least = gained = -math.inf

    def sweep(self, field: Field, executor: Executor, test: object) -> Tally:
        """See Smoother."""
        topology, tally = field.topology, np.zeros(3, dtype=np.int64)
        assert isinstance(topology, Volume)
        guard, every = field.guard(executor), topology.changeable
        ratios = _ratios(field.points, every)
        wanted = min(max(FEWEST_CANDIDATES, math.ceil(CANDIDATES * len(ratios))), len(ratios))
        chosen = np.argpartition(ratios, len(ratios) - wanted)[len(ratios) - wanted :].astype(np.int32)
        candidates, before = every.take(np.sort(chosen)), float(ratios.max(initial=1.0))
        for share, number, sweeps in CYCLES:
            ratios = _ratios(field.points, candidates)
            count = min(max(FEWEST, math.ceil(share * len(every.rows))), wanted)
            worst = np.argpartition(ratios, wanted - count)[wanted - count :]
            nodes = np.unique(candidates.rows[worst])
            stars = topology.stars_of(nodes[topology.near_free[nodes]].astype(np.int64))
            power = Power3.of(number, min(float(ratios.max(initial=1.0)) / K3, 1e30))

            def visit(first: int, last: int, blocks=stars.blocks, power=power) -> Tally:  # type: ignore[no-untyped-def]
                counts = np.zeros(3, dtype=np.int64)
                assert isinstance(blocks, SpaceBlocks)
                sweep3(field.points, blocks, first, last, guard, power, 1.0, counts)
                return counts

            for _ in range(sweeps):
                tally += by_colour(executor, visit, stars, field.points)
        after = float(_ratios(field.points, candidates).max(initial=1.0))
        least = (K3 / after) ** (1.0 / 3.0)
        self.least, self.gained = least, least - (K3 / before) ** (1.0 / 3.0)
        field.floor.forget()
        return tally


def _ratios(points: NDArray[np.float64], cells: Tetrahedra) -> NDArray[np.float64]:
    """S³/D² of each; infinite where D is not positive."""
    out = np.empty(len(cells.rows))
    cubed_ratios(points, cells.rows, cells.orientation, out)
    return out
