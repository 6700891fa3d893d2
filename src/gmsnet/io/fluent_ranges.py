"""Fluent files with binary sections of which a process reads and writes some faces and nodes only."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io.face_ranges import SomeFaces
from gmsnet.io.fluent_binary import CELLS, END, FACES, HEAD, NODES, Binary, is_binary, layout, members_of
from gmsnet.io.fluent_faces import PARENT, PERIODIC, owners, polygons
from gmsnet.io.fluent_sections import (
    LITTLE,
    MACHINE,
    NAMES,
    OPEN,
    Section,
    binary_section,
    faces_in,
    lists_in,
    text_section,
)
from gmsnet.io.foam_cells import Faces, Ints, Sides, volumes
from gmsnet.io.ranges import Column, Plan
from gmsnet.io.rows import Ranges, Rows, share
from gmsnet.mesh.cell_block import CellBlock

WINDOW, MOST_TEXT, MOST_SECTIONS = 1 << 16, 1 << 24, 100_000
EVERY = 1 << 14  # of faces that each say how many nodes they have, it is kept where so many end


class Zone(NamedTuple):
    """A section of faces. before: how many faces come before it. marks: (k,) bytes where each run of EVERY faces
    begins, and the end of all; empty where all faces have as many nodes."""

    section: Section
    before: int
    members: int
    marks: Sequence[int]


@dataclass(frozen=True)
class FluentFaces:
    """See FaceLists. zones: sections of faces; regions of cells are those of heads: number, first, and how many."""

    dimension: int
    zones: Sequence[Zone]
    heads: Sequence[tuple[int, int, int]]
    periodic: Sequence[int]

    @property
    def count(self) -> int:
        """See FaceLists."""
        return sum(zone.members for zone in self.zones)

    def some(self, file: Ranges, first: int, last: int) -> SomeFaces:
        """See FaceLists."""
        none = np.empty(0, dtype=np.int64)
        sizes, nodes, pairs, markers = [none], [none], [np.empty((0, 2), dtype=np.int64)], [none]
        for zone in self.zones:
            begin, end = max(first - zone.before, 0), min(last - zone.before, zone.members)
            if begin < end:
                size, listed, pair = _faces_of(file, zone, begin, end)
                sizes.append(size)
                nodes.append(listed - 1)
                pairs.append(pair)
                markers.append(np.full(end - begin, zone.section.zone))
        size, sides = np.concatenate(sizes), np.concatenate(pairs)
        if self.dimension == 2 and (size != 2).any():
            raise FormatError("a face of a mesh in the plane has two nodes")
        if (sides < 0).any() or not sides.any(axis=1).all():
            raise FormatError("a face lies at no cell")
        return SomeFaces(size, np.concatenate(nodes), *owners(sides), sides[:, 0] > 0, np.concatenate(markers))

    def cells(self, faces: Faces, sides: Sides, regions: Ints, before: int) -> list[CellBlock]:
        """See FaceLists."""
        return volumes(faces, sides, regions) if self.dimension == 3 else polygons(faces, sides, regions, before)

    def regions(self, rank: int, ranks: int, count: int) -> Sequence[tuple[int, Ints]]:
        """See FaceLists."""
        found = []
        for number, first, many in self.heads:
            there = max(0, min(many, count - first))
            found.append((number, first + np.arange(*share(there, rank, ranks))))
        return found

    def held(self, rank: int, ranks: int) -> tuple[Ints, Ints]:
        """See FaceLists: there are no such zones."""
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)


def _faces_of(file: Ranges, zone: Zone, first: int, last: int) -> tuple[Ints, Ints, Ints]:
    """Of some faces of a zone: how many nodes each has, all nodes, and (n, 2) the cells; all counted from 1."""
    section = zone.section
    assert section.body is not None
    if not zone.marks:
        width = section.head[4] + 2
        rows = Rows(section.body[0], zone.members, 4 * width, section.dtype, width)
        return faces_in(b"", section, rows.of(file, first, last).astype(np.int64).ravel(), last - first)
    begin, end = first // EVERY, -(-last // EVERY)
    start, stop = zone.marks[begin], zone.marks[min(end, len(zone.marks) - 1)]
    listed = np.frombuffer(file.read(start, stop - start), section.dtype).astype(np.int64)
    sizes, nodes, cells = faces_in(b"", section, listed, min(end * EVERY, zone.members) - begin * EVERY)
    some, ends = slice(first - begin * EVERY, last - begin * EVERY), np.cumsum(np.concatenate([[0], sizes]))
    return sizes[some], nodes[ends[some.start] : ends[some.stop]], cells[some]


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a file lie whose nodes and faces are binary; None of others, and of damaged ones.

    Sections of text are passed over by their brackets, binary ones by what their heads say.
    """
    try:
        found = list(_sections(file))
    except FormatError:  # told by the reader of the whole
        return None
    sections = [section for section, _ in found]
    dimension = next((each.head[0] for each in sections if each.key == 2 and each.head), 3)
    nodes = sorted((each for each in sections if each.key == NODES and each.body), key=lambda each: each.first)
    faces = [(each, marks) for each, marks in found if each.key == FACES and each.body]
    texts = [each for each in (*nodes, *(each for each, _ in faces)) if not each.dtype or len(each.head) < 5]
    if texts or not faces or dimension not in (2, 3) or len({each.dtype for each in nodes}) != 1:
        return None
    ends = [0, *np.cumsum([each.members for each in nodes]).tolist()]
    if any(each.first != 1 + before for each, before in zip(nodes, ends[:-1], strict=True)):
        return None
    size = dimension * np.dtype(nodes[0].dtype).itemsize
    columns = [
        Column(Rows(each.body[0], each.members, size, each.dtype, dimension), each.first - 1)
        for each in nodes if each.body is not None
    ]  # fmt: skip
    zones, before = list[Zone](), 0
    for each, marks in faces:
        if each.head[3] != PARENT:
            zones.append(Zone(each, before, each.members, marks))
            before += each.members
    heads = [(each.zone, each.first - 1, each.members) for each in sections
             if each.key == CELLS and len(each.head) > 2 and each.zone and each.first and each.members]  # fmt: skip
    periodic = [each.zone for each, _ in faces if each.head[3] in PERIODIC]
    titles = {each.zone: each.title for each in sections if each.key in NAMES}
    names = {(of, zone): title for zone, title in titles.items() for of in (dimension - 1, dimension)}
    lists = FluentFaces(dimension, zones, heads, periodic)
    return Plan(columns, [], nodes[0].dtype.endswith("4"), names=names, faces=lists)


