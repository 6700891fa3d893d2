"""The sections of a Fluent file: lists in brackets that begin with a number, which says what they hold."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.fluent_binary import MIXED, POLYGONS, Binary, binary, is_binary
from gmsnet.io.places import ranges
from gmsnet.io.text import fail

Ints = NDArray[np.int64]

NODES, CELLS, FACES, NAMES = (10,), (12,), (13,), (39, 45)
MACHINE, LITTLE = 4, b"60"  # the section of the machine that wrote, and its first number for bytes of that order
MOST_DEEP, MOST_SECTIONS = 50, 100_000

OPEN = re.compile(rb"\s*\(\s*(\d{1,5})(?=[\s()\"])")
_NEXT = re.compile(rb"[()\"]")
_COUNT = re.compile(rb"\d{1,15}")
_HEX = re.compile(rb"[0-9A-Fa-f]{1,15}")


class Section(NamedTuple):
    """head: the numbers of its first list (of zone, first and last member, …); body: the bytes of its second.

    start: its first byte. title: the name of a zone. dtype: of the numbers of a binary body, "" for text.
    """

    key: int
    start: int
    head: tuple[int, ...]
    body: tuple[int, int] | None
    title: str
    dtype: str = ""

    @property
    def zone(self) -> int:
        """The number of the zone."""
        return self.head[0] if self.head else 0

    @property
    def first(self) -> int:
        """The number of its first member; 0 where the head does not say."""
        return self.head[1] if len(self.head) > 2 else 0

    @property
    def members(self) -> int:
        """How many members there are by the head."""
        return max(0, self.head[2] - self.head[1] + 1) if len(self.head) > 2 else 0


def sections(data: Data) -> Iterator[Section]:
    """All sections in the order of the file. Raises FormatError where brackets do not match."""
    at, dimension, order = 0, 3, "<"
    for _ in range(MOST_SECTIONS):
        found = OPEN.match(data, at)
        if found is None:
            if re.compile(rb"\s*\Z").match(data, at) is None:
                fail(data, at, "a section was expected, as in (10 (1 1 4 1)( … )): is the file damaged?")
            return
        key, start = int(found[1]), data.find(b"(", found.start())
        if is_binary(key):
            there = binary(data, key, found.end(), dimension, order)
            at = there.stop
            yield binary_section(key, start, there)
            continue
        lists, at = lists_in(data, found.end())
        section = text_section(data, key, start, found.end(), lists, at)
        if key == 2 and section.head:
            dimension = section.head[0]
        if key == MACHINE and lists:
            order = "<" if bytes(data[slice(*lists[0])]).split()[:1] == [LITTLE] else ">"
        yield section
    fail(data, at, f"there are more than {MOST_SECTIONS} sections")


def lists_in(data: Data, at: int) -> tuple[list[tuple[int, int]], int]:
    """The lists inside a section that is open, and the byte behind its end."""
    depth, lists, first, begin = 1, list[tuple[int, int]](), 0, at
    while (found := _NEXT.search(data, at)) is not None:
        at = found.end()
        if found[0] == b'"':
            end = data.find(b'"', at)
            if end < 0:
                fail(data, found.start(), "a text is not closed")
            at = end + 1
        elif found[0] == b"(":
            depth += 1
            first = at if depth == 2 else first
            if depth > MOST_DEEP:
                fail(data, at, "brackets lie too deep inside one another")
        else:
            depth -= 1
            if depth == 1 and len(lists) < 2:
                lists.append((first, found.start()))
            if depth == 0:
                return lists, at
    return fail(data, begin, "the section is not closed: is the file cut off?")


def binary_section(key: int, start: int, there: Binary) -> Section:
    """A binary section under the number that it would have as text, where it holds nodes, cells or faces."""
    key = key % 1000 if there.dtype else key
    declared = not there.head or there.head[0] == 0
    return Section(key, start, there.head, None if declared else there.body, "", there.dtype)


def text_section(data: Data, key: int, start: int, begin: int, lists: list[tuple[int, int]], stop: int) -> Section:
    """A section of text from byte ``start`` to ``stop``, its number before ``begin``. Raises FormatError."""
    if key == 2:
        words = bytes(data[begin : stop - 1]).split()
        return Section(key, start, (int(words[0]),) if words and _COUNT.fullmatch(words[0]) else (), None, "")
    if key not in (*NODES, *CELLS, *FACES, *NAMES) or not lists:
        return Section(key, start, (), None, "")
    words = bytes(data[slice(*lists[0])]).split()
    if key in NAMES:
        zone = int(words[0]) if words and _COUNT.fullmatch(words[0]) else 0
        title = words[2].decode("utf-8", "replace") if len(words) > 2 else ""
        return Section(key, start, (zone,), None, "".join(c for c in title if c.isprintable()) or str(zone))
    if any(not _HEX.fullmatch(word) for word in words) or not words:
        fail(data, lists[0][0], "hexadecimal numbers were expected in the head of a section")
    head = tuple(int(word, 16) for word in words)
    declared = head[0] == 0  # how many there are in all
    return Section(key, start, head, None if declared or len(lists) < 2 else lists[1], "")


def numbers(data: Data, section: Section) -> Ints:
    """The whole numbers of a section, as text hexadecimal."""
    assert section.body is not None
    if section.dtype:
        return np.frombuffer(bytes(data[slice(*section.body)]), section.dtype).astype(np.int64)
    words = bytes(data[slice(*section.body)]).split()
    try:
        return np.array([int(word, 16) for word in words], dtype=np.int64)
    except (ValueError, OverflowError):
        bad = next(word for word in words if not _HEX.fullmatch(word))
        fail(data, section.start, f"a hexadecimal number was expected, found {bad[:24]!r}")


def face_lists(data: Data, section: Section) -> tuple[Ints, Ints, Ints]:
    """Of a section of faces: how many nodes each has, all nodes, and (F, 2) the cells; all counted from 1."""
    if len(section.head) < 5:
        fail(data, section.start, "the head of a section of faces has five numbers")
    return faces_in(data, section, numbers(data, section), section.head[2] - section.head[1] + 1)


def faces_in(data: Data, section: Section, listed: Ints, count: int) -> tuple[Ints, Ints, Ints]:
    """The same of so many faces of a section, from their numbers."""
    kind = section.head[4]
    if kind in (MIXED, POLYGONS):
        sizes, first = _counted(data, section, listed, count)
    elif kind in (2, 3, 4):
        sizes = np.full(min(max(count, 0), len(listed)), kind)
        first = np.arange(len(sizes)) * (kind + 2)
        if len(listed) != count * (kind + 2):
            _misfit(data, section, len(listed), count)
    else:
        fail(data, section.start, f"faces of the type {kind} are not known")
    cells = listed[(first + sizes)[:, None] + np.arange(2)] if len(sizes) else np.empty((0, 2), dtype=np.int64)
    return sizes, listed[ranges(first, sizes)], cells


def _misfit(data: Data, section: Section, found: int, count: int) -> NoReturn:
    fail(data, section.start, f"{found} numbers do not make {count} faces")


def _counted(data: Data, section: Section, listed: Ints, count: int) -> tuple[Ints, Ints]:
    """Of faces that each say how many nodes they have: this, and where their nodes begin."""
    sizes, first, values, at = list[int](), list[int](), listed.tolist(), 0
    while at < len(values):
        if values[at] < 2 or at + values[at] + 3 > len(values):
            raise FormatError(f"face {len(sizes)} (counted from 0) of zone {section.zone} has {values[at]} nodes")
        sizes.append(values[at])
        first.append(at + 1)
        at += values[at] + 3
    if len(sizes) != count:
        _misfit(data, section, len(listed), count)
    return np.array(sizes, dtype=np.int64), np.array(first, dtype=np.int64)
