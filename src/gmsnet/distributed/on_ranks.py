"""What ranks ask one another where layers of volumes are looked for in their parts: see ``gmsnet.preserve.shared``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.by_rank import by_rank
from gmsnet.distributed.library import mpi
from gmsnet.distributed.part import Part
from gmsnet.preserve.shared import Arrays, Figures, Flags, Ids, Values
from gmsnet.topology.volume import Volume

RANK = 32  # a name is the rank that moves the node, shifted by so many bits, and the place that the node has there


class OnRanks:
    """The part of one rank. See Shared."""

    names: Ids
    own_cells: Flags

    def __init__(self, part: Part) -> None:
        assert isinstance(part.topology, Volume)
        self.part, self.topology, self.comm = part, part.topology, part.comm
        self.names = self.spread(np.arange(len(part.moves)) | (part.comm.rank << RANK))
        simplices, rows = part.topology.simplices, part.own_rows
        cell = rows if simplices.cells is None else simplices.cells[rows]
        cells = len(simplices.rows if simplices.solids is None else simplices.solids.nodes)
        self.own_cells = np.bincount(cell, minlength=cells) > 0

    @property
    def own(self) -> Flags:
        """See Shared."""
        return self.part.moves

    @property
    def own_near(self) -> NDArray[np.int32]:
        """See Shared."""
        return self.topology.near[self.part.own_rows]

    def numbers(self, chosen: Flags) -> Ids:
        """See Shared."""
        return self.part.numbered(chosen)

    def spread(self, values: Values) -> Values:
        """See Shared."""
        return cast(Values, self.part.halo.spread(values))

    def least(self, value: float) -> float:
        """See Shared."""
        return float(self.comm.allreduce(value, mpi().MIN))

    def total(self, figures: Figures) -> Figures:
        """See Shared."""
        found: Figures = self.comm.allreduce(figures)
        return found

    def ask(self, names: Ids, given: Arrays, work: Callable[..., Arrays]) -> Arrays:
        """See Shared."""
        lists, places = by_rank(names >> RANK, self.comm.size), names & ((1 << RANK) - 1)
        came = self.comm.alltoall([tuple(each[rows] for each in (places, *given)) for rows in lists])
        said = work(*(np.concatenate(each) for each in zip(*came, strict=True)))
        if not said:
            return ()
        ends = np.cumsum([len(each[0]) for each in came])[:-1]
        back = self.comm.alltoall(list(zip(*(np.split(each, ends) for each in said), strict=True)))
        sequence = np.argsort(np.concatenate(lists))
        return tuple(np.concatenate(each)[sequence] for each in zip(*back, strict=True))

    def at_first(self, work: Callable[..., tuple[NDArray[Any], Any]], rows: Arrays, others: Arrays) -> tuple[Any, Any]:
        """See Shared."""
        came, parcels, found = self.comm.gather((rows, others)), None, None
        if came is not None:
            joined = (np.concatenate(each) for part in zip(*came, strict=True) for each in zip(*part, strict=True))
            values, found = work(*joined)
            parcels = np.split(values, np.cumsum([len(each[0]) for each, _ in came])[:-1])
        return self.comm.scatter(parcels), self.comm.bcast(found)
