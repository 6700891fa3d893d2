"""A file as numbers at addresses, so that a reader is written once for the text and the binary form of its format.

In a text the address of a number is the index of its token, and every number has the size 1; in a binary file it is
the byte that it begins at. Types are NumPy's without a byte order: ``i4``, ``u1``, ``f8``.
"""

from __future__ import annotations

from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.places import Addresses, Lattice, Places, pick
from gmsnet.io.splice import BinarySlots, Slots, TextSlots
from gmsnet.io.text import Starts, Text


class Words(Protocol):
    """The numbers of a file. ``at``: the address that ``take`` goes on from; ``end``: the one behind the last."""

    at: int
    end: int

    def size(self, kind: str) -> int:
        """How far the address behind a number of this type is from its own."""
        ...

    def take(self, count: int, kind: str) -> Places:
        """The addresses of the next ``count`` numbers. Raises FormatError where the file ends before."""
        ...

    def values(self, addresses: Addresses, kind: str, finite: bool = True) -> NDArray[Any]:
        """(n,) the numbers at addresses: int64 for the integer types, float64 for the others.

        Raises FormatError naming the place of what is no such number; with ``finite=False`` nan and inf are numbers.
        """
        ...

    def coordinates(self, places: Places, kind: str) -> tuple[NDArray[np.float64], Slots]:
        """The points (n × 3), and where their coordinates stand. Raises the errors of ``values``."""
        ...

    def fail(self, address: int, message: str) -> NoReturn:
        """Raises FormatError with the place of an address in front."""
        ...


class TextWords:
    """See Words: the tokens of a text."""

    text: Text
    starts: Starts
    at: int
    end: int

    def __init__(self, text: Text, starts: Starts) -> None:
        self.text, self.starts, self.at, self.end = text, starts, 0, len(starts)

    def size(self, kind: str) -> int:
        """See Words."""
        return 1

    def take(self, count: int, kind: str) -> Places:
        """See Words."""
        left = self.end - self.at
        if not 0 <= count <= left:
            self.fail(self.at, f"expected {count} numbers, found {left}")
        self.at += count
        return Places(Lattice(self.at - count, count, 1))

    def values(self, addresses: Addresses, kind: str, finite: bool = True) -> NDArray[Any]:
        """See Words."""
        starts = pick(self.starts, addresses)
        if kind[0] != "f":
            return self.text.integers(starts)
        return self.text.floats(starts) if finite else self.text.any_floats(starts)

    def coordinates(self, places: Places, kind: str) -> tuple[NDArray[np.float64], TextSlots]:
        """See Words."""
        starts = pick(self.starts, places).reshape(-1, 3)
        points, ends = self.text.spans(starts)
        with np.errstate(over="ignore"):
            huge = np.flatnonzero(~np.isfinite(points.astype(kind)))
        if huge.size:
            self.fail(places[int(huge[0])], "a coordinate is too large for the type float of the file")
        return points, TextSlots(starts, ends)

    def fail(self, address: int, message: str) -> NoReturn:
        """See Words."""
        self.text.fail(int(self.starts[address]) if address < self.end else len(self.text.data), message)


class ByteWords:
    """See Words: binary numbers. order: ``<`` little endian or ``>`` big endian."""

    data: Data
    order: str
    at: int
    end: int

    def __init__(self, data: Data, order: str, at: int = 0) -> None:
        self.data, self.order, self.at, self.end = data, order, at, len(data)

    def size(self, kind: str) -> int:
        """See Words."""
        return np.dtype(kind).itemsize

    def take(self, count: int, kind: str) -> Places:
        """See Words."""
        size, left = self.size(kind), self.end - self.at
        if not 0 <= count * size <= left:
            self.fail(self.at, f"expected {count} numbers of {size} bytes, but only {max(0, left)} bytes follow")
        start, self.at = self.at, self.at + count * size
        return Places(Lattice(start, count, size))

    def values(self, addresses: Addresses, kind: str, finite: bool = True) -> NDArray[Any]:
        """See Words."""
        if isinstance(addresses, Places):
            numbers = self._at_places(addresses, kind)
        else:
            numbers = gather(self.data, addresses, self.order + kind)
        if kind[0] != "f":
            return numbers.astype(np.int64, copy=False)
        if finite and not np.isfinite(numbers).all():
            self.fail(int(addresses[int(np.argmin(np.isfinite(numbers)))]), "a coordinate is not a finite number")
        with np.errstate(invalid="ignore"):  # a nan that signals becomes a quiet one
            return numbers.astype(np.float64, copy=False)

    def _at_places(self, places: Places, kind: str) -> NDArray[Any]:
        out = np.empty(len(places), dtype=np.int64 if kind[0] != "f" else self.order + kind)
        at = 0
        for lattice in places.lattices:
            rows = out[at : at + len(lattice)].reshape(lattice.rows, len(lattice.columns))
            at += len(lattice)
            if not len(lattice):
                continue
            if (table := lattice.table(self.data, self.order + kind)) is not None:
                rows[:] = table
                continue
            for k, column in enumerate(lattice.columns):
                rows[:, k] = lattice.column(self.data, column, self.order + kind)
        return out

    def coordinates(self, places: Places, kind: str) -> tuple[NDArray[np.float64], BinarySlots]:
        """See Words."""
        return self.values(places, kind).reshape(-1, 3), BinarySlots(places.in_threes(), self.order + kind)

    def fail(self, address: int, message: str) -> NoReturn:
        """See Words."""
        fail_at(address, message)


def fail_at(offset: int, message: str) -> NoReturn:
    """Raises FormatError with a byte of a binary file in front, which has no lines."""
    raise FormatError(f"byte {offset}: {message}")


def gather(data: Data, addresses: NDArray[np.int64], dtype: str) -> NDArray[Any]:
    """The binary numbers that begin at any bytes, aligned or not."""
    kind = np.dtype(dtype)
    out = np.empty(addresses.shape, dtype=kind)
    shift = addresses % kind.itemsize
    for first in range(kind.itemsize):  # numbers that are a whole number of sizes apart are one strided view
        chosen = shift == first
        if chosen.any():
            numbers = np.frombuffer(data, dtype=kind, offset=first, count=(len(data) - first) // kind.itemsize)
            out[chosen] = numbers[addresses[chosen] // kind.itemsize]
    return out


def typed(values: NDArray[Any], kind: str) -> NDArray[Any]:
    """Numbers in the type that a file declares for them; integers that do not fit stay as they are."""
    with np.errstate(over="ignore", invalid="ignore"):
        exact = values.astype(kind)
    return exact if kind[0] == "f" or np.array_equal(exact, values) else values
