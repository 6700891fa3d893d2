"""How the numbers of a binary Gmsh file lie, of version 2.2 or 4.1, of which ranks read ranges."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gmsnet.io import gmsh_sections as sections
from gmsnet.io.gmsh_cursor import BEGIN, Cursor, opened
from gmsnet.io.gmsh_entities import (
    PART,
    changes,
    entities_in_several,
    ghost_marks,
    group_numbers,
    merge_groups,
    read_entities,
    read_names,
    without_interfaces,
)
from gmsnet.io.gmsh_periodic import read_images
from gmsnet.io.gmsh_sections import KINDS, PARTITIONED, SIZES, Contents, Elements
from gmsnet.io.places import Lattice, Places
from gmsnet.io.range_words import RangeWords, rows_of
from gmsnet.io.ranges import NO_IMAGES, Column, Plan, Table, blocks_of
from gmsnet.io.rows import Ranges, Rows

READ = (b"PhysicalNames", b"Entities", b"PartitionedEntities", b"Nodes", b"Elements")
AT_ONCE = 1 << 20  # bytes in which the end of a section is looked for
MOST = 20_000  # blocks of nodes or runs of elements of files that are planned
_WORD = 4096  # bytes that a word and the white space before it have at most


class RangeCursor(Cursor):
    """A binary file that is not in memory. order: see Cursor."""

    file: Ranges

    def __init__(self, file: Ranges, at: int, order: str) -> None:
        super().__init__(b"", at, order)
        self.file = file

    def word(self) -> bytes:
        """See Cursor."""
        inner = Cursor(bytes(self.file.read(self.at, max(0, min(_WORD, self.file.size - self.at)))), 0, self.order)
        found = inner.word()
        self.at += inner.at
        return found

    def skip_section(self, title: bytes) -> None:
        """See Cursor."""
        end, at = b"$End" + title, self.at
        while at < self.file.size:
            data = self.file.read(at, min(AT_ONCE, self.file.size - at))
            if (found := data.find(end)) >= 0:
                self.at = at + found + len(end)
                return
            at += max(1, len(data) - len(end) + 1)
        self.fail(self.file.size, "the end of a section is missing: the file is cut off")

    def section(self, title: bytes) -> Cursor:
        """The section that begins here by itself, to be read in memory."""
        begin = self.at
        self.skip_section(title)
        return Cursor(bytes(self.file.read(begin, self.at - begin)), 0, self.order)

    def words(self, title: bytes, as_text: bool = False) -> RangeWords:
        """See Cursor: of binary numbers."""
        return RangeWords(self.file, self.order, self.at)


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a file lie; None for texts, ghost cells, very many blocks, and comments in front.

    Raises FormatError for a file that is damaged.
    """
    begin = bytes(file.read(0, min(file.size, BEGIN)))
    if begin.lstrip().startswith(b"$Comments"):
        return None
    source, old = opened(begin)
    order = source.order
    if not order:
        return None
    cursor, found, seen = RangeCursor(file, source.at, order), Contents(), set[bytes]()
    nodes: tuple[list[Lattice], list[Lattice]] = [], []
    tables: Callable[[], list[Table] | None] = list
    images = [NO_IMAGES]
    while title := cursor.word():
        name = title[1:]
        if title in seen or title[:1] != b"$" or name == b"ParametricNodes":
            return None
        if name == b"Periodic":
            section = cursor.section(name)
            words = section.words(name, as_text=old)
            images.append(read_images(words, old))
            section.close(name, words)
            continue
        if name not in READ or (old and b"Entities" in name):
            cursor.skip_section(name)
            continue
        seen.add(title)
        if name == b"PhysicalNames":
            read_names(cursor.section(name), found)
            continue
        count = cursor.count() if old else 0
        words = cursor.words(name)
        if name == b"Nodes":
            nodes = _old_nodes(words, count) if old else sections.node_blocks(words)
        elif name != b"Elements":
            read_entities(words, name == b"PartitionedEntities", found)
        elif old:
            runs = list(itertools.islice(sections.element_runs(words, count), MOST))
            if sum(rows.rows for _, _, rows in runs) < count:
                return None
            tables = partial(_old_tables, found, runs, order, file)
        else:
            tables = partial(_new_tables, found, words, *sections.element_blocks(words))
        cursor.close(name, words)
    blocks = blocks_of(tables() or [])
    if not blocks or not any(each.rows for each in nodes[1]) or max(len(nodes[1]), sum(map(len, blocks))) > MOST:
        return None
    first = np.cumsum([0, *(each.rows for each in nodes[1])]).tolist()
    points = [Column(rows_of(each, f"{order}f8"), begin) for each, begin in zip(nodes[1], first[:-1], strict=True)]
    tags = [rows_of(each, order + ("i4" if old else "u8")) for each in nodes[0]]
    names = {(dim, tag): name for (dim, other), name in found.names.items() for tag in (other, -other)} | found.names
    return Plan(points, blocks, False, tags, images=np.concatenate(images), names=names)


