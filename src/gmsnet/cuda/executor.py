"""Sweeps over stars in a plane on a GPU, and all else on threads.

Points go to the GPU before a sweep and come back after it. Stars go once; a thread of the GPU visits one, by the
kernels of the processor compiled anew (kernels.jit.retarget). Stars of one colour share no cell, so that each finds the
places that it finds on the processor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gmsnet.cuda.blocks import singles
from gmsnet.cuda.parts import room_for
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star.block import Blocks, Visit
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import Threads, serial

METHODS = ("auto", "barrier", "laplacian", "gmsnet", "angle", "cvt", "cpt")  # that have such sweeps
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

    def close(self) -> None:
        """Lets go of what it holds of the processor's memory."""
        ...


class OnMachine(NamedTuple):
    """Stars in the memory of a machine, and room for points. most: stars of one colour."""

    blocks: Blocks
    first: Any
    most: int
    points: Any


class Gpu(Threads):
    """See Executor. sweeps: how many it has done on the machine."""

    machine: Machine
    sweeps: int

    def __init__(self, machine: Machine, threads: int) -> None:
        super().__init__(threads)
        self.machine, self.sweeps = machine, 0
        self._stars: WeakKeyDictionary[Any, OnMachine] = WeakKeyDictionary()

    def swept(self, visit: Visit, stars: Any, points: NDArray[np.float64], guard: Any) -> NDArray[np.int64] | None:
        """See Executor."""
        if visit.room is None:
            return None
        machine, on = self.machine, self._on_machine(stars, points)
        machine.send(points, on.points)
        tally = np.zeros(3, dtype=np.int64)
        counts, guarded, own = machine.there(tally), self._copied(guard), self._copied(visit.arguments)
        room = room_for(on.blocks.most, visit.room)
        machine.start(visit.kernel, room, on.most, (on.points, on.blocks, on.first, guarded, own, counts))
        machine.fetch(on.points, points)
        machine.fetch(counts, tally)
        if guard.constraint is not None:  # nodes have gone on along their curves
            machine.fetch(guarded.constraint.parameter, guard.constraint.parameter)
        self.sweeps += 1
        return tally

    def for_blocks(self, blocks: int) -> Executor:
        """See Executor."""
        return serial if blocks < FEWEST else self

    def remarks(self) -> tuple[str, ...]:
        """See Executor."""
        if self.sweeps:
            return (f"{self.machine.name} did {self.sweeps:,} sweep{'' if self.sweeps == 1 else 's'}",)
        return (
            f"{self.machine.name} did no sweep: it does those of the methods {', '.join(METHODS)} in a plane, over "
            f"{FEWEST * LANES:,} free nodes or more",
        )

    def close(self) -> None:
        """See Threads; and what the machine holds."""
        super().close()
        self._stars.clear()
        self.machine.close()

    def _on_machine(self, stars: Any, points: NDArray[np.float64]) -> OnMachine:
        if stars not in self._stars:
            blocks, first = singles(stars.blocks, stars.first)
            if blocks.patterns is not None:  # its tables are read as they lie in memory
                flat: Any = (each.ravel() for each in blocks.patterns)
                blocks = blocks._replace(patterns=type(blocks.patterns)(*flat))
            most = int(np.diff(first).max(initial=0))
            self._stars[stars] = OnMachine(
                self._copied(blocks), self.machine.there(first), most, self.machine.there(points)
            )
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
def gpu(threads: int) -> Iterator[Gpu]:
    """An executor with the GPU and at most so many threads. Raises MissingExtraError and InputError."""
    from gmsnet.cuda.machine import Card

    executor = Gpu(Card(), threads)
    try:
        yield executor
    finally:
        executor.close()
