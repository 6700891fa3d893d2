"""The rows behind the header of a PLY file, in text or binary: where each property of each row stands.

Lists make the rows differ in length, so that each begins where the last one ends. Rows are as long as the first one
until one is found that is not; then the lines tell where they begin, and in a binary file they are walked one by one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.places import Addresses, Lattice, Places, ranges
from gmsnet.io.ply_header import Element, Header, Property
from gmsnet.io.text import Text
from gmsnet.io.words import ByteWords, TextWords, Words, fail_at


@dataclass(frozen=True)
class Column:
    """A property of all rows. heads: (rows,) addresses of the number, or of the length of the list; at: of the numbers
    of all rows; sizes: of lists.
    """

    property: Property
    heads: Addresses
    at: Addresses
    sizes: NDArray[np.int64] | None


Table = dict[str, Column]


def tables(data: Data, header: Header) -> tuple[Words, dict[str, Table]]:
    """The words of the file, and for each element its columns.

    Raises FormatError where a row is cut off or longer than its properties, and where anything follows the last row.
    """
    return _binary(data, header) if header.order else _text(data, header)


def _text(data: Data, header: Header) -> tuple[Words, dict[str, Table]]:
    text = Text(data)
    rows = text.rows(header.end)
    words, found, at = TextWords(text, rows.starts), dict[str, Table](), 0
    for element in header.elements:
        if element.count > len(rows) - at:
            message = f"expected {element.count} rows of the element {element.called}, found {len(rows) - at}"
            raise FormatError(f"{message}: the file is cut off")
        first = rows.first[at : at + element.count + 1].astype(np.int64)
        lengths = np.diff(first)
        lattice = _lattice(words, element, int(first[0]), lengths) if (lengths == lengths[:1]).all() else None
        if lattice is not None:
            found[element.name] = _regular(words, element, lattice)
        else:
            found[element.name], stops = _columns(words, element, first[:-1], first[1:])
            if (wrong := np.flatnonzero(stops != first[1:])).size:
                where = int(first[wrong[0]])
                words.fail(where, f"more numbers than the properties of the element {element.called}")
        at += element.count
    if at < len(rows):
        text.fail(rows.where(at), "more rows than the header announces")
    return words, found


def _regular(words: Words, element: Element, rows: Lattice) -> Table:
    """The columns of rows that are as long as one another."""
    table, place = Table(), rows.start
    for item in element.properties:
        heads, sizes, count = Places(Lattice(place, rows.rows, rows.stride)), None, 1
        if item.length is not None:
            count = int(words.values(Places(Lattice(place, min(1, rows.rows), 1)), item.length).sum())
            sizes = np.broadcast_to(np.int64(count), rows.rows)
            place += words.size(item.length)
        columns = range(0, words.size(item.kind) * count, words.size(item.kind))
        at = Places(Lattice(place, rows.rows, rows.stride, columns)) if count else Places()
        table[item.name] = Column(item, heads, at, sizes)
        place += words.size(item.kind) * count
    return table


def _columns(
    words: Words, element: Element, starts: NDArray[np.int64], ends: NDArray[np.int64]
) -> tuple[Table, NDArray[np.int64]]:
    """The columns of rows between given addresses, and where the rows end according to their lists."""
    table, at = Table(), starts
    for item in element.properties:
        heads, sizes, addresses = at, None, at
        if item.length is not None:
            _check(words, element, at + words.size(item.length) > ends, starts)
            sizes = words.values(at, item.length)
            at = at + words.size(item.length)
            _check(words, element, (sizes < 0) | (sizes > ends - at), starts)
        behind = at + words.size(item.kind) * (1 if sizes is None else sizes)
        _check(words, element, behind > ends, starts)
        if sizes is not None:
            addresses = ranges(at, sizes, words.size(item.kind))
        table[item.name] = Column(item, heads, addresses, sizes)
        at = behind
    return table, at


def _check(words: Words, element: Element, short: NDArray[np.bool_], starts: NDArray[np.int64]) -> None:
    if short.any():
        words.fail(int(starts[np.argmax(short)]), f"a row of the element {element.called} is cut off")


def _binary(data: Data, header: Header) -> tuple[Words, dict[str, Table]]:
    words, found, at = ByteWords(data, header.order), dict[str, Table](), header.end
    for element in header.elements:
        least = sum(words.size(p.length or p.kind) for p in element.properties)
        if element.count * least > len(data) - at:
            fail_at(
                at, f"the {element.count} rows of the element {element.called} do not fit into the rest of the file"
            )
        lattice = _lattice(words, element, at)
        if lattice is not None:
            found[element.name] = _regular(words, element, lattice)
            at += lattice.rows * lattice.stride
        else:
            starts, end = _starts(words, element, at)
            found[element.name], _ = _columns(words, element, starts, np.append(starts[1:], end))
            at = end
    if data[at:].strip():
        fail_at(at, "more bytes than the header announces")
    return words, found


def _starts(words: ByteWords, element: Element, at: int) -> tuple[NDArray[np.int64], int]:
    """Where each row of a binary element begins, and where the last one ends."""
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
                    fail_at(at, f"a list of the element {element.called} has a negative length")
                at += length + size * count
        if at > len(data):
            fail_at(starts[-1], f"a row of the element {element.called} is cut off")
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


def _lattice(words: Words, element: Element, at: int, known: NDArray[np.int64] | None = None) -> Lattice | None:
    """The rows, if all have lists as long as those of the first. known: how long all rows are, where lines tell it."""
    if not element.count:
        return Lattice(at, 0, 1)
    lengths, place = [], at  # (address in the first row, type, value)
    for item in element.properties:
        if item.length is not None:
            if place + words.size(item.length) > words.end:
                return None
            count = int(words.values(Places(Lattice(place, 1, 1)), item.length)[0])
            if count < 0:
                return None
            lengths.append((place, item.length, count))
            place += words.size(item.length) + count * words.size(item.kind)
        else:
            place += words.size(item.kind)
    stride = place - at
    if at + stride * element.count > words.end or (known is not None and known[0] != stride):
        return None
    same = (
        bool((words.values(Places(Lattice(start, element.count, stride)), kind) == count).all())
        for start, kind, count in lengths
    )
    return Lattice(at, element.count, stride) if all(same) else None
