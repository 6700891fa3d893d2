"""The pair of files of Shewchuk's Triangle: ``.node`` holds the points, ``.ele`` the triangles.

Points are numbered from 0 or from 1, as the first of them says. The first attribute of a triangle is its region.
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
suffixes = (".node", ".ele")

MARKER = "triangle:marker"  # the point data that keeps the boundary markers
ATTRIBUTE = "triangle:attribute"  # + its number: further attributes of points and triangles
MOST_ATTRIBUTES = 1000  # each is an array of its own

# Triangle puts the node on the side opposite corner k into place 3 + k; the order elsewhere is by side 01, 12, 20.
TO_SIDES, FROM_SIDES = [0, 1, 2, 5, 3, 4], [0, 1, 2, 4, 5, 3]


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format. Points with a boundary marker other than 0 become vertex cells with the marker as region."""
    points, ids, slots, data = _points(Text(files[".node"], b"#"))
    try:
        cells, names, cell_data = _triangles(Text(files[".ele"], b"#"), ids)
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
    if dimension != 2:
        text.fail(0, f"the points have {dimension} coordinates: only meshes in the plane (2) can be read")
    if markers > 1:
        text.fail(0, f"{markers} boundary markers a point: there can be 0 or 1")
    _width(text, rows, 3 + int(attributes) + int(markers), "a point")
    attributes = _few(text, attributes) if len(rows) else 0  # nothing bounds it then
    ids = text.integers(rows.column(0))
    if (twice := first_repeated(ids)) >= 0:
        text.fail(rows.where(twice), f"the point {ids[twice]} is given twice")
    data: dict[str, NDArray[Any]] = {
        f"{ATTRIBUTE}{k + 1}": text.floats(rows.column(3 + k)) for k in range(int(attributes))
    }
    if markers:
        data[MARKER] = text.integers(rows.column(3 + int(attributes)))
    points, ends = text.spans(starts := rows.columns(1, 2))
    return points, ids, TextSlots(starts, ends), data


def _triangles(
    text: Text, ids: NDArray[np.int64]
) -> tuple[list[CellBlock], dict[tuple[int, int], str], dict[str, tuple[NDArray[Any], ...]]]:
    (_, size, attributes), rows = _header(text, 3, "triangles")
    if size not in (3, 6):
        text.fail(0, f"triangles with {size} nodes: there can be 3 or 6")
    _width(text, rows, 1 + int(size) + int(attributes), "a triangle")
    attributes = _few(text, attributes) if len(rows) else 0  # nothing bounds it then
    text.integers(rows.column(0))
    starts = rows.columns(1, int(size))
    named = text.integers(starts)
    place, bad = places_of(ids, named.reshape(-1))
    if bad >= 0:
        known = f"{ids.min()} to {ids.max()}" if len(ids) else "none"
        where, found = int(starts.reshape(-1)[bad]), named.reshape(-1)[bad]
        text.fail(where, f"a triangle names the node {found}, but the nodes are {known}")
    nodes = place.reshape(named.shape)
    values = [text.floats(rows.column(1 + int(size) + k)) for k in range(int(attributes))]
    regions, names = _regions(values[0]) if values else (np.zeros(len(rows), dtype=np.int64), {})
    kind, nodes = ("triangle", nodes) if size == 3 else ("triangle6", nodes[:, TO_SIDES])
    block = CellBlock(kind, sealed(nodes), sealed(regions))
    cell_data: dict[str, tuple[NDArray[Any], ...]] = {}
    for k, column in enumerate(values[1:], 2):
        cell_data[f"{ATTRIBUTE}{k}"] = (column,)
    return [block], names, cell_data


def _regions(values: NDArray[np.float64]) -> tuple[NDArray[np.int64], dict[tuple[int, int], str]]:
    """Whole numbers are regions as they are; if there are others, regions count from 1 and have them as names."""
    if (np.abs(values) < 2.0**53).all() and (values == np.rint(values)).all():
        return values.astype(np.int64), {}
    known, regions = np.unique(values, return_inverse=True)
    return regions.reshape(-1) + 1, {(2, k + 1): repr(value) for k, value in enumerate(known.tolist())}


def write(mesh: Mesh) -> Written:
    """See Format. Lines and vertices live on as boundary markers of their nodes."""
    convert.check_kinds(mesh, name, ("triangle", "triangle6", "line", "line3", "vertex"))
    faces = [block for block in mesh.cells if block.dimension == 2 and len(block.nodes)]
    if len({block.kind for block in faces}) > 1:
        raise FormatError("Triangle cannot hold three-node and six-node triangles in one file: write .vtu or .msh")
    points, lost = convert.in_plane(mesh, name)
    markers, words = _markers(mesh)
    quadratic = bool(faces) and faces[0].kind == "triangle6"
    nodes = np.concatenate([b.nodes[:, FROM_SIDES] if quadratic else b.nodes for b in faces] or [np.empty((0, 3), int)])
    regions = np.concatenate([b.regions for b in faces] or [np.empty(0, int)])

    def points_text() -> Iterator[Piece]:
        yield b"%d 2 0 1\n" % len(points)
        yield from convert.rows(b"% % % %\n", np.arange(1, len(points) + 1), points, markers)

    def cells_text() -> Iterator[Piece]:
        yield b"%d %d 1\n" % nodes.shape
        template = convert.row_of(nodes.shape[1] + 2)
        yield from convert.rows(template, np.arange(1, len(nodes) + 1), nodes + 1, regions)

    lost += words + convert.lost_names(mesh, name, (2,)) + convert.lost_data(mesh, name, kept=(MARKER,), regions=True)
    return Written({".node": Pieces(points_text), ".ele": Pieces(cells_text)}, lost)


def _markers(mesh: Mesh) -> tuple[NDArray[np.int64], list[str]]:
    """A boundary marker for each point, and what of the line and vertex cells is lost thereby."""
    markers = np.zeros(len(mesh.points), dtype=np.int64)
    used = sorted({(b.cell.dimension, r) for b in mesh.cells if b.cell.dimension < 2 for r in distinct(b.regions)})
    plain = len({r for _, r in used}) == len(used) and all(r != 0 for _, r in used)
    number = {pair: pair[1] if plain else k for k, pair in enumerate(used, 1)}
    lines = sum(len(block.nodes) for block in mesh.cells if block.dimension == 1)
    several = np.zeros(len(markers), dtype=bool)
    for block in mesh.cells:
        if block.cell.dimension < 2:
            for region in distinct(block.regions):
                nodes = block.nodes[block.regions == region]
                several[nodes] |= ~np.isin(markers[nodes], (0, number[block.cell.dimension, region]))
                markers[nodes] = number[block.cell.dimension, region]
    lost = []
    if lines:
        told = convert.listed([str(k) for (dim, _), k in number.items() if dim == 1])
        turned = f"{lines} {convert.were(lines)} turned into markers of their nodes ({told})"
        lost.append(f"{name} cannot hold line cells: {turned}")
    if count := int(np.count_nonzero(several)):
        lost.append(f"{name} cannot hold several markers of a node: of those of {count} one each was kept")
    named = [f"{mesh.region_names[pair]!r} ({k})" for pair, k in number.items() if pair in mesh.region_names]
    if named:
        lost.append(f"{name} numbers its markers: {convert.left_out('name', named)}")
    return markers, lost
