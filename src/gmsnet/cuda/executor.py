"""Sweeps over stars in a plane and in volumes on a GPU, and all else on threads.

Points go to the GPU before a sweep and come back after it. Stars go once; a thread of the GPU visits one, by the
kernels of the processor compiled anew (kernels.jit.retarget). Stars of one colour share no cell, so that each finds the
places that it finds on the processor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, NamedTuple, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gmsnet.cuda.blocks import singles
from gmsnet.cuda.parts import room_for
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.simplex.summary import Summary
from gmsnet.kernels.star.block import Blocks, Visit
from gmsnet.kernels.star.space import KEPT
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.star.surface import Surface
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import Threads, serial

METHODS = ("auto", "barrier", "laplacian", "gmsnet", "angle", "cvt", "cpt")  # that have such sweeps
LONGEST, LONGEST_IN_SPACE = 256, 1024  # numbers in an array of one star: each thread of the GPU has memory for some
FEWEST = 64  # blocks of LANES stars: of a smaller mesh the processor has done a sweep before the GPU has begun


class Machine(Protocol):
    """What has memory of its own and starts kernels in it. name: what its maker calls it."""

    name: str

    def there(self, values: NDArray[Any]) -> Any:
        """A copy of an array in that memory."""
        ...

    def send(self, values: NDArray[Any], there: Any) -> None:
        """Copies into an array in that memory."""
        ...

    def fetch(self, there: Any, values: NDArray[Any]) -> None:
        """Copies from there when all that was started has ended."""
        ...

    def start(self, kernel: Callable[..., None], room: int, stars: int, arguments: tuple[Any, ...]) -> None:
        """Has a kernel visit all stars, colour after colour, up to so many at a time.

        arguments: points, blocks, first, guard, those of its own, tally, arrays in that memory. first: (C + 1,) where
        the stars of each colour begin. room: the most numbers in an array of one star.
        """
        ...

    def summarise(self, summary: Summary, rows: int, arguments: tuple[Any, ...]) -> NDArray[np.float64]:
        """The figures (P, F) of parts of so many corner simplices. arguments: points, cells, rest."""
        ...

    def close(self) -> None:
        """Lets go of what it holds of the processor's memory."""
        ...


class OnMachine(NamedTuple):
    """Stars in the memory of a machine, as ``singles`` makes them. most: how many of one colour there are at most."""

    blocks: Any
    first: Any
    most: int


