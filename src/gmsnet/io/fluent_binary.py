"""Binary sections of a Fluent file: where their numbers stand.

A section (2010 …) or (3010 …) is (10 …) with numbers of four or eight bytes, and ends with the words "End of Binary
Section". Whole numbers have four bytes in both. Source: the manual of ANSYS Fluent, appendix on the format of files.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.text import fail

MIXED, POLYGONS = 0, 5  # kinds of faces that say how many nodes each has
NODES, CELLS, FACES = 10, 12, 13

HEAD = re.compile(rb"\s*\(\s*([0-9A-Fa-f]{1,15}(?:\s+[0-9A-Fa-f]{1,15}){0,8})\s*\)\s*\(")
END = rb"End of Binary Section\s+%d\s*\)"


class Binary(NamedTuple):
    """head: the numbers of its first list. body: the bytes of its numbers, of the type dtype ("" where they are not
    read). stop: the byte behind the section."""

    head: tuple[int, ...]
    body: tuple[int, int]
    dtype: str
    stop: int


def is_binary(key: int) -> bool:
    """Whether a section of this number holds binary numbers."""
    return key // 1000 in (2, 3)


def binary(data: Data, key: int, at: int, dimension: int, order: str) -> Binary:
    """The section whose number ends at byte ``at``.

    dimension: of the mesh. order: of bytes, "<" or ">". Raises FormatError where the numbers do not fit the head.
    """
    head = HEAD.match(data, at)
    mark = re.compile(END % key).search(data, head.end() if head else at)
    if mark is None:
        fail(data, at, f"the binary section {key} is not closed: is the file cut off?")
    if head is None or key % 1000 not in (NODES, CELLS, FACES):
        return Binary((), (at, at), "", mark.end())
    numbers, begin = tuple(int(word, 16) for word in head[1].split()), head.end()
    dtype, count = _layout(data, key, numbers, begin, mark.start(), dimension, order)
    stop = begin + count * np.dtype(dtype).itemsize
    closed = re.compile(rb"\s*\)\s*" + END % key).match(data, stop) if stop <= len(data) else None
    if closed is None:
        fail(data, at, f"{count} numbers do not fill the binary section {key}: is the file damaged?")
    return Binary(numbers, (begin, stop), dtype, closed.end())


def _layout(
    data: Data, key: int, head: tuple[int, ...], begin: int, end: int, dimension: int, order: str
) -> tuple[str, int]:
    """The type of the numbers of a section, and how many there are. end: a byte behind them all."""
    dtype, count = layout(key, head, dimension, order)
    return dtype, _listed(data, begin, end, members_of(head), order) if count is None else count


def members_of(head: tuple[int, ...]) -> int:
    """How many members a section has by its head."""
    return head[2] - head[1] + 1 if len(head) > 2 and 0 < head[1] <= head[2] else 0


def layout(key: int, head: tuple[int, ...], dimension: int, order: str) -> tuple[str, int | None]:
    """The type of the numbers of a section, and how many there are; None where each face tells how many it has."""
    members, kind = members_of(head), head[4] if len(head) > 4 else 0
    if key % 1000 == NODES:
        return f"{order}f{4 if key < 3000 else 8}", members * (kind or dimension)
    if key % 1000 == FACES:
        return f"{order}i4", None if kind in (MIXED, POLYGONS) else members * (kind + 2)
    return f"{order}i4", members


def _listed(data: Data, begin: int, end: int, members: int, order: str) -> int:
    """How many numbers are in a list of faces that each say how many nodes they have."""
    values, at = np.frombuffer(bytes(data[begin : begin + (end - begin) // 4 * 4]), f"{order}i4").tolist(), 0
    for face in range(members):
        if at >= len(values) or not 2 <= values[at] <= len(values) - at - 3:
            raise FormatError(f"face {face} (counted from 0) of a binary section has a wrong number of nodes")
        at += values[at] + 3
    return at
