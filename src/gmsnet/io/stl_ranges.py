"""Binary STL of which a process reads and writes some triangles only: each writes its own three corners."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.ranges import Column, Moves, Plan, Table, put
from gmsnet.io.rows import AT_ONCE, EncodedRows, Ranges

HEAD, RECORD = 84, 50  # bytes in front of the triangles, and of each of them
_BEHIND = 12  # bytes of the normal, in front of the corners
_KIND = "<f4"
_TOGETHER = AT_ONCE // RECORD


@dataclass(frozen=True)
class Corners:
    """The coordinates of all corners, which follow each other but for what is between triangles. See Source and
    Encoded."""

    triangles: int
    dtype: str = _KIND

    def numbers(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """See Source."""
        begin, end = first // 9, -(-last // 9)
        return _in(_records(file, begin, end)).reshape(-1)[first - 9 * begin : last - 9 * begin]

    def where(self, number: int) -> str:
        """See Source."""
        triangle, rest = divmod(number, 9)
        return f"byte {HEAD + RECORD * triangle + _BEHIND + 4 * rest}"

    def contents(self, file: Ranges, moves: Moves, folder: str) -> Iterator[bytes]:
        """See Encoded."""
        yield bytes(file.read(0, HEAD))
        for begin in range(0, self.triangles, _TOGETHER):
            records = _records(file, begin, min(begin + _TOGETHER, self.triangles))
            values = _in(records).reshape(-1, 3)
            put(values, moves, 3 * begin, 0)
            _in(records)[...] = values.reshape(-1, 9)
            yield bytes(records)


def _records(file: Ranges, begin: int, end: int) -> bytearray:
    return file.read(HEAD + RECORD * begin, RECORD * (end - begin))


def _in(records: bytearray) -> NDArray[np.float32]:
    """(n, 9) the coordinates in the bytes of n triangles, in their memory."""
    return np.ndarray((len(records) // RECORD, 9), _KIND, records, _BEHIND, (RECORD, 4))


@dataclass(frozen=True)
class Own:
    """The corners of triangles by number: three each, one after another."""

    rows: int
    width: int = 3
    dtype: str = "<i8"

    def of(self, file: Ranges, first: int, last: int) -> NDArray[Any]:
        """See AnyRows: no file lists them."""
        return np.arange(self.width * first, self.width * last).reshape(-1, self.width)

    def where(self, row: int) -> str:
        """Of a triangle, for messages."""
        return f"byte {HEAD + RECORD * row}"


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a binary file lie; None of another. Corners at one place are one node, as of zones."""
    head = bytes(file.read(0, min(file.size, HEAD)))
    count = int.from_bytes(head[80:HEAD], "little")
    if not count or file.size != HEAD + RECORD * count:
        return None
    corners = Corners(count)
    column = Column(EncodedRows(corners, 0, 3 * count, 3, 3))
    return Plan([column], [[Table("triangle", Own(count), 0)]], True, encoded=corners, zones=range(3 * count + 1))
