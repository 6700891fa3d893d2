"""The rows behind the header of a PLY file, in text or binary: where each property of each row stands.

Lists make the rows differ in length, so that each begins where the last one ends. In a text the lines tell where. In
a binary file rows are as long as the first one until one is found that is not, and then they are walked one by one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.ply_header import Element, Header, Property
from gmsnet.io.text import fail, scan_rows
from gmsnet.io.words import Addresses, ByteWords, TextWords, Words, fail_at, ranges


@dataclass(frozen=True)
class Column:
    """A property of all rows. at: (rows,) address of the number, or of the first of the list. sizes: of lists."""

    property: Property
    at: Addresses
    sizes: NDArray[np.int64] | None

    def flat(self, words: Words) -> Addresses:
        """The addresses of all numbers of all lists."""
        assert self.sizes is not None
        return ranges(self.at, self.sizes, words.size(self.property.kind))


Table = dict[str, Column]


def tables(data: bytes, header: Header) -> tuple[Words, dict[str, Table]]:
    """The words of the file, and for each element its columns.

    Raises FormatError where a row is cut off or longer than its properties, and where anything follows the last row.
    """
    return _binary(data, header) if header.order else _text(data, header)


def _text(data: bytes, header: Header) -> tuple[Words, dict[str, Table]]:
    rows = scan_rows(data, header.end)
    words, found, at = TextWords(data, rows.spans), dict[str, Table](), 0
    for element in header.elements:
        if element.count > len(rows) - at:
            message = f"expected {element.count} rows of the element {element.name!r}, found {len(rows) - at}"
            raise FormatError(f"{message}: the file is cut off")
        starts, ends = rows.first[at : at + element.count], rows.first[at + 1 : at + 1 + element.count]
        found[element.name], stops = _columns(words, element, starts, ends)
        if (wrong := np.flatnonzero(stops != ends)).size:
            words.fail(int(starts[wrong[0]]), f"more numbers than the properties of the element {element.name!r}")
        at += element.count
    if at < len(rows):
        fail(data, rows.where(at), "more rows than the header announces")
    return words, found


def _columns(words: Words, element: Element, starts: Addresses, ends: Addresses) -> tuple[Table, Addresses]:
    """The columns of rows between given addresses, and where the rows end according to their lists."""
    table, at = Table(), starts
    for item in element.properties:
        sizes = None
        if item.length is not None:
            _check(words, element, at + words.size(item.length) > ends, starts)
            sizes = words.values(at, item.length)
            at = at + words.size(item.length)
            _check(words, element, (sizes < 0) | (sizes > ends - at), starts)
        table[item.name] = Column(item, at, sizes)
        at = at + words.size(item.kind) * (1 if sizes is None else sizes)
        _check(words, element, at > ends, starts)
    return table, at


def _check(words: Words, element: Element, short: NDArray[np.bool_], starts: Addresses) -> None:
    if short.any():
        words.fail(int(starts[np.argmax(short)]), f"a row of the element {element.name!r} is cut off")


def _binary(data: bytes, header: Header) -> tuple[Words, dict[str, Table]]:
    words, found, at = ByteWords(data, header.order), dict[str, Table](), header.end
    for element in header.elements:
        least = sum(words.size(p.length or p.kind) for p in element.properties)
        if element.count * least > len(data) - at:
            fail_at(
                at, f"the {element.count} rows of the element {element.name!r} do not fit into the rest of the file"
            )
        starts, end = _starts(words, element, at)
        found[element.name], _ = _columns(words, element, starts, np.append(starts[1:], end))
        at = end
    if data[at:].strip():
        fail_at(at, "more bytes than the header announces")
    return words, found


def _starts(words: ByteWords, element: Element, at: int) -> tuple[Addresses, int]:
    """Where each row of a binary element begins, and where the last one ends."""
    if not element.count:
        return np.empty(0, dtype=np.int64), at
    if (stride := _stride(words, element, at)) is not None:
        return at + stride * np.arange(element.count, dtype=np.int64), at + stride * element.count
    data, order = words.data, "little" if words.order == "<" else "big"
    steps = _steps(words, element)
    starts = []
    for _ in range(element.count):
        starts.append(at)
        for before, length, signed, size in steps:
            at += before
            if length:
                count = int.from_bytes(data[at : at + length], order, signed=signed)  # type: ignore[arg-type]
                if count < 0:
                    fail_at(at, f"a list of the element {element.name!r} has a negative length")
                at += length + size * count
        if at > len(data):
            fail_at(starts[-1], f"a row of the element {element.name!r} is cut off")
    return np.array(starts, dtype=np.int64), at


def _steps(words: ByteWords, element: Element) -> list[tuple[int, int, bool, int]]:
    """A row as (bytes before a length, bytes of the length or 0, is it signed, bytes of an item), list by list."""
    steps, before = [], 0
    for item in element.properties:
        if item.length is None:
            before += words.size(item.kind)
        else:
            steps.append((before, words.size(item.length), item.length[0] == "i", words.size(item.kind)))
            before = 0
    return [*steps, (before, 0, False, 0)]


def _stride(words: ByteWords, element: Element, at: int) -> int | None:
    """The bytes of a row if all rows have lists as long as those of the first, else None."""
    lengths, place = [], 0  # (offset in the row, type, value)
    for item in element.properties:
        if item.length is not None:
            where = at + place
            if where + words.size(item.length) > len(words.data):
                fail_at(at, f"a row of the element {element.name!r} is cut off")
            count = int(words.values(np.array([where]), item.length)[0])
            if count < 0:
                fail_at(where, f"a list of the element {element.name!r} has a negative length")
            lengths.append((place, item.length, count))
            place += words.size(item.length) + count * words.size(item.kind)
        else:
            place += words.size(item.kind)
    if at + place * element.count > len(words.data):
        return None
    rows = at + place * np.arange(element.count, dtype=np.int64)
    same = all((words.values(rows + offset, kind) == count).all() for offset, kind, count in lengths)
    return place if same else None
