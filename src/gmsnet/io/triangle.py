"""The pair of files of Shewchuk's Triangle and of TetGen: ``.node`` holds the points, ``.ele`` the cells.

Points of two coordinates have triangles, those of three have tetrahedra. Points are numbered from 0 or from 1, as the
first of them says. The first attribute of a cell is its region. Other files beside the two (``.face``, ``.edge``) name
nodes by their numbers, so they fit the result as they are, and are not read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.cells import counted, distinct, first_repeated, places_of, sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Rows, Text
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "Triangle"
suffixes: tuple[str, ...] = (".node", ".ele")

MARKER = "triangle:marker"  # the point data that keeps the boundary markers
ATTRIBUTE = "triangle:attribute"  # + its number: further attributes of points and triangles
MOST_ATTRIBUTES = 1000  # each is an array of its own

# Triangle puts the node on the side opposite corner k into place 3 + k; the order elsewhere is by side 01, 12, 20.
# TetGen has the edges 23, 03, 01, 12, 13, 02 in places 4 to 9; the order elsewhere is 01, 12, 02, 03, 13, 23.
ORDER = {"triangle6": [0, 1, 2, 5, 3, 4], "tetra10": [0, 1, 2, 3, 6, 7, 9, 5, 8, 4]}
KINDS = {2: {3: "triangle", 6: "triangle6"}, 3: {4: "tetra", 10: "tetra10"}}  # dimension → nodes → kind
TITLES = {2: name, 3: "TetGen"}
MARKED: dict[int, tuple[str, ...]] = {
    2: ("line", "line3", "vertex"),
    3: ("triangle", "triangle6", "line", "line3", "vertex"),
}


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Points with a boundary marker other than 0 become vertex cells with the marker as region."""
    points, ids, slots, data = _points(Text(files[".node"], b"#"))
    try:
        cells, names, cell_data = _cells(Text(files[".ele"], b"#"), ids, points.shape[1])
    except FormatError as error:
        raise FormatError(f"in the .ele file beside it: {error}") from None
    markers = data.get(MARKER)
    if markers is not None and markers.any():
        marked = np.flatnonzero(markers)
        cells.append(CellBlock("vertex", marked[:, None], markers[marked]))
        empty = np.zeros(len(marked))
        cell_data = {key: (*arrays, empty) for key, arrays in cell_data.items()}
    known = counted(ids, 0) or counted(ids, 1)
    unread = [] if known else ["the numbers of nodes, which begin elsewhere, have gaps or another order"]
    return Parsed(points, cells, slots, names, data, cell_data, unread=unread)


def _header(text: Text, words: int, what: str) -> tuple[NDArray[np.int64], Rows]:
    """The numbers of the first line, and the rows of which it announces how many there are; no others may follow."""
    head = text.rows(0, 1)
    if len(head.starts) < words:
        text.fail(head.where(0), f"the first line must have {words} numbers, found {len(head.starts)}")
    numbers = text.integers(head.starts[:words])
    for start in head.starts[:words]:
        text.count(start, what)
    rows = text.rows(head.end, int(numbers[0]))
    rest = text.rows(rows.end if len(rows) else head.end)
    if len(rest):
        text.fail(rest.where(0), f"the file goes on behind the {numbers[0]} {what} that its first line announces")
    return numbers, rows


def _width(text: Text, rows: Rows, width: int, what: str) -> None:
    short = np.flatnonzero(rows.lengths < width)
    if short.size:
        k = int(short[0])
        text.fail(rows.where(k), f"{what} takes {width} numbers here, found {rows.lengths[k]}")


def _few(text: Text, attributes: int) -> int:
    if attributes > MOST_ATTRIBUTES:
        text.fail(0, f"{attributes} attributes: more than {MOST_ATTRIBUTES} are not read")
    return attributes


def _points(text: Text) -> tuple[NDArray[np.float64], NDArray[np.int64], TextSlots, dict[str, NDArray[Any]]]:
    """Coordinates, numbers of the points, slots of the coordinates, point data."""
    (_, dimension, attributes, markers), rows = _header(text, 4, "points")
    if dimension not in KINDS:
        text.fail(0, f"the points have {dimension} coordinates: there can be 2 (Triangle) or 3 (TetGen)")
    width = int(dimension)
    if markers > 1:
        text.fail(0, f"{markers} boundary markers a point: there can be 0 or 1")
    _width(text, rows, 1 + width + int(attributes) + int(markers), "a point")
    attributes = _few(text, attributes) if len(rows) else 0  # nothing bounds it then
    ids = text.integers(rows.column(0))
    if (twice := first_repeated(ids)) >= 0:
        text.fail(rows.where(twice), f"the point {ids[twice]} is given twice")
    data: dict[str, NDArray[Any]] = {
        f"{ATTRIBUTE}{k + 1}": text.floats(rows.column(1 + width + k)) for k in range(int(attributes))
    }
    if markers:
        data[MARKER] = text.integers(rows.column(1 + width + int(attributes)))
    points, ends = text.spans(starts := rows.columns(1, width))
    return points, ids, TextSlots(starts, ends), data


