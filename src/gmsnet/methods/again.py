"""Sweeps over the stars of some tetrahedra, without those in which nothing has changed since the last visit.

A visit depends on the coordinates of its star alone, and a node that stays is where it was: the next visit would end
the same. So the coordinates at the end have the bits of sweeps over all of these stars.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.methods.base import Field, Tally, over_stars
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume

FEW = 0.7  # of the stars: with more to be visited again, leaving the others out does not pay for new blocks


def over_changing(
    visit: Callable[[SpaceBlocks, int, int, Tally], None], nodes: NDArray[np.int32], sweeps: int, field: Field,
    executor: Executor,
) -> Tally:  # fmt: skip
    """So many sweeps, fewer where no node moves any more. nodes: free ones, by places in memory, each once."""
    topology, points, tally = field.topology, field.points, np.zeros(3, dtype=np.int64)
    assert isinstance(topology, Volume)
    all_of_them = nodes.astype(np.int64)
    active, stars = all_of_them, topology.stars_of(all_of_them)
    for sweep in range(sweeps):
        before = points[active]
        found = over_stars(visit, stars, points, executor)
        tally += found
        if sweep + 1 == sweeps or not found.any():
            break
        moved = np.zeros(len(points))
        moved[active[(points[active] != before).any(axis=1)]] = 1.0
        executor.exchange(moved)
        changed = _at_or_beside(all_of_them, moved > 0.0, topology)
        again = all_of_them[changed[all_of_them]]
        counts = np.array([len(again), len(active), np.count_nonzero(changed[active])])
        many, now, still = executor.total(counts).tolist()
        if many < FEW * now or still < many:
            active, stars = again, topology.stars_of(again)
    return tally


def _at_or_beside(nodes: NDArray[np.int64], moved: NDArray[np.bool_], topology: Volume) -> NDArray[np.bool_]:
    """(N,) which of some nodes have moved, or share a cell with one that has. moved: (N,)."""
    start, chosen = topology.near_start, moved.copy()
    count = np.diff(start)[nodes]
    places = np.repeat(start[nodes] - (np.cumsum(count) - count), count) + np.arange(count.sum())
    chosen[np.repeat(nodes, count)[moved[topology.near_ring[places]]]] = True
    return chosen
