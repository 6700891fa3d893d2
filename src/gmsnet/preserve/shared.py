"""What is asked of all processes that have the parts of one mesh, where its layers are looked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Flags = NDArray[np.bool_]
Ids = NDArray[np.int64]
Arrays = tuple[NDArray[Any], ...]
Values = TypeVar("Values", bound=NDArray[Any])
Figures = TypeVar("Figures", int, NDArray[np.int64])


class Shared(Protocol):
    """A mesh, or the part of it that one process has: the cells at the nodes that it answers for.

    All processes call each of these alike. Nodes have names that are the same for all; a process knows its own nodes
    by their places in memory.
    """

    @property
    def own(self) -> Flags:
        """(N,) by places, the nodes that this process answers for."""
        ...

    @property
    def own_near(self) -> NDArray[np.int32]:
        """The rows of ``Volume.near`` of the cells that it answers for."""
        ...

    @property
    def own_cells(self) -> Flags:
        """Which cells of volumes it answers for."""
        ...

    @property
    def names(self) -> Ids:
        """(N,) by places, the name of each node."""
        ...

    def numbers(self, chosen: Flags) -> Ids:
        """Of its own nodes that are chosen (N,), the places among those of all processes, in memory order."""
        ...

    def spread(self, values: Values) -> Values:
        """Values (N,) at nodes with those of the processes that answer for them."""
        ...

    def least(self, value: float) -> float:
        """The least of all processes."""
        ...

    def total(self, figures: Figures) -> Figures:
        """The sum over all processes."""
        ...

    def ask(self, names: Ids, given: Arrays, work: Callable[..., Arrays]) -> Arrays:
        """What the processes say that answer for some nodes (k,). given: arrays of k rows that go with them.

        work(places, *given): called once by each process, with what all ask of it; returns arrays of as many rows.
        """
        ...

    def at_first(self, work: Callable[..., tuple[NDArray[Any], Any]], rows: Arrays, others: Arrays) -> tuple[Any, Any]:
        """What the first process makes of the rows and the other arrays of all: for each row a value, and one for all.

        Of the first ones each process gets its own back.
        """
        ...


class Alone:
    """The whole mesh in one process."""

    def __init__(self, topology: Topology | Volume) -> None:
        self.topology = topology

    @property
    def own(self) -> Flags:
        """See Shared."""
        return np.ones(len(self.topology.memory), dtype=bool)

    @property
    def own_near(self) -> NDArray[np.int32]:
        """See Shared."""
        return self.topology.near

    @property
    def own_cells(self) -> Flags:
        """See Shared."""
        solids = self.topology.simplices.solids if isinstance(self.topology, Volume) else None
        return np.ones(len(self.topology.near if solids is None else solids.nodes), dtype=bool)

    @property
    def names(self) -> Ids:
        """See Shared."""
        return np.arange(len(self.topology.memory))

    def numbers(self, chosen: Flags) -> Ids:
        """See Shared."""
        return np.arange(np.count_nonzero(chosen))

    def spread(self, values: Values) -> Values:
        """See Shared."""
        return values

    def least(self, value: float) -> float:
        """See Shared."""
        return value

    def total(self, figures: Figures) -> Figures:
        """See Shared."""
        return figures

    def ask(self, names: Ids, given: Arrays, work: Callable[..., Arrays]) -> Arrays:
        """See Shared."""
        return work(names, *given)

    def at_first(self, work: Callable[..., tuple[NDArray[Any], Any]], rows: Arrays, others: Arrays) -> tuple[Any, Any]:
        """See Shared."""
        return work(*rows, *others)