def _sections(file: Ranges) -> Iterator[tuple[Section, Sequence[int]]]:
    """All sections, with marks of faces (see Zone). Raises FormatError where one cannot be passed over."""
    at, dimension, order = 0, 3, "<"
    for _ in range(MOST_SECTIONS):
        text = bytes(file.read(at, min(WINDOW, file.size - at)))
        found = OPEN.match(text)
        if found is None:
            if text.strip():
                break
            return
        key, start = int(found[1]), at + text.index(b"(", found.start())
        if is_binary(key):
            there, marks = _binary(file, at, text, found.end(), key, dimension, order)
            at = there.stop
            yield binary_section(key, start, there), marks
            continue
        text, lists, stop = _whole(file, at, found.end())
        section = text_section(text, key, start, found.end(), lists, stop)
        if section.body is not None:
            section = section._replace(body=(at + section.body[0], at + section.body[1]))
        if key == 2 and section.head:
            dimension = section.head[0]
        if key == MACHINE and lists:
            order = "<" if text[slice(*lists[0])].split()[:1] == [LITTLE] else ">"
        at += stop
        yield section, ()
    raise FormatError("a section was expected")


def _whole(file: Ranges, at: int, begin: int) -> tuple[bytes, list[tuple[int, int]], int]:
    """The bytes of a section of text, its lists and its end. begin: behind its number; all from byte ``at`` on."""
    size = WINDOW
    while True:
        text = bytes(file.read(at, min(size, file.size - at)))
        try:
            return text, *lists_in(text, begin)
        except FormatError:
            if size > MOST_TEXT or at + size >= file.size:
                raise
        size *= 4


def _binary(
    file: Ranges, at: int, text: bytes, begin: int, key: int, dimension: int, order: str
) -> tuple[Binary, Sequence[int]]:
    """See ``fluent_binary.binary``, with marks of faces. text: the bytes from ``at`` on."""
    head = HEAD.match(text, begin)
    if head is None or key % 1000 not in (NODES, CELLS, FACES):
        raise FormatError(f"the length of a binary section {key} is not known")
    numbers, first = tuple(int(word, 16) for word in head[1].split()), at + head.end()
    dtype, count = layout(key, numbers, dimension, order)
    marks: Sequence[int] = _marks(file, first, members_of(numbers), dtype) if count is None else ()
    stop = marks[-1] if count is None else first + count * np.dtype(dtype).itemsize
    if stop >= file.size:
        raise FormatError("the file is cut off")
    closed = re.compile(rb"\s*\)\s*" + END % key).match(bytes(file.read(stop, min(256, file.size - stop))))
    if closed is None:
        raise FormatError(f"the binary section {key} is damaged")
    return Binary(numbers, (first, stop), dtype, stop + closed.end()), marks


def _marks(file: Ranges, begin: int, members: int, dtype: str) -> list[int]:
    """Of so many faces that each say how many nodes they have, from byte ``begin`` on: see Zone."""
    marks, values, at = [begin], list[int](), 0
    for face in range(members):
        if at >= len(values) or at + values[at] + 3 > len(values):
            begin, at = begin + 4 * at, 0
            count = min(WINDOW, file.size - begin) // 4
            values = np.frombuffer(file.read(begin, 4 * count), dtype).tolist()
        if not values or not 2 <= values[at] <= len(values) - at - 3:
            raise FormatError(f"face {face} (counted from 0) of a binary section has a wrong number of nodes")
        at += values[at] + 3
        if (face + 1) % EVERY == 0 or face + 1 == members:
            marks.append(begin + 4 * at)
    return marks if members else [begin, begin]
