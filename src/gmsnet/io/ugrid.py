"""UGRID meshes of AFLR, FUN3D and others: a text (``.ugrid``), or binary in one of eight forms (``.b8.ugrid`` …).

Seven counts, the coordinates, the boundary faces with a surface number each, then the volumes by kind. The form is
part of the name: ``b`` stands for plain bytes, ``r`` for Fortran's records, ``l`` before it for little endian (else big
endian), the digit for the bytes of a coordinate. What follows the volumes is kept.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cell_table import check_range
from gmsnet.io.cells import distinct, sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.ranges import Column, Plan, Table, distinct_of
from gmsnet.io.rows import Ranges, Rows
from gmsnet.io.text import Text
from gmsnet.io.words import ByteWords, TextWords, Words, fail_at
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "UGRID"
suffixes: tuple[str, ...] = (".ugrid",)

KINDS = ("triangle", "quad", "tetra", "pyramid", "wedge", "hexahedron")  # in the order of the counts and of the lists
FACES = 2  # of them
PYRAMID = (1, 0, 3, 4, 2)  # of each of Mesh's nodes the place in the file, where the third is the apex
_TEXT = ""


class Form(NamedTuple):
    """How a binary file is written. order: ``<`` or ``>``; real: bytes of a coordinate; records: of Fortran."""

    order: str
    real: int
    records: bool

    @property
    def head(self) -> int:
        """Where the coordinates begin."""
        return 28 + 12 * self.records


HEAD = 44  # bytes that tell the form
FORMS = {
    f"{little}{how}{real}": Form("<" if little else ">", real, how == "r")
    for real in (8, 4) for how in "br" for little in ("", "l")
}  # fmt: skip


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Boundary faces become cells whose region is the number of their surface."""
    data = files[".ugrid"]
    key = form_of(data)
    kind = f"f{FORMS[key].real}" if key else "f8"
    words = _words(data, key)
    counts = words.values(words.take(7, "i4"), "i4")
    if (counts < 0).any():
        raise FormatError(f"a count is negative: {counts[np.argmin(counts)]}")
    if key and FORMS[key].records:
        words.at = FORMS[key].head
    points, slots = words.coordinates(words.take(3 * int(counts[0]), kind), kind)
    tables = [_table(words, of, int(count), len(points)) for of, count in zip(KINDS[:FACES], counts[1:3], strict=True)]
    numbers = words.values(words.take(int(counts[1] + counts[2]), "i4"), "i4")
    tables += [_table(words, of, int(count), len(points)) for of, count in zip(KINDS[FACES:], counts[3:], strict=True)]
    surfaces = np.split(sealed(numbers), [int(counts[1])])
    zeros = [np.zeros(len(table), dtype=np.int64) for table in tables[FACES:]]
    regions = [*surfaces, *zeros]
    cells = [CellBlock(of, *pair) for of, *pair in zip(KINDS, tables, regions, strict=True) if len(pair[0])]
    volumes = any(len(table) for table in tables[FACES:])
    names = _names(distinct(numbers)) if volumes else {}
    end = len(data) - 4 if key and FORMS[key].records else words.end
    unread = ["what follows the volumes"] * (words.at < end)
    return Parsed(points, cells, slots, names, single=kind == "f4", unread=unread, form=key)


def _names(numbers: Iterable[int]) -> dict[tuple[int, int], str]:
    """Of surfaces, so that ``--fix`` may name them."""
    return {(2, number): str(number) for number in numbers}


def _words(data: Data, key: str) -> Words:
    if key == _TEXT:
        text = Text(data)
        return TextWords(text, text.tokens(0)[0])
    return ByteWords(data, FORMS[key].order, 4 * FORMS[key].records)


