"""Legacy VTK files (``.vtk``): unstructured grids and polygonal data, text and binary, versions 1.0 to 5.1.

POINTS are followed by lists of cells; CELL_DATA and POINT_DATA by arrays of attributes. Until version 4 each list of
nodes has its length in front; since version 5 there are two arrays, OFFSETS and CONNECTIVITY, instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert, vtk_cells, vtk_ranges
from gmsnet.io.cells import joined
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.normals import Normals, in_words
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import Addresses, Lattice, Places, lists, pick
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges
from gmsnet.io.vtk_faces import nodes_once
from gmsnet.io.vtk_fields import Take, attribute, field_arrays, keyword, vectors
from gmsnet.io.vtk_stream import OWN_TYPES, Array, Line, Stream, opened, word_of
from gmsnet.kernels.text import text as kernels
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import FaceCorners, names_normals
from gmsnet.mesh.vtk_types import POLYGON, POLYHEDRON, POLYLINE, POLYVERTEX

name = "VTK"
suffixes: tuple[str, ...] = (".vtk",)

LISTS = {"VERTICES": POLYVERTEX, "LINES": POLYLINE, "POLYGONS": POLYGON}
TYPE_NAMES = {kind: called for called, kind in OWN_TYPES.items() if called not in ("vtkidtype", "signed_char")}


@dataclass(frozen=True)
class CellLists:
    """Lists of nodes. sizes: how many each has; nodes: of all lists in turn; at: their places in the array."""

    sizes: NDArray[np.int64]
    nodes: NDArray[np.int64]
    at: Addresses
    array: Array


@dataclass
class Contents:
    """What the sections of a file add up to.

    fields: of the points and of the cells, with their announced number. others: what is not kept, in words.
    """

    points: Array | None = None
    lists: dict[str, CellLists] = field(default_factory=dict)
    types: NDArray[np.int64] | None = None
    fields: dict[str, list[tuple[str, NDArray[Any]]]] = field(default_factory=dict)
    counts: dict[str, tuple[int, Line]] = field(default_factory=dict)
    others: list[str] = field(default_factory=list)


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    stream, polygonal = opened(files[".vtk"])
    found = Contents()
    while (line := stream.line()).words:
        _section(stream, line, found)
    return _assemble(stream, found, polygonal)


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``."""
    stream, _ = opened(files[".vtk"])
    found, corners, result = Contents(), FaceCorners.of(cells), []
    while (line := stream.line()).words:
        _section(stream, line, found, vectors)
    count = sum(len(block.nodes) for block in cells)
    for key, row in (("POINT_DATA", corners.node), ("CELL_DATA", corners.cell)):
        for called, array in found.fields.get(key, []):
            if (
                isinstance(array, Array)
                and names_normals(called)
                and (key == "POINT_DATA" or len(array.at) == 3 * count)
            ):
                result.append(in_words(called, array.source, array.at, array.kind, row))
    return result


def _section(stream: Stream, line: Line, found: Contents, take: Take | None = None) -> None:
    """Reads on. take: see ``field_arrays``."""
    key = line.key
    if key in found.lists or key in found.counts or (key == "POINTS" and found.points is not None):
        stream.fail(line.start, f"{key} is given twice")
    if key == "POINTS":
        count, kind = stream.expect(line, "POINTS count type")
        if kind.lower() not in ("float", "double"):
            stream.fail(line.start, f"POINTS of type {word_of(kind)} are not supported: write them as double")
        found.points = stream.array(line, 3 * stream.count(line, count), kind)
    elif key == "CELLS" or key in LISTS:
        found.lists[key] = _lists(stream, line)
    elif key == "TRIANGLE_STRIPS":
        stream.fail(line.start, "TRIANGLE_STRIPS are not supported: turn them into triangles first")
    elif key == "CELL_TYPES":
        (count,) = stream.expect(line, "CELL_TYPES count")
        found.types = stream.array(line, stream.count(line, count), "int").values()
    elif key in ("POINT_DATA", "CELL_DATA"):
        (count,) = stream.expect(line, f"{key} count")
        found.counts[key] = stream.count(line, count), line
        found.fields[key] = []
    elif not found.fields:
        if key != "FIELD":
            stream.fail(line.start, f"unknown keyword {word_of(line.words[0])}")
        field_arrays(stream, line, None, found.others)  # facts about the whole grid
    else:
        place = list(found.fields)[-1]
        found.fields[place] += attribute(stream, line, found.counts[place][0], found.others, take)


def _lists(stream: Stream, line: Line) -> CellLists:
    count, size = (stream.count(line, text) for text in stream.expect(line, f"{line.key} count size"))
    if not stream.next_is(b"OFFSETS"):
        array = stream.array(line, size, "int")
        return counted_lists(array, count, line.key)
    offsets, nodes = (
        stream.array(part, length, stream.expect(part, f"{key} type")[0])
        for key, length in (("OFFSETS", count), ("CONNECTIVITY", size))
        for part in [keyword(stream, key)]
    )
    first = offsets.values()
    if not count:
        first = np.zeros(1, dtype=np.int64)
    wrong = np.flatnonzero(np.diff(first, append=size) < 0)
    if first[0] or first[-1] != size or wrong.size:
        offsets.fail(int(wrong[0]) if wrong.size else 0, f"OFFSETS must rise from 0 to the {size} of CONNECTIVITY")
    return CellLists(np.diff(first), nodes.values(), Places(Lattice(0, size, 1)), nodes)


