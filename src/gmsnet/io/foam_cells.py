"""Cells from their faces: tetrahedra, pyramids, wedges and hexahedra are known; others are polyhedra.

A face is listed as its owner sees it from inside: its normal points out of the owner, into the neighbour.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import face_name
from gmsnet.io.places import ranges
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock

Ints = NDArray[np.int64]


class Faces(NamedTuple):
    """sizes: (F,) how many points each face has; points: of all, one after another; owner: (F,); neighbour: (I,) of the
    first faces, −1 where there is none."""

    sizes: Ints
    points: Ints
    owner: Ints
    neighbour: Ints

    @property
    def starts(self) -> Ints:
        """(F,) where the points of each face begin."""
        found: Ints = np.cumsum(self.sizes) - self.sizes
        return found

    def points_of(self, chosen: Ints) -> Ints:
        """(n,) the points of some faces, each once."""
        found: Ints = sorted_unique(self.points[ranges(self.starts[chosen], self.sizes[chosen])])
        return found

    def corners(self, chosen: Ints, size: int) -> Ints:
        """(n, size) the points of faces that all have so many."""
        found: Ints = self.points[self.starts[chosen][:, None] + np.arange(size)]
        return found


class Sides(NamedTuple):
    """The faces of all cells, cell by cell. cell, face: (S,); out: (S,) whether the normal points out of the cell."""

    cell: Ints
    face: Ints
    out: NDArray[np.bool_]

    @classmethod
    def of(cls, faces: Faces, first: int, last: int) -> Sides:
        """The owners' faces and the neighbours' of the cells from one to another, which are numbered from 0."""
        face = np.concatenate([np.arange(len(faces.owner)), np.arange(len(faces.neighbour))])
        cell = np.concatenate([faces.owner, faces.neighbour]) - first
        here = np.flatnonzero((cell >= 0) & (cell < last - first))
        order = here[np.argsort(cell[here], kind="stable")]
        return cls(cell[order], face[order], order < len(faces.owner))


# Kind → how many triangles and quads it has, and its base.
SHAPES = {"tetra": (4, 0, 3), "pyramid": (4, 1, 4), "wedge": (2, 3, 3), "hexahedron": (0, 6, 4)}
CORNERS = {"tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}


def volumes(faces: Faces, sides: Sides, regions: Ints) -> list[CellBlock]:
    """The cells by kind: those of one kind together, polyhedra by how many points they have. regions: of each cell."""
    size, count = faces.sizes[sides.face], len(regions)
    triangles, quads, all_faces = (np.bincount(sides.cell, chosen, count).astype(np.int64) for chosen in (
        size == 3, size == 4, np.ones(len(size))))  # fmt: skip
    blocks, left = [], np.ones(count, dtype=bool)
    for kind, (threes, fours, base) in SHAPES.items():
        cells = np.flatnonzero((triangles == threes) & (quads == fours) & (all_faces == threes + fours))
        nodes = _nodes(faces, sides, cells, kind, base)
        order = np.sort(nodes, axis=1)
        good = (nodes >= 0).all(axis=1) & (order[:, 1:] != order[:, :-1]).all(axis=1)
        left[cells[good]] = False
        if good.any():
            blocks.append(CellBlock(kind, nodes[good], regions[cells[good]]))
    return blocks + _polyhedra(faces, sides, np.flatnonzero(left), regions)


def _nodes(faces: Faces, sides: Sides, cells: Ints, kind: str, base: int) -> Ints:
    """(n, corners) the corners of cells in the order of Mesh; −1 for what is not found."""
    first = np.searchsorted(sides.cell, cells)
    count = sum(SHAPES[kind][:2])
    at = first[:, None] + np.arange(count)
    face, size = sides.face[at], faces.sizes[sides.face[at]]
    place = np.argmax(size == base, axis=1)
    rows = np.arange(len(cells))
    bottom = faces.corners(face[rows, place], base)
    bottom = np.where(
        sides.out[at[rows, place]][:, None], bottom[:, [0, *range(base - 1, 0, -1)]], bottom
    )  # seen from inside
    if kind in ("tetra", "pyramid"):
        inside = np.zeros(len(cells), dtype=np.int64)
        np.add.at(
            inside, np.repeat(rows, size.sum(axis=1)), faces.points[ranges(faces.starts[face.ravel()], size.ravel())]
        )
        apex, odd = np.divmod(inside - 3 * bottom.sum(axis=1), 3 if kind == "tetra" else 4)
        apex[(odd != 0) | (apex < 0) | (apex > faces.points.max(initial=0))] = -1
        nodes = np.column_stack([bottom, apex])
        return _checked(faces, face, size, nodes)
    tops = np.full((len(cells), base), -1, dtype=np.int64)
    for k in range(count):
        quad = size[:, k] == 4
        quad &= place != k
        some = np.flatnonzero(quad)
        corners = faces.corners(face[some, k], 4)
        for j in range(base):
            for turn in range(4):
                here = corners[:, turn] == bottom[some, j]
                for other in (corners[:, (turn + 1) % 4], corners[:, (turn + 3) % 4]):
                    up = here & (other[:, None] != bottom[some]).all(axis=1)
                    tops[some[up], j] = other[up]
    return _checked(faces, face, size, np.column_stack([bottom, tops]))


def _checked(faces: Faces, face: Ints, size: Ints, nodes: Ints) -> Ints:
    """The nodes, −1 in those cells that have a face with a point which is none of them."""
    if not len(nodes):
        return nodes
    points = faces.points[ranges(faces.starts[face.ravel()], size.ravel())]
    rows = np.repeat(np.arange(len(nodes)), size.sum(axis=1))
    known = np.zeros(len(points), dtype=bool)
    for column in nodes.T:
        known |= points == column[rows]
    nodes[np.bincount(rows, ~known, len(nodes)) > 0] = -1
    return nodes


def turned(sizes: Ints, points: Ints, which: NDArray[np.bool_]) -> Ints:
    """The points of faces, one face after another, those of some faces in the other order."""
    rank = ranges(np.zeros(len(sizes), dtype=np.int64), sizes)
    first, last = (np.repeat(each, sizes) for each in (np.cumsum(sizes) - sizes, np.cumsum(sizes) - 1))
    found: Ints = points[np.where(np.repeat(which, sizes), last - rank, first + rank)]
    return found


def walls(sizes: Ints, points: Ints, markers: Ints) -> list[CellBlock]:
    """Faces as cells, those of one marker and one size together, in ascending order of both. markers: (F,)."""
    order, starts = np.lexsort((sizes, markers)), np.cumsum(sizes) - sizes
    keys = np.column_stack([markers, sizes])[order]
    cuts = 1 + np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1))
    blocks = []
    for some in np.split(order, cuts) if len(order) else ():
        size = int(sizes[some[0]])
        table = points[starts[some][:, None] + np.arange(size)]
        blocks.append(CellBlock("line" if size == 2 else face_name(size), table, markers[some]))
    return blocks


def _polyhedra(faces: Faces, sides: Sides, cells: Ints, regions: Ints) -> list[CellBlock]:
    """The other cells, each with all its points once."""
    chosen = np.isin(sides.cell, cells)
    face = sides.face[chosen]
    cell = np.repeat(sides.cell[chosen], faces.sizes[face])
    pairs = np.unique(np.stack([cell, faces.points[ranges(faces.starts[face], faces.sizes[face])]], axis=1), axis=0)
    counts = np.bincount(pairs[:, 0], minlength=len(regions))
    blocks = []
    for size in np.unique(counts[counts > 0]).tolist():
        some = counts[pairs[:, 0]] == size
        of = pairs[some, 0].reshape(-1, size)[:, 0]
        blocks.append(CellBlock("polyhedron", pairs[some, 1].reshape(-1, size), regions[of]))
    return blocks
