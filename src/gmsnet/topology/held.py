"""Why nodes are held: what is known before the faces are looked at, and each node under its first reason."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import connectivity as marks_of
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.fans import Marks
from gmsnet.topology.polygons import Ints

SMOOTHED = ("triangle", "quad")  # the cell types whose nodes may move
SECOND_ORDER = ("triangle6", "quad8", "quad9")  # whose nodes move in a stage of their own (run/second_order.py)
ON_BOUNDARY, ON_INTERFACE = "boundary", "interface between regions"
OF_LINE, OF_FACE = "node of a line or vertex cell", "node of a face cell"  # of faces in a mesh of volumes
OF_SECOND_ORDER = "node of a second-order cell"
MOST_NEIGHBOURS = 4096  # a hub of more is held: a block of 64 such stars would no longer fit any cache

REASONS = {  # mark → text, in the order in which they count
    marks_of.UNUSED: "not used by any cell",
    marks_of.BOUNDARY: ON_BOUNDARY,
    marks_of.INTERFACE: ON_INTERFACE,
    marks_of.LINE: OF_LINE,
    marks_of.FACE: OF_FACE,
    marks_of.UNSUPPORTED_CELL: "node of a cell that is not smoothed",
    marks_of.NON_MANIFOLD: "non-manifold edge",
    marks_of.NON_ORIENTABLE: "part that cannot be wound consistently",
    marks_of.ZERO_AREA: "part of zero area, which has no positive side",
    marks_of.CHOSEN: "fixed by the user",
    marks_of.NOT_A_DISK: "star is not one closed fan",
    marks_of.HIGH_VALENCE: f"more than {MOST_NEIGHBOURS} neighbours",
    marks_of.SECOND_ORDER: OF_SECOND_ORDER,
}


def reasons_in_space(most: int) -> dict[int, str]:
    """The same of nodes of tetrahedra, of which a free one has at most so many neighbours."""
    return {
        **REASONS,
        marks_of.NON_MANIFOLD: "non-manifold facet",
        marks_of.ZERO_AREA: "part of zero volume, which has no positive side",
        marks_of.MISMATCHED: "facet against others of other nodes",
        marks_of.NOT_A_DISK: "star is not one closed ball",
        marks_of.HIGH_VALENCE: f"more than {most} neighbours",
    }


def known_marks(mesh: Mesh, fixed: NDArray[np.bool_] | None, position: Ints) -> Marks:
    """(N,) by places in memory: LINE, UNSUPPORTED_CELL, and CHOSEN for the nodes ``fixed`` (N,) by id."""
    marks = np.zeros(len(position), dtype=np.uint16)
    for block in mesh.cells:
        if block.kind not in SMOOTHED:
            marks[position[block.nodes.ravel()]] |= np.uint16(_mark_of(mesh, block))
        elif block.kind == "quad":
            marks[position[block.nodes[_collapsed(block.nodes)].ravel()]] |= np.uint16(marks_of.UNSUPPORTED_CELL)
    if fixed is not None and fixed.any():
        marks[position[fixed]] |= np.uint16(marks_of.CHOSEN)
    return marks


def _collapsed(quads: NDArray[np.integer[Any]]) -> NDArray[np.bool_]:
    """(F,) which quads (F, 4) name a corner twice: no place of their nodes makes them valid."""
    a, b, c, d = quads.T
    found: NDArray[np.bool_] = (a == b) | (b == c) | (c == d) | (d == a) | (a == c) | (b == d)
    return found


def _mark_of(mesh: Mesh, block: CellBlock) -> int:
    if block.dimension in (0, 1):
        return marks_of.LINE
    curved = block.kind in SECOND_ORDER and mesh.plane is not None
    return marks_of.SECOND_ORDER if curved else marks_of.UNSUPPORTED_CELL


ON_CURVE = marks_of.BOUNDARY | marks_of.INTERFACE | marks_of.LINE  # what does not hold a node that slides
AT_BOUNDARY = marks_of.BOUNDARY | marks_of.LINE | marks_of.FACE  # the same in space, where interfaces stay


def released(
    marks: Marks, sliding: NDArray[np.bool_], position: Ints, where: int = ON_CURVE,
    texts: Mapping[int, str] = REASONS,
) -> tuple[NDArray[np.bool_], dict[str, NDArray[np.int64]]]:  # fmt: skip
    """Of some nodes (N, by places in memory), those held for these marks alone (``where``); they lose their marks.

    And the reasons that they were held for, as in ``sorted_out``.
    """
    bits = np.uint16(where)
    freed: NDArray[np.bool_] = sliding & (marks & bits != 0) & (marks & ~bits == 0)
    reasons, _, _ = sorted_out(np.where(freed, marks, np.uint16(0)), position, texts)
    marks[freed] = 0
    return freed, reasons


def sorted_out(
    marks: Marks, position: Ints, reasons: Mapping[int, str] = REASONS
) -> tuple[dict[str, NDArray[np.int64]], Ints, Ints]:
    """Reason → ids, each node under the first that applies to it; the ids of the free nodes, and their places."""
    by_id = marks.take(position)
    first = by_id & (~by_id + np.uint16(1))
    found = int(np.bitwise_or.reduce(first))
    held = {text: np.flatnonzero(first == mark) for mark, text in reasons.items() if found & mark}
    free = np.flatnonzero(first == 0).astype(np.int32)
    return held, free, position.take(free)
