"""PLY files (``.ply``), text and binary of both byte orders: vertices, faces, edges and the properties of each.

The element ``vertex`` has x, y and z; ``face`` a list ``vertex_indices``; ``edge`` has ``vertex1`` and ``vertex2``.
Other properties that are one number are data; those of faces whose names say so are regions. Other elements are kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert, ply_header, ply_ranges
from gmsnet.io.cell_table import Kind, check_range, table_blocks
from gmsnet.io.cells import joined
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.normals import Normals, in_words
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import side_by_side
from gmsnet.io.ply_rows import Column, Table, tables
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges
from gmsnet.io.text import fail
from gmsnet.io.words import Words, typed
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import AXES, FaceCorners
from gmsnet.mesh.region_fields import names_a_region, regions_of

name = "PLY"
suffixes: tuple[str, ...] = (".ply",)

KINDS = {1: Kind("line"), 3: Kind("triangle"), 4: Kind("quad"), 5: Kind("polygon")}
LISTS = ("vertex_indices", "vertex_index")
TYPE_NAMES = {"i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint"}
TYPE_NAMES |= {"f4": "float", "f8": "double"}


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. A property that only faces or only edges have is 0 for the others."""
    data = files[".ply"]
    header = ply_header.parse(data)
    known = {element.name: element for element in header.elements}
    if "tristrips" in known:
        fail(data, known["tristrips"].at, "triangle strips are not supported: turn them into faces first")
    if "vertex" not in known or not {"face", "edge"} & set(known):
        raise FormatError("the header has no element 'vertex', or neither 'face' nor 'edge': the file has no cells")
    if not sum(known[key].count for key in ("face", "edge") if key in known):
        raise FormatError("the file has no faces and no edges: there is nothing to smooth")
    words, found = tables(data, header)
    vertex = found["vertex"]
    axes = [vertex.get(axis) for axis in "xyz"]
    kinds = {(axis.property.kind, axis.sizes is None) for axis in axes if axis is not None}
    if None in axes or kinds not in ({("f4", True)}, {("f8", True)}):
        message = "vertices must have the properties x, y and z, all of type float or all double, and no lists"
        fail(data, known["vertex"].at, message)
    ((kind, _),) = kinds
    points, slots = words.coordinates(side_by_side(*(axis.at for axis in axes if axis is not None)), kind)
    parts = [
        (key, _faces if key == "face" else _edges) for key in known if key in ("face", "edge") and known[key].count
    ]
    codes, sizes, nodes = (
        joined(arrays) for arrays in zip(*(make(words, found[key], len(points)) for key, make in parts), strict=True)
    )
    fields = _fields(words, [found[key] for key, _ in parts], [known[key].count for key, _ in parts])
    regions = regions_of(fields.items(), len(codes))
    cells, cell_data = table_blocks(KINDS, codes, sizes, nodes, regions, fields)
    point_data = {
        key: _values(words, column) for key, column in vertex.items() if key not in "xyz" and column.sizes is None
    }
    return Parsed(points, cells, slots, {}, point_data, cell_data, kind == "f4", _unread(header))