def _table(words: Words, kind: str, count: int, points: int) -> NDArray[np.int64]:
    places = words.take(count * nodes_of(kind), "i4")
    nodes = words.values(places, "i4")
    nodes -= 1
    check_range(nodes, points, lambda k, message: words.fail(places[k], f"{message} (counted from 0)"))
    nodes = nodes.reshape(count, nodes_of(kind))
    return sealed(np.ascontiguousarray(nodes[:, PYRAMID]) if kind == "pyramid" else nodes)


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a binary file lie; None of a text, and where the name says another form."""
    head = bytes(file.read(0, min(file.size, HEAD)))
    key = form_of(head, file.size)
    told = os.path.basename(file.path).split(".")[-2:-1]
    if key == _TEXT or (told and told[0].lower() in FORMS and told[0].lower() != key):
        return None
    form, at = FORMS[key], FORMS[key].head
    counts = struct.unpack_from(f"{form.order}7i", head, 4 * form.records)
    whole = f"{form.order}i4"
    points = Rows(at, counts[0], 3 * form.real, f"{form.order}f{form.real}", 3)
    at += 3 * form.real * counts[0]
    tables, surfaces = [], at
    for kind, count in zip(KINDS, counts[1:], strict=True):
        width = nodes_of(kind)
        if kind == KINDS[FACES]:  # behind the numbers of the surfaces
            surfaces = at
            at += 4 * (counts[1] + counts[2])
        tables.append(Table(kind, Rows(at, count, 4 * width, whole, width), 1, PYRAMID if kind == "pyramid" else None))
        at += 4 * width * count
    for k in range(FACES):
        tables[k] = tables[k]._replace(regions=Rows(surfaces, counts[1 + k], 4, whole))
        surfaces += 4 * counts[1 + k]
    faces = Rows(surfaces - 4 * (counts[1] + counts[2]), counts[1] + counts[2], 4, whole)
    names = _names(distinct_of(file, faces)) if any(counts[1 + FACES :]) else {}
    return Plan([Column(points)], [[table] for table in tables if table.nodes.rows], form.real == 4, names=names)


def form_of(data: Data, size: int | None = None) -> str:
    """The form of a file, "" for text: that whose counts give the length of the file, else b8 or lb8 if it is longer.

    size: of the file, where ``data`` is only its head. Raises FormatError where none fits.
    """
    size = len(data) if size is None else size
    if not any(byte < 9 or byte > 126 for byte in bytes(data[:28])):
        return _TEXT
    lengths = {key: _length(data, form) for key, form in FORMS.items()}
    for key, length in lengths.items():
        if length == size:
            return key
    for key, length in lengths.items():
        if length is not None and length < size and FORMS[key].real == 8 and not FORMS[key].records:
            return key
    known = [length for length in lengths.values() if length is not None]
    if not known:
        raise FormatError("byte 0: seven counts were expected: the file is damaged, or no UGRID mesh")
    return fail_at(size, f"the file ends, but its counts ask for {min(known)} bytes: is it cut off?")


def _length(data: Data, form: Form) -> int | None:
    """How many bytes the counts of a file ask for in a form; None where they are no counts of that form."""
    begin = 4 * form.records
    if len(data) < form.head:
        return None
    counts: tuple[int, ...] = struct.unpack(f"{form.order}7i", data[begin : begin + 28])
    if min(counts) < 0 or max(counts) == 0:
        return None
    size = 3 * counts[0] * form.real + 4 * (counts[1] + counts[2])
    size += sum(4 * count * nodes_of(kind) for kind, count in zip(KINDS, counts[1:], strict=True))
    if not form.records:
        return form.head + size
    marks = struct.unpack(f"{form.order}I", data[:4]) + struct.unpack(f"{form.order}2I", data[32:40])
    return form.head + size + 4 if marks[:2] == (28, 28) and marks[2] == size else None


def write(mesh: Mesh) -> Written:
    """See Format: as text."""
    return write_as(mesh, _TEXT)


def write_as(mesh: Mesh, key: str) -> Written:
    """The mesh in one of the forms. Faces keep their regions as surface numbers, and cells are listed by kind."""
    convert.check_kinds(mesh, name, (*KINDS, "line", "vertex"))
    tables = {kind: _joined(mesh, kind) for kind in KINDS}
    if not any(len(nodes) for nodes, _ in tables.values()):
        raise FormatError(f"{name} holds faces and volumes only, and this mesh has none")
    lost = convert.lost_cells(mesh, name, (0, 1)) + convert.lost_regions(mesh, name, 3)
    named = [f"{text!r} ({number})" for (dim, number), text in mesh.region_names.items() if dim == 2
             and text != str(number)]  # fmt: skip
    if named:
        lost.append(f"{name} numbers its surfaces: {convert.left_out('name', named)}")
    listed = [kind for kind in dict.fromkeys(block.kind for block in mesh.cells) if kind in KINDS]
    dimension = 3 if mesh.has_volumes else 2
    own = [block.kind for block in mesh.cells if block.dimension == dimension]
    if listed != sorted(listed, key=KINDS.index) or len(own) != len(set(own)):
        lost.append(f"{name} lists cells by kind: they were put in another order")
    points = convert.in_space(mesh)
    if key and FORMS[key].real == 4:
        lost += _lost_single(mesh, points)
    lost += convert.lost_data(mesh, name, regions=not mesh.has_volumes)
    return Written(
        {".ugrid": Pieces(lambda: _text(points, tables) if key == _TEXT else _bytes(points, tables, key))}, lost
    )


def _lost_single(mesh: Mesh, points: NDArray[np.float64]) -> list[str]:
    with np.errstate(over="ignore"):
        single = points.astype(np.float32).astype(np.float64)
    if not np.isfinite(single).all():
        raise FormatError("a coordinate is too large for single precision: write .b8.ugrid")
    return convert.lost_digits(mesh, points, single, name)


def _joined(mesh: Mesh, kind: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The nodes (n, nodes) of all cells of a kind, counted from 1, in the order of the file, and their regions."""
    blocks = [block for block in mesh.cells if block.kind == kind]
    nodes = np.concatenate([np.empty((0, nodes_of(kind)), dtype=np.int64), *(block.nodes for block in blocks)]) + 1
    regions = np.concatenate([np.empty(0, dtype=np.int64), *(block.regions for block in blocks)])
    return nodes[:, np.argsort(PYRAMID)] if kind == "pyramid" else nodes, regions


