"""A file as numbers at addresses, so that a reader is written once for the text and the binary form of its format.

In a text the address of a number is the index of its token, and every number has the size 1; in a binary file it is
the byte that it begins at. Types are NumPy's without a byte order: ``i4``, ``u1``, ``f8``.
"""

from __future__ import annotations

import re
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.splice import BinarySlots, Slots, TextSlots
from gmsnet.io.text import Spans, fail, to_floats, to_ints, token

Addresses = NDArray[np.int64]

_NOT_FINITE = re.compile(rb"(?i)([+-]?)(nan|inf(?:inity)?)(?:\([a-z]*\))?")


class Words(Protocol):
    """The numbers of a file. ``at``: the address that ``take`` goes on from; ``end``: the one behind the last."""

    at: int
    end: int

    def size(self, kind: str) -> int:
        """How far the address behind a number of this type is from its own."""
        ...

    def take(self, count: int, kind: str) -> Addresses:
        """The addresses of the next ``count`` numbers. Raises FormatError where the file ends before."""
        ...

    def values(self, addresses: Addresses, kind: str, finite: bool = True) -> NDArray[Any]:
        """The numbers at addresses (any shape): int64 for the integer types, float64 for the others.

        Raises FormatError naming the place of what is no such number; with ``finite=False`` nan and inf are numbers.
        """
        ...

    def slots(self, addresses: Addresses, kind: str, node: NDArray[np.int64] | None = None) -> Slots:
        """The places (rows × dim) as slots of coordinates; ``node`` as in Slots, by default one row a node."""
        ...

    def fail(self, address: int, message: str) -> NoReturn:
        """Raises FormatError with the place of an address in front."""
        ...


class TextWords:
    """See Words: the tokens of a text."""

    def __init__(self, data: bytes, spans: Spans) -> None:
        self.data, self.spans, self.at, self.end = data, spans, 0, len(spans)

    def size(self, kind: str) -> int:
        """See Words."""
        return 1

    def take(self, count: int, kind: str) -> Addresses:
        """See Words."""
        left = self.end - self.at
        if not 0 <= count <= left:
            self.fail(self.at, f"expected {count} numbers, found {left}")
        self.at += count
        return np.arange(self.at - count, self.at, dtype=np.int64)

    def values(self, addresses: Addresses, kind: str, finite: bool = True) -> NDArray[Any]:
        """See Words."""
        spans = self.spans[addresses]
        if kind[0] != "f":
            return to_ints(self.data, spans)
        if not finite:
            return any_floats(self.data, spans)
        numbers = to_floats(self.data, spans)
        if kind == "f4" and (huge := np.flatnonzero(~np.isfinite(typed(numbers, kind)))).size:
            self.fail(int(addresses.ravel()[huge[0]]), "a coordinate is too large for the type float of the file")
        return numbers

    def slots(self, addresses: Addresses, kind: str, node: NDArray[np.int64] | None = None) -> TextSlots:
        """See Words."""
        spans = self.spans[addresses]
        return TextSlots(spans[..., 0], spans[..., 1], np.arange(len(spans)) if node is None else node)

    def fail(self, address: int, message: str) -> NoReturn:
        """See Words."""
        fail(self.data, int(self.spans[address, 0]) if address < self.end else len(self.data), message)


class ByteWords:
    """See Words: binary numbers. order: ``<`` little endian or ``>`` big endian."""

    def __init__(self, data: bytes, order: str, at: int = 0) -> None:
        self.data, self.order, self.at, self.end = data, order, at, len(data)

    def size(self, kind: str) -> int:
        """See Words."""
        return np.dtype(kind).itemsize

    def take(self, count: int, kind: str) -> Addresses:
        """See Words."""
        size, left = self.size(kind), self.end - self.at
        if not 0 <= count * size <= left:
            fail_at(self.at, f"expected {count} numbers of {size} bytes, but only {max(0, left)} bytes follow")
        start, self.at = self.at, self.at + count * size
        return np.arange(start, self.at, size, dtype=np.int64)

    def values(self, addresses: Addresses, kind: str, finite: bool = True) -> NDArray[Any]:
        """See Words."""
        numbers = gather(self.data, addresses, self.order + kind)
        if kind[0] != "f":
            return numbers.astype(np.int64)
        if finite and not np.isfinite(numbers).all():
            bad = int(addresses.ravel()[np.flatnonzero(~np.isfinite(numbers))[0]])
            self.fail(bad, "a coordinate is not a finite number")
        with np.errstate(invalid="ignore"):  # a nan that signals becomes a quiet one
            return numbers.astype(np.float64)

    def slots(self, addresses: Addresses, kind: str, node: NDArray[np.int64] | None = None) -> BinarySlots:
        """See Words."""
        return BinarySlots(addresses, self.order + kind, np.arange(len(addresses)) if node is None else node)

    def fail(self, address: int, message: str) -> NoReturn:
        """See Words."""
        fail_at(address, message)


def fail_at(offset: int, message: str) -> NoReturn:
    """Raises FormatError with a byte of a binary file in front, which has no lines."""
    raise FormatError(f"byte {offset}: {message}")


def gather(data: bytes, addresses: Addresses, dtype: str) -> NDArray[Any]:
    """The binary numbers that begin at any bytes, aligned or not, in the shape of ``addresses``."""
    kind = np.dtype(dtype)
    out = np.empty(addresses.shape, dtype=kind)
    shift = addresses % kind.itemsize
    for first in np.unique(shift).tolist():  # numbers that are a whole number of sizes apart are one strided view
        numbers = np.frombuffer(data, dtype=kind, offset=first, count=(len(data) - first) // kind.itemsize)
        chosen = shift == first
        out[chosen] = numbers[addresses[chosen] // kind.itemsize]
    return out


def typed(values: NDArray[Any], kind: str) -> NDArray[Any]:
    """Numbers in the type that a file declares for them; integers that do not fit stay as they are."""
    with np.errstate(over="ignore", invalid="ignore"):
        exact = values.astype(kind)
    return exact if kind[0] == "f" or np.array_equal(exact, values) else values


def any_floats(data: bytes, spans: Spans) -> NDArray[np.float64]:
    """Like ``to_floats`` for data that are no coordinates: nan and inf are values too."""
    raw, flat = np.frombuffer(data, dtype=np.uint8), spans.reshape(-1, 2)
    if not len(flat):
        return np.empty(spans.shape[:-1])
    first = raw[flat[:, 0]]
    signed = (first == ord("+")) | (first == ord("-"))
    first = np.where(signed & (flat[:, 1] - flat[:, 0] > 1), raw[np.minimum(flat[:, 0] + 1, len(raw) - 1)], first)
    special = np.isin(first, np.frombuffer(b"nNiI", dtype=np.uint8))
    values = np.empty(len(flat))
    values[~special] = to_floats(data, flat[~special])
    for k in np.flatnonzero(special).tolist():
        match = _NOT_FINITE.fullmatch(token(data, flat[k]))
        if match is None:
            to_floats(data, flat[k : k + 1])  # which tells what was expected
        else:
            values[k] = float(match[1] + match[2])
    return values.reshape(spans.shape[:-1])


def ranges(first: NDArray[np.int64], count: NDArray[np.int64], step: int = 1) -> NDArray[np.int64]:
    """One after another the ranges first[k], first[k] + step, … of count[k] numbers each."""
    ends = np.cumsum(count)
    rank = np.arange(int(ends[-1]) if len(ends) else 0) - np.repeat(ends - count, count)
    return np.repeat(first, count) + step * rank
