"""The sections of a Gmsh file, in text or binary, read by one logic: arrays of numbers at addresses.

Nodes and elements stand in blocks with a short head each. The heads are read one by one, as each tells where the next
one is; the numbers within the blocks are only addressed, and read all at once at the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.io.cell_table import Kind
from gmsnet.io.cells import joined
from gmsnet.io.places import Addresses, Lattice, Places, chained, lists, pick, shifted
from gmsnet.io.splice import Slots
from gmsnet.io.words import ByteWords, Words
from gmsnet.kernels.text import text as kernels

_HEX20 = (*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15)
_WEDGE15 = (*range(6), 6, 9, 7, 12, 14, 13, 8, 10, 11)
_PYRAMID13 = (*range(5), 5, 8, 10, 6, 7, 9, 11, 12)
# Gmsh's types of elements: the name, the number of nodes and, where Gmsh's order differs, the places of Mesh's nodes.
KINDS = {
    1: Kind("line"), 2: Kind("triangle"), 3: Kind("quad"), 4: Kind("tetra"), 5: Kind("hexahedron"), 6: Kind("wedge"),
    7: Kind("pyramid"), 8: Kind("line3"), 9: Kind("triangle6"), 10: Kind("quad9"),
    11: Kind("tetra10", (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)), 15: Kind("vertex"), 16: Kind("quad8"),
    12: Kind("hexahedron27", (*_HEX20, 22, 23, 21, 24, 20, 25, 26)), 13: Kind("wedge18", (*_WEDGE15, 15, 17, 16)),
    14: Kind("pyramid14", (*_PYRAMID13, 13)), 17: Kind("hexahedron20", _HEX20), 18: Kind("wedge15", _WEDGE15),
    19: Kind("pyramid13", _PYRAMID13), 21: Kind("triangle10"), 26: Kind("line4"),
}  # fmt: skip
SIZES = np.array([nodes_of(KINDS[code].name) if code in KINDS else 0 for code in range(max(KINDS) + 1)], dtype=np.int8)

PARTITIONED = 4  # tags of an element in version 2.2: group, entity, number of partitions, partitions
_TOGETHER = 1 << 20  # numbers of elements that are looked at together
_ALIKE = 1 << 16  # heads of elements, likewise


@dataclass
class Elements:
    """Elements one after another. nodes: tags, those of an element behind those of the one before; at: their addresses.

    entity: (blocks, 2) dimension and tag of the entity of each block, and number: (blocks,) of its elements (of version
    4.1). physical: (n,) the physical tag of each, geometrical: (n,) that of its entity, partitioned: (n,) whether it
    names a partition (of version 2.2). Tags that are not there are 0.
    """

    codes: NDArray[np.int8]
    nodes: NDArray[np.int64]
    at: Addresses
    words: Words
    entity: NDArray[np.int64] | None = None
    number: NDArray[np.int64] | None = None
    physical: NDArray[np.int64] | None = None
    geometrical: NDArray[np.int64] | None = None
    partitioned: NDArray[np.bool_] | None = None

    @property
    def sizes(self) -> NDArray[np.int8]:
        """(n,) the number of nodes of each."""
        return SIZES[self.codes]


@dataclass
class Nodes:
    """Nodes one after another: their tags and where these stand, coordinates, and the slots of these."""

    tags: NDArray[np.int64]
    tags_at: Addresses
    points: NDArray[np.float64]
    slots: Slots
    words: Words


@dataclass
class Contents:
    """What the sections of a file add up to.

    physical: (dimension, entity) → its physical tags. parents: of the entities that partitioning made, the dimension of
    those that they are parts of. partitions: how many there are in all, of version 4.1. ghosts: the tags of entities of
    cells that other partitions own. images: (n, 2) the tags of nodes of periodic entities. others: the titles of
    sections that are not read, or not all.
    """

    names: dict[tuple[int, int], str] = field(default_factory=dict)
    physical: dict[tuple[int, int], tuple[int, ...]] = field(default_factory=dict)
    parents: dict[tuple[int, int], int] = field(default_factory=dict)
    partitions: int = 0
    ghosts: set[int] = field(default_factory=set)
    nodes: Nodes | None = None
    elements: Elements | None = None
    images: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    others: dict[str, None] = field(default_factory=dict)


def ints(words: Words, count: int, kind: str = "i4") -> list[int]:
    """The next integers."""
    found: list[int] = words.values(words.take(count, kind), kind).tolist()
    return found


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


def nodes_old(words: Words, count: int) -> Nodes:
    """Nodes of version 2.2."""
    tags, at = node_rows(words, count)
    return _nodes(words, Places(tags), "i4", Places(at))


def node_rows(words: Words, count: int) -> tuple[Lattice, Lattice]:
    """Where the tags and the coordinates of version 2.2 stand: rows of both."""
    start, tag, unit = skip(words, (count, "i4"), (3 * count, "f8")), words.size("i4"), words.size("f8")
    row = tag + 3 * unit
    return Lattice(start, count, row), Lattice(start, count, row, (tag, tag + unit, tag + 2 * unit))


def nodes_new(words: Words) -> Nodes:
    """Nodes of version 4.1."""
    tags, points = node_blocks(words)
    return _nodes(words, Places(*tags), "u8", Places(*points))


def node_blocks(words: Words) -> tuple[list[Lattice], list[Lattice]]:
    """Where the tags and the coordinates of version 4.1 stand: blocks of tags, then of coordinates, which u, v, w may
    follow."""
    blocks, total, _, _ = counts(words, 4)
    tag, unit = words.size("u8"), words.size("f8")
    tags, points = list[Lattice](), list[Lattice]()
    for _ in range(blocks):
        dimension, _, parametric = ints(words, 3)
        if not 0 <= dimension <= 3 or parametric not in (0, 1):
            words.fail(words.at, f"a block of nodes has the dimension {dimension} and parametric {parametric}")
        (count,) = counts(words, 1)
        width = 3 + dimension * parametric
        tags.append(Lattice(skip(words, (count, "u8")), count, tag))
        points.append(Lattice(skip(words, (count * width, "f8")), count, width * unit, (0, unit, 2 * unit)))
    if (found := sum(lattice.rows for lattice in tags)) != total:
        words.fail(words.at, f"$Nodes announces {total} nodes, but its blocks have {found}")
    return tags, points


def _nodes(words: Words, tags_at: Places, kind: str, at: Places) -> Nodes:
    tags = words.values(tags_at, kind)
    return Nodes(tags, tags_at, *words.coordinates(at, "f8"), words)


def elements_new(words: Words) -> Elements:
    """Elements of version 4.1."""
    heads, places = element_blocks(words)
    at_nodes, number = Places(*places), heads[:, 3]
    nodes = words.values(at_nodes, "u8")
    return Elements(
        np.repeat(heads[:, 2].astype(np.int8), number), nodes, at_nodes, words, entity=heads[:, :2], number=number
    )


def element_blocks(words: Words) -> tuple[NDArray[np.int64], list[Lattice]]:
    """Blocks of version 4.1, each of one entity and type: rows of a tag and the nodes.

    Returns (blocks, 4) the dimension and tag of the entity, type and number of elements, and where the nodes stand.
    """
    blocks, total, _, _ = counts(words, 4)
    unit = words.size("u8")
    heads, places = [], list[Lattice]()
    for _ in range(blocks):
        at = words.at
        dimension, tag, code = ints(words, 3)
        (count,) = counts(words, 1)
        size = node_count(words, at, code)
        start = skip(words, (count * (1 + size), "u8"))
        heads.append((dimension, tag, code, count))
        places.append(Lattice(start, count, (1 + size) * unit, tuple(unit * k for k in range(1, 1 + size))))
    found = np.array(heads, dtype=np.int64).reshape(-1, 4)
    if found[:, 3].sum() != total:
        words.fail(words.at, f"$Elements announces {total} elements, but its blocks have {found[:, 3].sum()}")
    return found, places


def elements_old(words: Words, total: int) -> Elements:
    """Elements of version 2.2: in a text rows of tag, type, number of tags, tags, nodes; in a binary file blocks."""
    if isinstance(words, ByteWords):
        return _elements_of_bytes(words, total)
    codes, parted, nodes, places, found, most = [], [], [], list[Addresses](), 0, _TOGETHER
    physical, geometrical = list[NDArray[np.int64]](), list[NDArray[np.int64]]()
    while found < total:
        start = words.at
        values = words.values(Places(Lattice(start, min(most, words.end - start), 1)), "i4")
        room = min(total - found, len(values) // 3)
        code, first = np.empty(room, dtype=np.int8), np.empty(room, dtype=np.int64)
        count, end = kernels.walk(values, 0, 3, 1, 2, SIZES, code, first)
        if not count:
            if start + len(values) == words.end:
                _blame(words, values, found, total)
            most *= 2  # one element with so many tags
            continue
        code, first = code[:count], first[:count]
        tags, sizes = values[first + 2], SIZES[code].astype(np.int64)
        at = lists(first, 3 + tags + sizes, 3 + tags, sizes)
        codes.append(code)
        for tag, given in enumerate((physical, geometrical)):
            given.append(np.where(tags > tag, values[np.minimum(first + 3 + tag, len(values) - 1)], 0))
        parted.append(tags >= PARTITIONED)
        nodes.append(pick(values, at))
        places.append(shifted(at, start))
        words.at, found = start + end, found + count
    return Elements(
        joined(codes, np.int8), joined(nodes), chained(places), words,
        physical=joined(physical), geometrical=joined(geometrical), partitioned=joined(parted, np.bool_),
    )  # fmt: skip


def _blame(words: Words, values: NDArray[np.int64], found: int, total: int) -> NoReturn:
    """Raises FormatError for the element that begins with ``values``, ``found`` of ``total`` being before it."""
    if len(values) < 3:
        words.fail(words.end, f"$Elements ends after {found} of {total} elements")
    code, tags = values[1:3].tolist()
    size = node_count(words, words.at, code)
    words.fail(words.at, f"the element that begins here has {tags} tags and {size} nodes: it is cut off")


def _elements_of_bytes(words: ByteWords, total: int) -> Elements:
    """Elements of version 2.2 in a binary file."""
    codes, parted, places = [], [], []
    physical, geometrical = list[NDArray[np.int64]](), list[NDArray[np.int64]]()
    for code, tags, rows in element_runs(words, total):
        number, size = rows.rows, node_count(words, rows.start, code)
        codes.append(np.full(number, code, dtype=np.int8))
        for tag, given in enumerate((physical, geometrical)):
            there = number if tags > tag else 0
            given.append(words.values(Places(Lattice(rows.start + 4 * (1 + tag), there, rows.stride)), "i4"))
            given.append(np.zeros(number - there, dtype=np.int64))
        parted.append(np.full(number, tags >= PARTITIONED))
        columns = tuple(4 * (1 + tags + k) for k in range(size))
        places.append(Lattice(rows.start, number, rows.stride, columns))
    at_nodes = Places(*places)
    return Elements(
        joined(codes, np.int8), words.values(at_nodes, "i4"), at_nodes, words,
        physical=joined(physical), geometrical=joined(geometrical), partitioned=joined(parted, np.bool_),
    )  # fmt: skip


def element_runs(words: ByteWords, total: int) -> Iterator[tuple[int, int, Lattice]]:
    """Elements of version 2.2 in a binary file, each a tag, the tags of its groups and its nodes: runs of them with
    their type, how many tags of groups they have, and where their own tags stand.

    Blocks of elements have a head each: type, number of elements, number of tags. Gmsh makes each element a block.
    """
    done, most = 0, 1
    while done < total:
        at = words.at
        code, count, tags = ints(words, 3)
        size = node_count(words, at, code)
        if count <= 0 or tags < 0 or done + count > total:
            words.fail(at, f"a block of {count} elements with {tags} tags each cannot be right")
        row = 4 * (1 + tags + size)
        start = skip(words, (count * row // 4, "i4"))
        if count > 1:
            done += count
            yield code, tags, Lattice(start, count, row)
            continue
        run, room = 1, min(most, total - done, (words.end - at) // (12 + row))
        if room > 1:
            heads = words.values(Places(Lattice(at, room, 12 + row, (0, 4, 8))), "i4").reshape(room, 3)
            alike = (heads == (code, 1, tags)).all(axis=1)
            run = room if alike.all() else int(np.argmin(alike))
            skip(words, ((run - 1) * (12 + row) // 4, "i4"))
        most = min(2 * most, _ALIKE) if run == room else 2 * run  # as many as before are looked at, in the end
        done += run
        yield code, tags, Lattice(start, run, 12 + row)


def node_count(words: Words, at: int, code: int) -> int:
    """The number of nodes of a type of element. Raises FormatError for one that is not supported."""
    if code not in KINDS:
        words.fail(at, f"elements of Gmsh type {code} are not supported: save the mesh with order 1 or 2")
    return nodes_of(KINDS[code].name)
