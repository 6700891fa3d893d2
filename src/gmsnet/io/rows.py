"""Numbers of a file that is not in memory: its bytes, and rows of numbers that stand in it as they are, or encoded."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from io import FileIO
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError, InputError
from gmsnet.io.atomic import reason
from gmsnet.io.contents import refuse_unless_regular
from gmsnet.io.stamps import Stamp

AT_ONCE = 1 << 22  # bytes that are copied together
HEAD = 1 << 16  # bytes at the beginning that are read together


def share(total: int, rank: int, ranks: int) -> tuple[int, int]:
    """The first of so many things that is the share of one of several processes, and the one behind the last."""
    return total * rank // ranks, total * (rank + 1) // ranks


class Ranges:
    """A file as it is now. It is open only while some of it is read."""

    path: str
    stamp: Stamp
    size: int

    def __init__(self, path: str) -> None:
        refuse_unless_regular(path)
        self.path = path
        with self._opened() as file:
            self.stamp = Stamp.of(os.fstat(file.fileno()))
        self.size = self.stamp.size

    def read(self, begin: int, count: int) -> bytearray:
        """``count`` bytes from ``begin`` on.

        Raises FormatError where the file ends before, and InputError where others have changed it since.
        """
        found, at = bytearray(count), 0
        with self._opened() as file:
            file.seek(begin)
            while at < count and (some := file.readinto(memoryview(found)[at:])):
                at += some
            self._check(file)
        if at < count:
            raise FormatError(f"byte {begin + at}: the file ends, is it cut off?")
        return found

    def copied(self, begin: int, end: int) -> Iterator[bytes]:
        """The bytes from one to another, in parts."""
        for at in range(begin, end, AT_ONCE):
            yield bytes(self.read(at, min(AT_ONCE, end - at)))

    def check(self) -> None:
        """Raises InputError where others have changed the file since."""
        with self._opened() as file:
            self._check(file)

    @contextlib.contextmanager
    def _opened(self) -> Iterator[FileIO]:
        try:
            with open(self.path, "rb", buffering=0) as file:
                yield file
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read: {reason(error)}") from None

    def _check(self, file: FileIO) -> None:
        if Stamp.of(os.fstat(file.fileno())) != self.stamp:
            raise InputError(f"{self.path}: the file changed while it was read: read it again once it is finished")


class Head:
    """The bytes of a file where they are asked for: of its head, and of few numbers behind it. Serves as Data."""

    def __init__(self, file: Ranges) -> None:
        self._file, self._begin = file, bytes(file.read(0, min(file.size, HEAD)))

    def __len__(self) -> int:
        return self._file.size

    def __getitem__(self, place: int | slice) -> Any:
        if isinstance(place, int):
            return self[place : place + 1][0]
        first, last, _ = place.indices(len(self))
        if last <= len(self._begin):
            return self._begin[first:last]
        return bytes(self._file.read(first, max(last - first, 0)))


@dataclass(frozen=True)
class Rows:
    """Rows of binary numbers: row k has ``width`` numbers of the type from the byte start + k · stride on."""

    start: int
    rows: int
    stride: int
    dtype: str
    width: int = 1

    @property
    def size(self) -> int:
        """Bytes of the numbers of a row."""
        return self.width * np.dtype(self.dtype).itemsize

    @property
    def end(self) -> int:
        """The byte behind the last row."""
        return self.start + ((self.rows - 1) * self.stride + self.size if self.rows else 0)

    def of(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """(last − first, width) the numbers of some rows."""
        if last <= first:
            return np.empty((0, self.width), dtype=self.dtype)
        count = last - first
        return self.in_bytes(file.read(self.start + first * self.stride, (count - 1) * self.stride + self.size), count)

    def in_bytes(self, data: bytearray, count: int) -> NDArray[np.generic]:
        """(count, width) the numbers of rows, the first of which begins with ``data``, in its memory."""
        return np.ndarray((count, self.width), self.dtype, data, 0, (self.stride, self.size // self.width))

    def where(self, row: int) -> str:
        """Of a row, for messages."""
        return f"byte {self.start + row * self.stride}"

    def cut(self, first: int, rows: int, stride: int, width: int) -> Rows:
        """Other rows of the same numbers, from number ``first`` on, ``stride`` apart: as if all followed each other."""
        size = np.dtype(self.dtype).itemsize
        return Rows(self.start + first * size, rows, stride * size, self.dtype, width)


class Source(Protocol):
    """Numbers that follow each other, but that do not stand in the file as they are."""

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        ...

    def numbers(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """(last − first,) some of them. Raises FormatError where the file is damaged."""
        ...

    def where(self, number: int) -> str:
        """Of a number, for messages."""
        ...


@dataclass(frozen=True)
class EncodedRows:
    """Rows of numbers of a source: row k has ``width`` numbers from number start + k · stride on."""

    source: Source
    start: int
    rows: int
    stride: int
    width: int = 1

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        return self.source.dtype

    def of(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """(last − first, width) the numbers of some rows."""
        if last <= first:
            return np.empty((0, self.width), dtype=self.dtype)
        begin, count = self.start + first * self.stride, last - first
        found = self.source.numbers(file, begin, begin + (count - 1) * self.stride + self.width)
        return np.lib.stride_tricks.sliding_window_view(found, self.width)[:: self.stride]

    def where(self, row: int) -> str:
        """Of a row, for messages."""
        return self.source.where(self.start + row * self.stride)

    def cut(self, first: int, rows: int, stride: int, width: int) -> EncodedRows:
        """See Rows."""
        return EncodedRows(self.source, self.start + first, rows, stride, width)


Listed = Rows | EncodedRows


class AnyRows(Protocol):
    """Rows of numbers, wherever they stand."""

    @property
    def rows(self) -> int:
        """How many there are."""
        ...

    @property
    def width(self) -> int:
        """Numbers of each."""
        ...

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        ...

    def of(self, file: Ranges, first: int, last: int) -> NDArray[Any]:
        """(last − first, width) the numbers of some rows."""
        ...

    def where(self, row: int) -> str:
        """Of a row, for messages."""
        ...