def _cells(
    text: Text, ids: NDArray[np.int64], dimension: int
) -> tuple[list[CellBlock], dict[tuple[int, int], str], dict[str, tuple[NDArray[Any], ...]]]:
    (_, size, attributes), rows = _header(text, 3, "cells")
    cell = KINDS[dimension][min(KINDS[dimension])].replace("tetra", "tetrahedron")
    if size not in KINDS[dimension]:
        known = " or ".join(map(str, KINDS[dimension]))
        points = f"a .node file of {dimension} coordinates"
        text.fail(0, f"the cells have {size} nodes: beside {points} there can be {known}")
    _width(text, rows, 1 + int(size) + int(attributes), f"a {cell}")
    attributes = _few(text, attributes) if len(rows) else 0  # nothing bounds it then
    text.integers(rows.column(0))
    starts = rows.columns(1, int(size))
    named = text.integers(starts)
    place, bad = places_of(ids, named.reshape(-1))
    if bad >= 0:
        known = f"{ids.min()} to {ids.max()}" if len(ids) else "none"
        where, found = int(starts.reshape(-1)[bad]), named.reshape(-1)[bad]
        text.fail(where, f"a {cell} names the node {found}, but the nodes are {known}")
    nodes = place.reshape(named.shape)
    values = [text.floats(rows.column(1 + int(size) + k)) for k in range(int(attributes))]
    regions, names = _regions(values[0], dimension) if values else (np.zeros(len(rows), dtype=np.int64), {})
    kind = KINDS[dimension][int(size)]
    nodes = nodes[:, ORDER[kind]] if kind in ORDER else nodes
    block = CellBlock(kind, sealed(nodes), sealed(regions))
    cell_data: dict[str, tuple[NDArray[Any], ...]] = {}
    for k, column in enumerate(values[1:], 2):
        cell_data[f"{ATTRIBUTE}{k}"] = (column,)
    return [block], names, cell_data


def _regions(values: NDArray[np.float64], dimension: int) -> tuple[NDArray[np.int64], dict[tuple[int, int], str]]:
    """Whole numbers are regions as they are; if there are others, regions count from 1 and have them as names."""
    if (np.abs(values) < 2.0**53).all() and (values == np.rint(values)).all():
        return values.astype(np.int64), {}
    known, regions = np.unique(values, return_inverse=True)
    return regions.reshape(-1) + 1, {(dimension, k + 1): repr(value) for k, value in enumerate(known.tolist())}


def write(mesh: Mesh) -> Written:
    """See Format. Cells of fewer dimensions than the mesh live on as boundary markers of their nodes."""
    dimension = 3 if mesh.has_volumes else 2
    title = TITLES[dimension]
    convert.check_kinds(mesh, title, (*KINDS[dimension].values(), *MARKED[dimension]))
    blocks = [block for block in mesh.cells if block.dimension == dimension and len(block.nodes)]
    if len(kinds := {block.kind for block in blocks}) > 1:
        raise FormatError(f"{title} cannot hold {' and '.join(sorted(kinds))} cells in one file: write .vtu or .msh")
    points, lost = (convert.in_space(mesh), []) if mesh.has_volumes else convert.in_plane(mesh, title)
    markers, words = _markers(mesh, dimension)
    kind = blocks[0].kind if blocks else KINDS[dimension][min(KINDS[dimension])]
    nodes = np.concatenate([b.nodes for b in blocks] or [np.empty((0, min(KINDS[dimension])), int)])
    nodes = nodes[:, np.argsort(ORDER[kind])] if kind in ORDER else nodes
    regions = np.concatenate([b.regions for b in blocks] or [np.empty(0, int)])

    def points_text() -> Iterator[Piece]:
        yield b"%d %d 0 1\n" % points.shape
        yield from convert.rows(convert.row_of(dimension + 2), np.arange(1, len(points) + 1), points, markers)

    def cells_text() -> Iterator[Piece]:
        yield b"%d %d 1\n" % nodes.shape
        template = convert.row_of(nodes.shape[1] + 2)
        yield from convert.rows(template, np.arange(1, len(nodes) + 1), nodes + 1, regions)

    lost = lost + words + convert.lost_names(mesh, title, (dimension,))
    lost += convert.lost_data(mesh, title, kept=(MARKER,), regions=True)
    return Written({".node": Pieces(points_text), ".ele": Pieces(cells_text)}, lost)


def _markers(mesh: Mesh, dimension: int) -> tuple[NDArray[np.int64], list[str]]:
    """A boundary marker for each point, and what of the cells of fewer dimensions is lost thereby."""
    markers = np.zeros(len(mesh.points), dtype=np.int64)
    used = sorted(
        {(b.cell.dimension, r) for b in mesh.cells if b.cell.dimension < dimension for r in distinct(b.regions)}
    )
    plain = len({r for _, r in used}) == len(used) and all(r != 0 for _, r in used)
    number = {pair: pair[1] if plain else k for k, pair in enumerate(used, 1)}
    several = np.zeros(len(markers), dtype=bool)
    for block in mesh.cells:
        if block.cell.dimension < dimension:
            for region in distinct(block.regions):
                nodes = block.nodes[block.regions == region]
                several[nodes] |= ~np.isin(markers[nodes], (0, number[block.cell.dimension, region]))
                markers[nodes] = number[block.cell.dimension, region]
    title, lost = TITLES[dimension], []
    for of, word in ((2, "surface"), (1, "line")):
        count = sum(len(block.nodes) for block in mesh.cells if block.dimension == of < dimension)
        if count:
            told = convert.listed([str(k) for (dim, _), k in number.items() if dim == of])
            turned = f"{count} {convert.were(count)} turned into markers of their nodes ({told})"
            lost.append(f"{title} cannot hold {word} cells: {turned}")
    if count := int(np.count_nonzero(several)):
        lost.append(f"{title} cannot hold several markers of a node: of those of {count} one each was kept")
    named = [f"{mesh.region_names[pair]!r} ({k})" for pair, k in number.items() if pair in mesh.region_names]
    if named:
        lost.append(f"{title} numbers its markers: {convert.left_out('name', named)}")
    return markers, lost
