"""The sections of a Gmsh file, in text or binary, read by one logic: arrays of numbers at addresses.

Nodes and elements stand in blocks with a short head each. The heads are read one by one, as each tells where the next
one is; the numbers within the blocks are only addressed, and read all at once at the end.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.cell_table import Kind
from gmsnet.io.text import fail, scan_rows
from gmsnet.io.words import Addresses, ByteWords, TextWords, Words, fail_at, ranges
from gmsnet.mesh import NODES

# Gmsh's types of elements: the name, the number of nodes and, where Gmsh's order differs, the places of Mesh's nodes.
KINDS = {
    1: Kind("line"), 2: Kind("triangle"), 3: Kind("quad"), 4: Kind("tetra"), 5: Kind("hexahedron"), 6: Kind("wedge"),
    7: Kind("pyramid"), 8: Kind("line3"), 9: Kind("triangle6"), 10: Kind("quad9"),
    11: Kind("tetra10", (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)), 15: Kind("vertex"), 16: Kind("quad8"),
    17: Kind("hexahedron20", (*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15)), 21: Kind("triangle10"),
    26: Kind("line4"),
}  # fmt: skip


@dataclass
class Elements:
    """Elements one after another. entity: (n, 2) dimension and tag of the entity of each (of version 4.1).

    physical: (n,) the physical tag of each (of version 2.2). nodes: tags, element k having first[k] to first[k+1] - 1;
    at: the address of each.
    """

    codes: NDArray[np.int64]
    first: NDArray[np.int64]
    nodes: NDArray[np.int64]
    at: Addresses
    words: Words
    entity: NDArray[np.int64] | None = None
    physical: NDArray[np.int64] | None = None


@dataclass
class Nodes:
    """Nodes one after another: their tags, coordinates, and where both stand."""

    tags: NDArray[np.int64]
    points: NDArray[np.float64]
    tags_at: Addresses
    at: Addresses
    words: Words


@dataclass
class Contents:
    """What the sections of a file add up to. physical: (dimension, entity) → its physical tags."""

    names: dict[tuple[int, int], str] = field(default_factory=dict)
    physical: dict[tuple[int, int], tuple[int, ...]] = field(default_factory=dict)
    nodes: Nodes | None = None
    elements: Elements | None = None


class Source:
    """A Gmsh file. at: the byte that reading goes on from; order: of a binary file, empty for a text."""

    def __init__(self, data: bytes, at: int, order: str) -> None:
        self.data, self.at, self.order = data, at, order

    def fail(self, offset: int, message: str) -> NoReturn:
        """Raises FormatError with the line, in a binary file the byte, in front."""
        if self.order:
            fail_at(offset, message)
        fail(self.data, offset, message)

    def word(self) -> bytes:
        """The next word, and behind it the one line end that binary data follow. Nothing: the end of the file."""
        match = re.compile(rb"\s*(\S*)(?:[ \t]*(?:\r\n?|\n))?").match(self.data, self.at)
        assert match is not None  # the pattern fits everywhere
        self.at = match.end()
        return match[1]

    def skip_section(self, title: bytes) -> None:
        """Goes behind the end of a section that is not read."""
        found = self.data.find(b"$End" + title, self.at)
        if found < 0:
            self.fail(self.at, f"$End{show(title)} is missing: the file is cut off")
        self.at = found + len(title) + 4

    def words(self, title: bytes) -> Words:
        """The numbers of the section that begins here."""
        if self.order:
            return ByteWords(self.data, self.order, self.at)
        stop = self.data.find(b"$End" + title, self.at)
        if stop < 0:
            self.fail(len(self.data), f"$End{show(title)} is missing: the file is cut off")
        rows = scan_rows(self.data, self.at, None, stop)
        self.at = stop
        return TextWords(self.data, rows.spans)

    def close(self, title: bytes, words: Words) -> None:
        """The section must end where its counts say."""
        if isinstance(words, ByteWords):
            self.at = words.at
        elif words.at < words.end:
            words.fail(words.at, f"${show(title)} goes on where its counts say that it ends")
        here = self.at
        if self.word() != b"$End" + title:
            self.fail(here, f"${show(title)} does not end where its counts say")


def show(title: bytes) -> str:
    """The name of a section for a message."""
    return title[:24].decode("ascii", "replace")


def ints(words: Words, count: int, kind: str = "i4") -> list[int]:
    """The next integers."""
    return words.values(words.take(count, kind), kind).tolist()  # type: ignore[no-any-return]


def counts(words: Words, count: int, kind: str = "u8") -> list[int]:
    """The next integers, which must not be negative."""
    at = words.at
    found = ints(words, count, kind)
    if min(found, default=0) < 0:
        words.fail(at, f"a count is negative: {min(found)}")
    return found


def skip(words: Words, *numbers: tuple[int, str]) -> int:
    """Goes past numbers, each (how many, type), and returns the address of the first."""
    start = words.at
    end = start + sum(count * words.size(kind) for count, kind in numbers)
    if end > words.end:
        words.fail(words.end, f"expected {sum(count for count, _ in numbers)} more numbers: the file is cut off")
    words.at = end
    return start


def entities(words: Words, partitioned: bool) -> dict[tuple[int, int], tuple[int, ...]]:
    """(dimension, tag) → physical tags of each geometrical entity of version 4.1."""
    found = {}
    if partitioned:
        counts(words, 1)  # partitions
        skip(words, (2 * counts(words, 1)[0], "i4"))  # ghost entities
    for dimension, count in enumerate(counts(words, 4)):
        for _ in range(count):
            (tag,) = ints(words, 1)
            if partitioned:
                skip(words, (2, "i4"))  # the entity that was cut
                skip(words, (counts(words, 1)[0], "i4"))  # the partitions
            skip(words, (6 if dimension else 3, "f8"))
            found[dimension, tag] = tuple(ints(words, counts(words, 1)[0]))
            if dimension:
                skip(words, (counts(words, 1)[0], "i4"))
    return found


def nodes_old(words: Words, count: int) -> Nodes:
    """Nodes of version 2.2: rows of a tag and three coordinates."""
    start, unit = skip(words, (count, "i4"), (3 * count, "f8")), words.size("f8")
    tags_at = start + (words.size("i4") + 3 * unit) * np.arange(count, dtype=np.int64)
    return _nodes(words, tags_at, "i4", tags_at[:, None] + words.size("i4") + unit * np.arange(3))


def nodes_new(words: Words) -> Nodes:
    """Nodes of version 4.1: blocks of tags and then of coordinates, which u, v, w may follow."""
    blocks, total, _, _ = counts(words, 4)
    heads = []
    for _ in range(blocks):
        dimension, _, parametric = ints(words, 3)
        if not 0 <= dimension <= 3 or parametric not in (0, 1):
            words.fail(words.at, f"a block of nodes has the dimension {dimension} and parametric {parametric}")
        (count,) = counts(words, 1)
        width = 3 + dimension * parametric
        heads.append((count, skip(words, (count, "u8")), skip(words, (count * width, "f8")), width))
    number, tags, points, widths = np.array(heads, dtype=np.int64).reshape(-1, 4).T
    if number.sum() != total:
        words.fail(words.at, f"$Nodes announces {total} nodes, but its blocks have {number.sum()}")
    unit = words.size("f8")
    rows = np.repeat(points, number) + _rank(number) * np.repeat(widths, number) * unit
    return _nodes(words, ranges(tags, number, words.size("u8")), "u8", rows[:, None] + unit * np.arange(3))


def _nodes(words: Words, tags_at: Addresses, kind: str, at: Addresses) -> Nodes:
    tags = words.values(tags_at, kind)
    return Nodes(tags, words.values(at, "f8"), tags_at, at, words)


def elements_new(words: Words) -> Elements:
    """Elements of version 4.1: blocks of one entity and type, rows of a tag and the nodes."""
    blocks, total, _, _ = counts(words, 4)
    heads = []
    for _ in range(blocks):
        at = words.at
        dimension, tag, code = ints(words, 3)
        (count,) = counts(words, 1)
        size = node_count(words, at, code)
        heads.append((dimension, tag, code, count, size, skip(words, (count * (1 + size), "u8"))))
    dimensions, entities, codes, number, counted, start = np.array(heads, dtype=np.int64).reshape(-1, 6).T
    if number.sum() != total:
        words.fail(words.at, f"$Elements announces {total} elements, but its blocks have {number.sum()}")
    sizes = np.repeat(counted, number)
    rows = np.repeat(start, number) + words.size("u8") * (1 + _rank(number) * (1 + sizes))
    entity = np.stack([np.repeat(dimensions, number), np.repeat(entities, number)], axis=1)
    return _elements(words, np.repeat(codes, number), sizes, rows, "u8", entity=entity)


def elements_old(words: Words, total: int) -> Elements:
    """Elements of version 2.2: in a text rows of tag, type, number of tags, tags, nodes; in a binary file blocks."""
    heads = _walk_bytes(words, total) if isinstance(words, ByteWords) else _walk_text(words, total)
    codes, tag_counts, starts = heads
    known = np.array([NODES[KINDS[code].name] if code in KINDS else 0 for code in range(max(KINDS) + 1)])
    unit = words.size("i4")
    rows = starts + unit * tag_counts
    physical = np.zeros(len(codes), dtype=np.int64)
    tagged = tag_counts > 0
    physical[tagged] = words.values(starts[tagged], "i4")
    return _elements(words, codes, known[codes], rows, "i4", physical=physical)


def _walk_text(words: Words, total: int) -> tuple[NDArray[np.int64], ...]:
    """(types, numbers of tags, addresses of the first tag) of all elements."""
    start = words.at
    values = words.values(np.arange(start, words.end), "i4").tolist()
    heads, at = [], 0
    for k in range(total):
        if at + 3 > len(values):
            words.fail(words.end, f"$Elements ends after {k} of {total} elements")
        code, tags = values[at + 1], values[at + 2]
        size = node_count(words, start + at, code)
        if tags < 0 or at + 3 + tags + size > len(values):
            words.fail(start + at, f"the element that begins here has {tags} tags and {size} nodes: it is cut off")
        heads.append((code, tags, start + at + 3))
        at += 3 + tags + size
    words.at = start + at
    code, tags, starts = np.array(heads, dtype=np.int64).reshape(-1, 3).T
    return code, tags, starts


def _walk_bytes(words: ByteWords, total: int) -> tuple[NDArray[np.int64], ...]:
    """The same in a binary file, where blocks of elements with one type and number of tags have a head each."""
    head, heads, done = struct.Struct(words.order + "3i"), [], 0
    while done < total:
        at = skip(words, (3, "i4"))
        code, count, tags = head.unpack_from(words.data, at)
        width = 1 + tags + node_count(words, at, code)
        if count <= 0 or tags < 0 or done + count > total:
            words.fail(at, f"a block of {count} elements with {tags} tags each cannot be right")
        heads.append((code, count, tags, skip(words, (count * width, "i4")), width))
        done += count
    codes, number, tag_counts, start, widths = np.array(heads, dtype=np.int64).reshape(-1, 5).T
    starts = np.repeat(start, number) + 4 * (1 + _rank(number) * np.repeat(widths, number))
    return np.repeat(codes, number), np.repeat(tag_counts, number), starts


def _rank(number: NDArray[np.int64]) -> NDArray[np.int64]:
    """0, 1, 2, … within each block of ``number[k]`` rows."""
    return ranges(np.zeros(len(number), dtype=np.int64), number)


def _elements(
    words: Words, codes: NDArray[np.int64], sizes: NDArray[np.int64], rows: Addresses, kind: str, **regions: Any
) -> Elements:
    at = ranges(rows, sizes, words.size(kind))
    first = np.concatenate([[0], np.cumsum(sizes)])
    return Elements(codes, first, words.values(at, kind), at, words, **regions)


def node_count(words: Words, at: int, code: int) -> int:
    """The number of nodes of a type of element. Raises FormatError for one that is not supported."""
    if code not in KINDS:
        words.fail(at, f"elements of Gmsh type {code} are not supported: save the mesh with order 1 or 2")
    return NODES[KINDS[code].name]
