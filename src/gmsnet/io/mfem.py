"""MFEM meshes (``.mesh``, v1.0 to v1.3) with straight cells. Only the coordinates are written again.

Attributes of elements are regions, those of the boundary are markers.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io.cells import check_nodes, distinct
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Starts, Text
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "MFEM"
suffixes: tuple[str, ...] = (".mesh",)

KINDS = {0: "vertex", 1: "line", 2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron", 6: "wedge", 7: "pyramid"}


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    text = Text(files[".mesh"], b"#")
    first, at = text.tokens(0, 3)
    if [text.token(start) for start in first.tolist()[:2]] != [b"MFEM", b"mesh"]:
        raise FormatError("line 1: an MFEM mesh begins with MFEM mesh v1.0")
    cells, seen, unread = list[CellBlock](), set[str](), list[str]()
    nodes = list[tuple[Starts, NDArray[np.int64]]]()
    points: NDArray[np.float64] | None = None
    starts = ends = np.empty((0, 0), dtype=np.int32)
    while (found := text.next(at)) is not None:
        start, at = found
        key = text.token(start).decode("ascii", "replace")
        if key == "mfem_mesh_end":
            break
        if key in seen:
            text.fail(start, f"{key[:24]!r} is given twice")
        seen.add(key)
        if key == "dimension":
            at = text.tokens(at, 1)[1]
        elif key in ("elements", "boundary"):
            blocks, at = _blocks(text, at, key, nodes)
            cells += blocks
        elif key in ("attribute_sets", "bdr_attribute_sets"):
            rows = text.rows(at, 1)
            rows = text.rows(rows.end, text.count(rows.starts[0], key))
            at = rows.end
            unread.append("attribute sets")
        elif key == "vertices":
            counts, at = text.tokens(at, 1)
            count, following = text.count(counts[0], key), text.next(at)
            if following is None or text.token(following[0]) == b"nodes":
                text.fail(start, "nodes of a curved mesh are not read: write the mesh with straight cells, as vertices")
            sizes, at = text.tokens(at, 1)
            width = text.count(sizes[0], "coordinates of a vertex")
            if width not in (2, 3):
                text.fail(int(sizes[0]), f"a vertex has {width} coordinates: 2 or 3 are read")
            taken, at = text.tokens(at, count * width)
            starts = np.ascontiguousarray(taken.reshape(-1, width))
            points, ends = text.spans(starts)
        else:
            text.fail(start, f"unknown keyword {text.word(start)}, or a part that is not read")
    if points is None or "elements" not in seen:
        raise FormatError("elements or vertices are missing: the file is cut off or no MFEM mesh")
    for where, table in nodes:
        check_nodes(text, where, table, len(points))
    return Parsed(points, cells, TextSlots(starts, ends), unread=list(dict.fromkeys(unread)))


def _blocks(
    text: Text, at: int, key: str, tables: list[tuple[Starts, NDArray[np.int64]]]
) -> tuple[list[CellBlock], int]:
    """The cells of a section, those of one kind together, and the byte behind; their nodes go to ``tables`` as well."""
    counts, at = text.tokens(at, 1)
    rows = text.rows(at, text.count(counts[0], key))
    if not len(rows):
        return [], at
    if (rows.lengths < 3).any():
        text.fail(rows.where(int(np.argmax(rows.lengths < 3))), f"an entry of {key} has an attribute, a type and nodes")
    head = text.integers(rows.columns(0, 2))
    blocks = []
    for code in distinct(head[:, 1]):
        some = np.flatnonzero(head[:, 1] == code)
        if code not in KINDS:
            text.fail(rows.where(int(some[0])), f"cells of the type {code} are not known")
        width = nodes_of(KINDS[code])
        wrong = some[rows.lengths[some] != 2 + width]
        if len(wrong):
            text.fail(rows.where(int(wrong[0])), f"a {KINDS[code]} has {width} nodes")
        starts = rows.starts[rows.first[some][:, None] + np.arange(2, 2 + width)]
        nodes = text.integers(starts)
        tables.append((starts, nodes))
        blocks.append(CellBlock(KINDS[code], nodes, head[some, 0]))
    return blocks, rows.end


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