def counted_lists(array: Array, count: int, key: str) -> CellLists:
    """``count`` lists of nodes, each with its length in front, which together are the whole array."""
    numbers = array.values()
    stride = len(numbers) // count if count else 0
    if stride and stride * count == len(numbers) and (numbers[::stride] == stride - 1).all():
        at: Addresses = Places(Lattice(0, count, stride, range(1, stride)))
        return CellLists(np.full(count, stride - 1), pick(numbers, at), at, array)
    none, first = np.empty(0, dtype=np.int8), np.empty(min(count, len(numbers)), dtype=np.int64)
    found, end = kernels.walk(numbers, 0, 1, -1, 0, none, none, first)
    if found < count:
        array.fail(min(end, len(numbers) - 1), f"list {found} of {key} goes beyond the {len(numbers)} numbers that "
                                               "were announced")  # fmt: skip
    if end != len(numbers):
        array.fail(end, f"the {count} lists of {key} end before the {len(numbers)} numbers that were announced")
    sizes = numbers[first]
    at = lists(first, sizes + 1, np.ones_like(sizes), sizes)
    return CellLists(sizes, pick(numbers, at), at, array)


def _assemble(stream: Stream, found: Contents, polygonal: bool) -> Parsed:
    keys = list(LISTS) if polygonal else ["CELLS"]
    parts = {key: found.lists[key] for key in keys if key in found.lists}
    there = {"POINTS": found.points is not None, "CELLS": polygonal or "CELLS" in parts}
    there["CELL_TYPES"] = polygonal or found.types is not None
    if found.points is None or not all(there.values()):
        raise FormatError(f"{' and '.join(k for k in there if not there[k])} missing: the file is cut off")
    if set(found.lists) - set(keys) or (polygonal and found.types is not None):
        raise FormatError(f"{', '.join(found.lists)}: these lists do not belong into this type of DATASET")
    sizes = joined([part.sizes for part in parts.values()])
    nodes = joined([part.nodes for part in parts.values()])
    codes = found.types
    if codes is None:
        codes = joined([np.full(len(part.sizes), LISTS[key]) for key, part in parts.items()])
    if len(codes) != len(sizes):
        raise FormatError(f"there are {len(sizes)} CELLS, but {len(codes)} CELL_TYPES")
    points, slots = found.points.source.coordinates(found.points.at, found.points.kind)
    for key, expected in (("POINT_DATA", len(points)), ("CELL_DATA", len(codes))):
        if key in found.counts and found.counts[key][0] != expected:
            announced, line = found.counts[key]
            stream.fail(line.start, f"{key} has {announced} rows instead of {expected}")

    def blame_number(index: int, message: str) -> NoReturn:
        for part in parts.values():
            if index < len(part.nodes):
                part.array.fail(int(part.at[index]), message)
            index -= len(part.nodes)
        raise FormatError(message)

    blame, polyhedra = blame_number, codes == POLYHEDRON
    if polyhedra.any():
        sizes, kept = nodes_once(polyhedra, sizes, nodes, len(points), blame_number)
        nodes = nodes[kept]

        def blame(index: int, message: str) -> NoReturn:
            blame_number(int(kept[index]), message)

    return vtk_cells.parsed(
        points,
        slots,
        found.points.kind == "f4",
        codes,
        sizes,
        nodes,
        found.fields.get("POINT_DATA", []),
        found.fields.get("CELL_DATA", []),
        blame,
        found.others,
    )


def plan(file: Ranges) -> Plan | None:
    """See ``vtk_ranges.plan``."""
    return vtk_ranges.plan(file)


def write(mesh: Mesh) -> Written:
    """See Format. An unstructured grid of version 4.2 as text, points in double precision."""
    convert.check_kinds(mesh, name, vtk_cells.CODES)
    point_fields, cell_fields, lost = vtk_cells.fields_out(mesh, name)
    return Written({".vtk": Pieces(lambda: _text(mesh, point_fields, cell_fields))}, lost)


def _text(mesh: Mesh, point_fields: vtk_cells.Fields, cell_fields: vtk_cells.Fields) -> Iterator[Piece]:
    cells, numbers = sum(len(block.nodes) for block in mesh.cells), sum(block.nodes.size for block in mesh.cells)
    yield b"# vtk DataFile Version 4.2\nmesh\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    yield b"POINTS %d double\n" % len(mesh.points)
    yield from vtk_cells.rows_text(convert.in_space(mesh))
    yield b"CELLS %d %d\n" % (cells, cells + numbers)
    yield from vtk_cells.lines_text(np.insert(block.nodes[some], 0, block.nodes.shape[1], axis=1)
                                    for block, some in vtk_cells.parts(mesh))  # fmt: skip
    yield b"CELL_TYPES %d\n" % cells
    yield from vtk_cells.lines_text(vtk_cells.codes(mesh))
    for key, count, fields in (("POINT_DATA", len(mesh.points), point_fields), ("CELL_DATA", cells, cell_fields)):
        if fields:
            yield f"{key} {count}\nFIELD FieldData {len(fields)}\n".encode("ascii")
        for called, array in fields:
            kind = TYPE_NAMES[array.dtype.str[1:]]
            yield f"{quote(called) or 'field'} {array.shape[1]} {len(array)} {kind}\n".encode("ascii")
            yield from vtk_cells.rows_text(array)
