"""Netgen meshes (``.vol``, ``.vol.gz``). Only the coordinates are written again.

Elements of the mesh's dimension are regions by material, the others markers by boundary condition.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.cells import check_nodes, distinct
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Rows, Text
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "Netgen"
suffixes: tuple[str, ...] = (".vol",)

FACES = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8"}
VOLUMES = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron", 10: "tetra10"}
# Keyword → the column of the region, of the number of nodes (-1: it is 2, -2: it is 1), of the first node; kinds by
# their number of nodes.
ELEMENTS: dict[str, tuple[int, int, int, dict[int, str]]] = {
    "surfaceelements": (1, 4, 5, FACES), "surfaceelementsgi": (1, 4, 5, FACES),
    "surfaceelementsuv": (1, 4, 5, FACES), "volumeelements": (0, 1, 2, VOLUMES),
    "edgesegments": (0, -1, 2, {2: "line"}), "edgesegmentsgi": (0, -1, 2, {2: "line"}),
    "edgesegmentsgi2": (0, -1, 2, {2: "line"}),
    "edgesegmentsgi3": (6, -1, 0, {2: "line"}), "pointelements": (1, -2, 0, {1: "vertex"}),
}  # fmt: skip
NAMES = {"materials": 0, "bcnames": 1, "cd2names": 2, "cd3names": 3}  # how many dimensions below the mesh's
# Where the middles come in another order than in a Mesh, the place in the file of each of a Mesh's nodes.
ORDERS: dict[str, tuple[int, ...]] = {"triangle6": (0, 1, 2, 5, 3, 4), "quad8": (0, 1, 2, 3, 4, 7, 5, 6),
          "tetra10": (0, 1, 2, 3, 4, 7, 5, 6, 8, 9)}  # fmt: skip
FROM_ZERO = "edgesegmentsgi3"  # its regions are counted from 0
COUNTED = ("facedescriptors", "edgedescriptors", "identifications",
           "identificationtypes", "face_colours", "face_transparencies", "singular_points",
           "singular_edge_left", "singular_edge_right", "singular_face_inside", "singular_face_outside")  # fmt: skip


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    text = Text(files[".vol"], b"#")
    head = text.next(0)
    if head is None or text.token(head[0]) != b"mesh3d":
        raise FormatError("line 1: a Netgen mesh begins with mesh3d")
    at, dimension = head[1], 0
    elements = list[tuple[str, Rows]]()
    names = dict[tuple[int, int], str]()
    points: Rows | None = None
    unread, images = list[str](), list[Rows]()
    while (found := text.next(at)) is not None:
        start, at = found
        key = text.token(start).decode("ascii", "replace")
        if key == "endmesh":
            break
        if key in ("dimension", "geomtype"):
            rows = text.rows(at, 1)
            dimension, at = (text.count(rows.starts[0], key) if key == "dimension" else dimension), rows.end
            continue
        if key == "curvedelements":
            text.fail(start, "curved elements are not read: write the mesh without them (Curve(1))")
        if key not in (*ELEMENTS, *NAMES, *COUNTED, "points"):
            text.fail(start, f"unknown keyword {text.word(start)}")
        counted = text.rows(at, 1)
        rows = text.rows(counted.end, text.count(counted.starts[0], key))
        at = rows.end if len(rows) else counted.end
        if key == "points":
            points = rows
        elif key in ELEMENTS:
            elements.append((key, rows))
        elif key == "identifications":
            images.append(rows)
            unread.append(key)
        elif key in NAMES:
            names |= {(dimension - NAMES[key], number): word for number, word in _names(text, rows).items()}
        else:
            unread.append(key)
    if points is None or dimension not in (2, 3):
        raise FormatError("points or dimension are missing: the file is cut off or no Netgen mesh")
    if (points.lengths < 3).any():
        text.fail(points.where(int(np.argmax(points.lengths < 3))), "a point has three coordinates")
    starts = np.ascontiguousarray(points.columns(0, 3))
    coordinates, ends = text.spans(starts)
    cells = [block for key, rows in elements for block in _blocks(text, key, rows, len(coordinates))]
    matching = sorted_unique(np.concatenate([np.empty(0, dtype=np.int64),
                                         *(_identified(text, rows, len(points)) for rows in images)]))  # fmt: skip
    slots = TextSlots(starts, ends)
    return Parsed(coordinates, cells, slots, names, unread=list(dict.fromkeys(unread)), images=matching)


def _identified(text: Text, rows: Rows, count: int) -> NDArray[np.int64]:
    """The nodes of pairs, of which each is the image of the other."""
    if (rows.lengths < 2).any():
        text.fail(rows.where(int(np.argmax(rows.lengths < 2))), "an identification is of two points")
    starts = rows.columns(0, 2)
    nodes: NDArray[np.int64] = text.integers(starts) - 1
    check_nodes(text, starts, nodes, count, base=1)
    return nodes.reshape(-1)


def _names(text: Text, rows: Rows) -> dict[int, str]:
    """Number → name, which may hold blanks."""
    found = {}
    for k in range(len(rows)):
        row = rows.row(k)
        words = [text.token(start).decode("utf-8", "replace") for start in row[1:].tolist()]
        found[int(text.integers(row[:1])[0])] = "".join(c for c in " ".join(words) if c.isprintable())
    return {number: word for number, word in found.items() if word}


def _blocks(text: Text, key: str, rows: Rows, count: int) -> list[CellBlock]:
    """The elements of a section; those of one kind together."""
    region, places, first, kinds = ELEMENTS[key]
    if not len(rows):
        return []
    least = max(region, places, first - 1) + 1
    if (rows.lengths < least).any():
        text.fail(rows.where(int(np.argmax(rows.lengths < least))), f"an entry of {key} has more numbers")
    sizes = text.integers(rows.column(places)) if places >= 0 else np.full(len(rows), 3 + places)
    bad = ~np.isin(sizes, list(kinds)) | (rows.lengths < first + sizes)
    if bad.any():
        k = int(np.argmax(bad))
        text.fail(rows.where(k), f"{key} of {sizes[k]} nodes are not known, or the line is cut off")
    regions = text.integers(rows.column(region)) + (key == FROM_ZERO)
    blocks = []
    for size in distinct(sizes):
        some = np.flatnonzero(sizes == size)
        starts = rows.starts[rows.first[some][:, None] + np.arange(first, first + size)]
        nodes: NDArray[np.int64] = text.integers(starts) - 1
        check_nodes(text, starts, nodes, count, base=1)
        kind = kinds[size]
        nodes = np.ascontiguousarray(nodes[:, ORDERS[kind]]) if kind in ORDERS else nodes
        blocks.append(CellBlock(kind, nodes, regions[some]))
    return blocks


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
