"""What ranks tell each other of the nodes that they share: lists are made once, and buffers used again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.library import mpi

Floats = NDArray[np.float64]
Places = NDArray[np.integer[Any]]


class Messages:
    """One exchange: values at some places go to each neighbour, and theirs come to others.

    give, take: for each neighbour in turn, the places whose values it gets, and those whose values come from it. The
    request is set up once (MPI 4); where the library is older, each exchange names its buffers anew.
    """

    graph: Any
    columns: int
    out: Places
    into: Places
    sent: Floats
    got: Floats
    messages: int
    bytes: int
    buffers: tuple[list[Any], list[Any]]

    def __init__(self, graph: Any, give: Sequence[Places], take: Sequence[Places], columns: int) -> None:
        self.graph, self.columns = graph, columns
        self.out, self.into = (np.concatenate([*each, np.empty(0, dtype=np.int64)]) for each in (give, take))
        self.sent, self.got = (np.empty((len(each), columns)) for each in (self.out, self.into))
        give_counts, take_counts = ([columns * len(places) for places in each] for each in (give, take))
        buffers = [self.sent, give_counts], [self.got, take_counts]
        self.messages, self.bytes = sum(count > 0 for count in give_counts), self.sent.nbytes
        persistent = mpi().VERSION >= 4 and len(give)
        self.request = graph.Neighbor_alltoallv_init(*buffers) if persistent else None
        self.buffers = buffers

    def exchange(self, values: Floats) -> None:
        """values: (n, ``columns`` or more); of more, the first are exchanged."""
        np.take(values[:, : self.columns], self.out, axis=0, out=self.sent)
        self.go()
        values[self.into, : self.columns] = self.got

    def go(self) -> None:
        """Sends what stands in ``sent``; what comes stands in ``got``."""
        if self.request is None:
            self.graph.Neighbor_alltoallv(*self.buffers)
        else:
            self.request.Start()
            self.request.Wait()

    def free(self) -> None:
        """Gives the request back."""
        if self.request is not None:
            self.request.Free()
            self.request = None


class Halo:
    """The nodes that this rank shares with each of its neighbours.

    own: neighbour → the places of the nodes that this rank moves and the neighbour has, too; others: neighbour → the
    places of the nodes that the neighbour moves and this rank has. Both in the order of the global ids.
    messages, bytes: sent so far, of the exchanges after colours.
    """

    neighbours: list[int]
    give: list[Places]
    take: list[Places]
    graph: Any
    whole: Messages
    messages: int
    bytes: int

    def __init__(self, comm: Any, own: dict[int, Places], others: dict[int, Places]) -> None:
        self.neighbours = sorted({*own, *others})
        nothing = np.empty(0, dtype=np.int64)
        self.give = [own.get(rank, nothing) for rank in self.neighbours]
        self.take = [others.get(rank, nothing) for rank in self.neighbours]
        self.graph = comm.Create_dist_graph_adjacent(self.neighbours, self.neighbours)
        self.whole = Messages(self.graph, self.give, self.take, 1)
        self.by_colour: list[Messages] = []
        self.rows_by_colour: list[Messages] = []
        self.messages = self.bytes = 0

    def coloured(self, colours: NDArray[np.int32], count: int, columns: int) -> None:
        """Sets up the exchanges after each of so many colours. colours: (n,) of the nodes, −1 of those held."""
        for colour in range(count):
            give, take = (
                [places[colours[places] == colour] for places in each] for each in (self.give, self.take)
            )  # fmt: skip
            self.by_colour.append(Messages(self.graph, give, take, columns))

    def sliding(self, colours: NDArray[np.int32], count: int, row: NDArray[np.int32]) -> None:
        """Likewise for a number of each node that has a row (n,), where −1 is none."""
        for colour in range(count):
            give, take = (
                [row[places[(colours[places] == colour) & (row[places] >= 0)]] for places in each]
                for each in (self.give, self.take)
            )
            self.rows_by_colour.append(Messages(self.graph, give, take, 1))

    def of_others(self, colour: int) -> Places:
        """The places of the nodes that come after a colour."""
        return self.by_colour[colour].into

    def after(self, colour: int, points: Floats, along: Floats | None = None) -> None:
        """The nodes of a colour are where they will be. along: (R,) the numbers of those that slide."""
        self._send(self.by_colour[colour], points)
        if along is not None:
            self._send(self.rows_by_colour[colour], along.reshape(-1, 1))

    def _send(self, messages: Messages, values: Floats) -> None:
        messages.exchange(values)
        self.messages += messages.messages
        self.bytes += messages.bytes

    def spread(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values (n,) at nodes with those of their owners; of numbers that a float64 can hold."""
        found = values.copy()
        self.renew(found)
        return found

    def renew(self, values: NDArray[Any]) -> None:
        """The same in place."""
        whole = self.whole
        whole.sent[:, 0] = values[whole.out]
        whole.go()
        values[whole.into] = whole.got[:, 0].astype(values.dtype)

    def free(self) -> None:
        """Gives back what MPI keeps."""
        for messages in (self.whole, *self.by_colour, *self.rows_by_colour):
            messages.free()
        self.graph.Free()
