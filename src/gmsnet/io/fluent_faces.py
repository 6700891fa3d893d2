"""Faces of a Fluent file as cells need them: which cell owns each, and polygons from edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import face_name
from gmsnet.errors import FormatError
from gmsnet.io.cells import distinct
from gmsnet.io.foam_cells import Faces, Ints, Sides, turned
from gmsnet.io.places import ranges
from gmsnet.mesh.cell_block import CellBlock

PARENT = 31  # the type of boundary of a refined cell's whole side
PERIODIC = (8, 12)  # types of boundary: a periodic one, and its image


def outward(sizes: Ints, nodes: Ints, sides: Ints, inner: NDArray[np.bool_]) -> Faces:
    """The faces with those between cells first, each with its normal out of its owner.

    A file lists a face so that its normal points into the first of its cells.
    """
    order = np.concatenate([np.flatnonzero(inner), np.flatnonzero(~inner)])
    length, first = sizes[order], (np.cumsum(sizes) - sizes)[order]
    owner, other = owners(sides[order])
    listed = turned(length, nodes[ranges(first, length)], sides[order, 0] > 0)
    return Faces(length, listed, owner, other[: int(inner.sum())])


def owners(sides: Ints) -> tuple[Ints, Ints]:
    """The owner and the neighbour of faces, counted from 0; −1: there is none. sides: (n, 2) cells from 1 on."""
    one, other = sides[:, 0] - 1, sides[:, 1] - 1
    return np.where(one >= 0, one, other), np.where(one >= 0, other, -1)


def polygons(faces: Faces, sides: Sides, regions: Ints, before: int = 0) -> list[CellBlock]:
    """Cells in the plane, from edges that all run around them in one sense. before: cells of which these are not."""
    edges = faces.points.reshape(-1, 2)[sides.face]
    edges = np.where(sides.out[:, None], edges, edges[:, ::-1])
    number = np.bincount(sides.cell, minlength=len(regions))
    if number.min(initial=3) < 3:
        raise FormatError(f"cell {before + int(np.argmin(number)) + 1} has only {number.min()} faces")
    start = np.cumsum(number) - number
    blocks = []
    for size in distinct(number):
        cells = np.flatnonzero(number == size)
        around = edges[start[cells][:, None] + np.arange(size)]
        nodes = np.empty((len(cells), size), dtype=np.int64)
        nodes[:, 0], here = around[:, 0, 0], around[:, 0, 1]
        for k in range(1, size):
            nodes[:, k] = here
            here = around[np.arange(len(cells)), np.argmax(around[:, :, 0] == here[:, None], axis=1), 1]
        good = (np.sort(nodes, axis=1) == np.sort(around[:, :, 0], axis=1)).all(axis=1) & (here == nodes[:, 0])
        if not good.all():
            cell = before + int(cells[np.argmin(good)]) + 1
            raise FormatError(f"the faces of cell {cell} do not run around it")
        blocks.append(CellBlock(face_name(size), nodes, regions[cells]))
    return blocks