_Tables = dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]]


def _text(points: NDArray[np.float64], tables: _Tables) -> Iterator[Piece]:
    counts = [len(points), *(len(nodes) for nodes, _ in tables.values())]
    yield " ".join(map(str, counts)).encode() + b"\n"
    yield from convert.rows(convert.row_of(3), points)
    for kind in KINDS[:FACES]:
        yield from convert.rows(convert.row_of(nodes_of(kind)), tables[kind][0])
    for kind in KINDS[:FACES]:
        yield from convert.rows(b"%\n", tables[kind][1])
    for kind in KINDS[FACES:]:
        yield from convert.rows(convert.row_of(nodes_of(kind)), tables[kind][0])


def _bytes(points: NDArray[np.float64], tables: _Tables, key: str) -> Iterator[Piece]:
    form = FORMS[key]
    whole = f"{form.order}i4"
    counts = np.array([len(points), *(len(nodes) for nodes, _ in tables.values())])
    parts: list[NDArray[Any]] = [points.astype(f"{form.order}f{form.real}")]
    parts += [tables[kind][0].astype(whole) for kind in KINDS[:FACES]]
    parts += [tables[kind][1].astype(whole) for kind in KINDS[:FACES]]
    parts += [tables[kind][0].astype(whole) for kind in KINDS[FACES:]]
    size = sum(part.nbytes for part in parts)
    if form.records and size > _MOST_RECORD:
        raise FormatError(f"a record of Fortran holds at most {_MOST_RECORD} bytes: write .b8.ugrid")
    marks = [struct.pack(f"{form.order}I", length) * form.records for length in (28, size)]
    yield marks[0] + counts.astype(whole).tobytes() + marks[0] + marks[1]
    for part in parts:
        yield part.tobytes()
    yield marks[1]


_MOST_RECORD = 2**31 - 9  # bytes that compilers write into one record