class Gpu(Threads):
    """See Executor. sweeps: how many it has done on the machine."""

    machine: Machine
    sweeps: int

    def __init__(self, machine: Machine, threads: int) -> None:
        super().__init__(threads)
        self.machine, self.sweeps = machine, 0
        self._stars: WeakKeyDictionary[Any, OnMachine] = WeakKeyDictionary()
        self._points: dict[int, Any] = {}
        self._cells: dict[int, tuple[Any, Any]] = {}  # by the number of an array of theirs: that array, and the copies

    def swept(self, visit: Visit, stars: Any, points: NDArray[np.float64], guard: Any) -> NDArray[np.int64] | None:
        """See Executor."""
        room = self._room(visit, stars.blocks)
        if not room:
            return None
        machine, on, near = self.machine, self._on_machine(stars), self._sent(points)
        tally, blocks = np.zeros(3, dtype=np.int64), on.blocks
        counts, guarded, own = machine.there(tally), self._copied(guard), self._copied(visit.arguments)
        back = [(near, points), (counts, tally)]
        if (mixture := getattr(stars.blocks, "mixture", None)) is not None:  # what is known of cells changes, too
            slack, gone = machine.there(mixture.slack), machine.there(mixture.gone)
            back += [(slack, mixture.slack), (gone, mixture.gone)]
            blocks = blocks._replace(mixture=blocks.mixture._replace(slack=slack, gone=gone))
        if guard.constraint is not None:  # nodes go on along their curves, or facets
            name = "place" if isinstance(guard.constraint, Surface) else "parameter"
            back.append((getattr(guarded.constraint, name), getattr(guard.constraint, name)))
        machine.start(visit.kernel, room, on.most, (near, blocks, on.first, guarded, own, counts))
        for there, values in back:
            machine.fetch(there, values)
        self.sweeps += 1
        return tally

    def _room(self, visit: Visit, blocks: Blocks | SpaceBlocks) -> int:
        """How long arrays are; 0 where the machine does no such sweep."""
        if visit.room is None:
            return 0
        longest, room = LONGEST_IN_SPACE if isinstance(blocks, SpaceBlocks) else LONGEST, room_for(blocks, visit.room)
        return room if room <= longest else 0

    def figures(
        self, summary: Summary, points: NDArray[np.float64], cells: tuple[Any, ...], rest: tuple[Any, ...]
    ) -> Iterable[NDArray[np.float64]] | None:
        """See Executor."""
        first = cells[0] if isinstance(cells[0], np.ndarray) else cells[0].rows
        if len(first) < FEWEST * LANES:
            return None
        if id(first) not in self._cells:
            self._cells = {id(first): (first, self._copied(cells))}  # while the array is kept, its number is its own
        near, (_, copies) = self._sent(points), self._cells[id(first)]
        return self.machine.summarise(summary, len(first), (near, copies, self._copied(rest)))

    def for_blocks(self, blocks: int) -> Executor:
        """See Executor."""
        return serial if blocks < FEWEST else self

    def remarks(self) -> tuple[str, ...]:
        """See Executor."""
        if self.sweeps:
            return (f"{self.machine.name} did {self.sweeps:,} sweep{'' if self.sweeps == 1 else 's'}",)
        return (
            f"{self.machine.name} did no sweep: it does those of the methods {', '.join(METHODS)} in a plane and in "
            f"volumes, over {FEWEST * LANES:,} free nodes or more with at most 127 neighbours each, in volumes with at "
            f"most {LONGEST_IN_SPACE // KEPT} cell corners",
        )

    def close(self) -> None:
        """See Threads; and what the machine holds."""
        super().close()
        self._stars.clear()
        self._points, self._cells = {}, {}
        self.machine.close()

    def _sent(self, points: NDArray[np.float64]) -> Any:
        """Points as they are now, where all of so many have their place."""
        if len(points) not in self._points:
            self._points = {len(points): self.machine.there(points)}
        near = self._points[len(points)]
        self.machine.send(points, near)
        return near

    def _on_machine(self, stars: Any) -> OnMachine:
        if stars not in self._stars:
            blocks, first = singles(stars.blocks, stars.first)
            if isinstance(blocks, Blocks) and blocks.patterns is not None:  # its tables are read as they lie in memory
                flat: Any = (each.ravel() for each in blocks.patterns)
                blocks = blocks._replace(patterns=type(blocks.patterns)(*flat))
            most = int(np.diff(first).max(initial=0))
            self._stars[stars] = OnMachine(self._copied(blocks), self.machine.there(first), most)
        return self._stars[stars]

    def _copied(self, value: Any) -> Any:
        """The same with the arrays in the memory of the machine."""
        if isinstance(value, np.ndarray):
            return self.machine.there(value)
        if not isinstance(value, tuple):
            return value
        copies = [self._copied(each) for each in value]
        return type(value)(*copies) if hasattr(value, "_fields") else tuple(copies)


@contextmanager
def on(machine: Machine, threads: int) -> Iterator[Gpu]:
    """An executor with a machine and at most so many threads, until the context ends."""
    executor = Gpu(machine, threads)
    try:
        yield executor
    finally:
        executor.close()


def gpu(threads: int) -> AbstractContextManager[Gpu]:
    """The same with the GPU. Raises MissingExtraError, or InputError where there is none."""
    from gmsnet.cuda.machine import Card

    return on(Card(), threads)