def plan(file: Ranges) -> Plan | None:
    """See ``ply_ranges.plan``."""
    return ply_ranges.plan(file, LISTS)


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``."""
    data, corners, result = files[".ply"], FaceCorners.of(cells), []
    words, found = tables(data, ply_header.parse(data))
    for element, row in (("vertex", corners.node), ("face", corners.face)):
        axes = [found[element][axis] for axis in AXES if axis in found.get(element, {})]
        kinds = {axis.property.kind for axis in axes if axis.sizes is None}
        if len(axes) == 3 and kinds in ({"f4"}, {"f8"}):
            places = side_by_side(*(axis.at for axis in axes))
            result.append(in_words(", ".join(AXES), words, places, kinds.pop(), row))
    return result


def _unread(header: ply_header.Header) -> list[str]:
    """What the file holds besides, in words."""
    read = ("vertex", "face", "edge")
    lists = [f"the list {p.name!r} of each {e.name}" for e in header.elements if e.name in read for p in e.properties
             if p.length and not (e.name == "face" and p.name in LISTS)]  # fmt: skip
    return [f"the element {e.name!r}" for e in header.elements if e.name not in read] + lists


_Cells = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]  # codes, sizes, nodes


def _faces(words: Words, table: Table, count: int) -> _Cells:
    lists = [table[key] for key in LISTS if key in table and table[key].sizes is not None]
    if len(lists) != 1 or lists[0].property.kind[0] == "f":
        raise FormatError("faces must have one list of integers 'vertex_indices'")
    column = lists[0]
    sizes = column.sizes
    assert sizes is not None
    if (short := np.flatnonzero(sizes < 3)).size:
        k = int(short[0])
        words.fail(int(column.heads[k]), f"face {k} (counted from 0) has {sizes[k]} corners")
    nodes = words.values(column.at, column.property.kind)
    check_range(nodes, count, lambda k, message: words.fail(int(column.at[k]), message))
    return np.minimum(sizes, 5), sizes, nodes


def _edges(words: Words, table: Table, count: int) -> _Cells:
    ends = [table.get(key) for key in ("vertex1", "vertex2")]
    columns = [end for end in ends if end is not None and end.sizes is None and end.property.kind[0] != "f"]
    if len(columns) != 2:
        raise FormatError("edges must have the properties vertex1 and vertex2, both integers")
    nodes = np.stack([words.values(column.at, column.property.kind) for column in columns], axis=1).ravel()
    check_range(nodes, count, lambda k, message: words.fail(int(columns[k % 2].at[k // 2]), message))
    rows = len(nodes) // 2
    return np.ones(rows, dtype=np.int64), np.full(rows, 2), nodes


def _values(words: Words, column: Column) -> NDArray[Any]:
    """The numbers of a property, in its type."""
    kind = column.property.kind
    return typed(words.values(column.at, kind, finite=False), kind)


def _fields(words: Words, parts: list[Table], counts: list[int]) -> dict[str, NDArray[Any]]:
    """The data of all cells: property → one number for each row of each table."""
    found: dict[str, list[NDArray[Any]]] = {}
    for k, table in enumerate(parts):
        for key, column in table.items():
            if column.sizes is None and key not in ("vertex1", "vertex2"):
                blank = [np.zeros(count, dtype=column.property.kind) for count in counts]
                found.setdefault(key, blank)[k] = _values(words, column)
    return {key: np.concatenate(arrays) for key, arrays in found.items()}


def write(mesh: Mesh) -> Written:
    """See Format. Text, coordinates in double precision; faces and edges, with the regions as a property."""
    convert.check_kinds(mesh, name, ("vertex", "line", "triangle", "quad", "polygon"))
    if not any(len(block.nodes) for block in mesh.cells if block.cell.dimension > 0):
        raise FormatError("PLY holds faces and edges only, and this mesh has none")
    lost = [*convert.lost_cells(mesh, name, (0,)), *convert.lost_names(mesh, name, (1, 2))]
    lost += convert.lost_data(mesh, name, [*mesh.point_data, *mesh.cell_data])
    points = convert.in_space(mesh)
    columns = _kept(mesh.point_data, "point", ("x", "y", "z"), lost)
    fields = {key: np.concatenate([np.asarray(a) for a in parts]) for key, parts in mesh.cell_data.items() if parts}
    cell_data = _kept(fields, "cell", (*LISTS, "vertex1", "vertex2"), lost)
    regions = np.concatenate([np.empty(0, dtype=np.int64), *(block.regions for block in mesh.cells)])
    if not np.array_equal(regions_of(cell_data.items(), len(regions)), regions):
        cell_data = {key: array for key, array in cell_data.items() if not names_a_region(key)}
        cell_data |= _kept({"region": regions}, "cell", (), lost)
    return Written({".ply": Pieces(lambda: _text(mesh, points, columns, cell_data))}, lost)


_Columns = dict[str, NDArray[Any]]  # property → one number a row


def _text(mesh: Mesh, points: NDArray[np.float64], point_data: _Columns, cell_data: _Columns) -> Iterator[Piece]:
    faces, edges = ([block.nodes for block in mesh.cells if block.dimension == dim] for dim in (2, 1))
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
    head += ["property double x", "property double y", "property double z", *_properties(point_data)]
    length = "uchar" if max((nodes.shape[1] for nodes in faces), default=0) < 256 else "int"
    head += [f"element face {sum(map(len, faces))}", f"property list {length} int vertex_indices"]
    head += _properties(cell_data)
    if any(map(len, edges)):
        head += [f"element edge {sum(map(len, edges))}", "property int vertex1", "property int vertex2"]
        head += _properties(cell_data)
    yield ("\n".join([*head, "end_header"]) + "\n").encode("ascii")
    yield from convert.rows(convert.row_of(3 + len(point_data)), points, *point_data.values())
    ends = np.cumsum([0, *(len(block.nodes) for block in mesh.cells)]).tolist()
    for dim in (2, 1):
        for block, start, end in zip(mesh.cells, ends, ends[1:], strict=False):
            if block.dimension == dim:
                front = b"%d " % block.nodes.shape[1] if dim == 2 else b""
                data = [array[start:end] for array in cell_data.values()]
                yield from convert.rows(front + convert.row_of(block.nodes.shape[1] + len(data)), block.nodes, *data)


def _kept(data: Mapping[str, NDArray[Any]], place: str, taken: tuple[str, ...], lost: list[str]) -> dict[str, Any]:
    """The data that are one number with a name that PLY can write; the others are noted as lost."""
    kept = {}
    for key, values in data.items():
        array = np.asarray(values)
        plain = key.isascii() and key.isprintable() and key and " " not in key and key not in taken
        if not plain or array.dtype.kind not in "iufb" or array.size != len(array):
            lost.append(f"{name} cannot hold {place} data of this kind or name: {key!r} was left out")
            continue
        array = array.reshape(-1)
        if array.dtype.kind in "iub":
            kinds = [kind for kind in ("u1", "i4", "u4") if np.array_equal(array.astype(kind), array)]
            array = array.astype(kinds[0] if kinds else "f8")
        kept[key] = array.astype("f8") if array.dtype not in ("f4", "u1", "i4", "u4") else array
    return kept


def _properties(columns: _Columns) -> list[str]:
    return [f"property {TYPE_NAMES[array.dtype.str[1:]]} {key}" for key, array in columns.items()]