def _old_nodes(words: RangeWords, count: int) -> tuple[list[Lattice], list[Lattice]]:
    tags, points = sections.node_rows(words, count)
    return [tags], [points]


def _old_tables(
    found: Contents, runs: Sequence[tuple[int, int, Lattice]], order: str, file: Ranges
) -> list[Table] | None:
    """Cells of version 2.2; None where partitioning may have changed the groups, or added elements, or where cells may
    be listed once for each of several groups."""
    if any(map(PART.fullmatch, found.names.values())) or any(tags >= PARTITIONED for _, tags, _ in runs):
        return None
    if _has_several_groups(runs, order, file):
        return None
    tables, whole = list[Table](), f"{order}i4"
    for code, tags, rows in runs:
        nodes = Rows(rows.start + 4 * (1 + tags), rows.rows, rows.stride, whole, int(SIZES[code]))
        groups = Rows(rows.start + 4, rows.rows, rows.stride, whole) if tags else None
        tables.append(Table(KINDS[code].name, nodes, 0, KINDS[code].order, 0, groups))
    return tables


def _has_several_groups(runs: Sequence[tuple[int, int, Lattice]], order: str, file: Ranges) -> bool:
    """Whether elements of an entity are in several groups; some are looked at at a time."""
    known: list[NDArray[np.int64]] = [np.empty((0, 3), dtype=np.int64)]
    for code, tags, rows in runs:
        both = Rows(rows.start + 4, rows.rows, rows.stride, f"{order}i4", 2)
        step = max(1, AT_ONCE // rows.stride)
        for begin in range(0, rows.rows if tags > 1 else 0, step):
            found = changes(both.of(file, begin, min(begin + step, rows.rows)).astype(np.int64))
            known.append(np.column_stack([np.full(len(found), code), found]))
    code, physical, geometrical = np.concatenate(known).T
    return bool(entities_in_several(code.astype(np.int8), geometrical, physical))


def _new_tables(
    found: Contents, words: RangeWords, heads: NDArray[np.int64], places: Sequence[Lattice]
) -> list[Table] | None:
    """Cells of version 4.1; None where some are copies of those of other partitions."""
    codes, each = heads[:, 2].astype(np.int8), np.ones(len(heads), dtype=np.int64)
    blocks = Elements(codes, heads[:0, 0], Places(), words, entity=heads[:, :2], number=each)  # as if of one cell
    found.names = merge_groups(found, blocks)
    regions = group_numbers(found, blocks, found.names)
    kept, _ = without_interfaces(found, blocks)
    if ghost_marks(found, blocks):
        return None
    tables = list[Table]()
    for block in np.flatnonzero(kept).tolist():
        kind = KINDS[int(codes[block])]
        rows = rows_of(places[block], f"{words.order}u8")
        tables.append(Table(kind.name, rows, 0, kind.order, int(regions[block])))
    return tables
