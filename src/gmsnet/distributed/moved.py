"""The nodes that have moved on all ranks, handed to the first one some at a time, as it writes a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]
WINDOW = 1 << 17  # nodes that the first rank asks for at a time


class Moved:
    """The nodes that have moved, ascending, and where they are: each rank has those of the rows that it keeps."""

    def __init__(self, comm: Any, rows: Ids, ids: Ids, points: Floats) -> None:
        self._comm, self._rows, self._own = comm, rows, (ids, points)
        self._known: tuple[int, int, Ids, Floats] = (0, 0, ids[:0], points[:0])  # nodes from, to, which were asked for

    def between(self, begin: int, end: int) -> Iterator[tuple[Ids, Floats]]:
        """On the first rank, while the others serve: those of a range of nodes, in parts."""
        while begin < end:
            if not self._known[0] <= begin < self._known[1]:
                home = int(np.searchsorted(self._rows, begin, side="right")) - 1
                stop = min(begin + WINDOW, int(self._rows[home + 1]))
                self._known = (begin, stop, *self._of(home, begin, stop))
            _, stop, ids, points = self._known
            first, last = np.searchsorted(ids, [begin, end])
            yield ids[first:last], points[first:last]
            begin = stop

    def _of(self, rank: int, begin: int, end: int) -> tuple[Ids, Floats]:
        if rank == self._comm.rank:
            first, last = np.searchsorted(self._own[0], [begin, end])
            return self._own[0][first:last], self._own[1][first:last]
        self._comm.send((begin, end), rank)
        found: tuple[Ids, Floats] = self._comm.recv(source=rank)
        return found

    def serve(self) -> None:
        """Answers the first rank until it ends."""
        while (asked := self._comm.recv(source=0)) is not None:
            self._comm.send(self._of(self._comm.rank, *asked), 0)

    def end(self) -> None:
        """Lets the other ranks go on."""
        for rank in range(1, self._comm.size):
            self._comm.send(None, rank)
