"""The two-dimensional cells of a mesh as polygons (their corners), numbered so that near faces are near in memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.topology import layout
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Ints = NDArray[np.int32]
Offsets = NDArray[np.int32 | np.int64]  # where the rows of CSR arrays begin

MOST = 2**31 - 1  # nodes, and faces: they are numbered by int32
NARROW = 2**31 - 1  # corners: up to so many, CSR arrays begin at int32, else at int64


def offset_type(corners: int) -> type[np.int32 | np.int64]:
    """The type of numbers that count so many corners."""
    return np.int32 if corners <= NARROW else np.int64


@dataclass(frozen=True, eq=False)
class Faces:
    """Polygons in CSR form: face f has the corners corner[first[f] : first[f + 1]].

    first: None where all are triangles. corner: (C,) nodes. region: (F,) int64, or none (0,) where all are the same.
    cell: (F,) int64, in the order of the file, the index of each among all cells of the mesh.
    """

    first: Offsets | None
    corner: Ints
    region: NDArray[np.int64]
    cell: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.cell)

    @classmethod
    def of(cls, mesh: Mesh) -> Faces:
        """The faces in the order of the file, by node ids."""
        blocks, cells, before = list[CellBlock](), [], 0
        for block in mesh.cells:
            if block.dimension == 2 and block.nodes.size:
                blocks.append(block)
                cells.append(np.arange(before, before + len(block.nodes)))
            before += len(block.nodes)
        return cls(
            first=_first(blocks, mesh.has_quads),
            corner=_joined([block.nodes[:, : block.corners].reshape(-1) for block in blocks], np.int32),
            region=_joined([block.regions for block in blocks] if _differ(blocks) else [], np.int64),
            cell=cells[0] if len(cells) == 1 else _joined(cells, np.int64),
        )

    def renumbered(self, position: Ints) -> NearFaces:
        """The faces by the places of their nodes in memory (N,), in the order of their first node there."""
        place, origin = np.empty_like(self.corner), np.empty(len(self), dtype=np.int32)
        begin = np.zeros(len(position) + 2, dtype=np.int32)
        layout.order_faces(self.first, self.corner, position, begin, place, origin)
        first = None if self.first is None else _starts(np.diff(self.first)[origin])
        corner = np.empty_like(place)
        layout.take_faces(self.first, place, origin, first, corner)
        region = self.region.take(origin) if len(self.region) else self.region
        return NearFaces(first, corner, region, self.cell, origin, begin[:-1])

    def with_corners(self, count: int) -> tuple[Ints | slice, Ints]:
        """The faces with so many corners: which, and their corners (F, count)."""
        if self.first is None and count == 3:
            return slice(None), self.corner.reshape(-1, 3)
        if self.first is None:
            return np.empty(0, dtype=np.int32), np.empty((0, count), dtype=np.int32)
        chosen = np.flatnonzero(np.diff(self.first) == count).astype(np.int32)
        return chosen, self.corner[self.first[chosen][:, None] + np.arange(count)]

    @property
    def face(self) -> Ints | None:
        """(C,) the face of each corner; None where all are triangles."""
        if self.first is None:
            return None
        return np.repeat(np.arange(len(self), dtype=np.int32), np.diff(self.first))


@dataclass(frozen=True, eq=False)
class NearFaces(Faces):
    """Faces by the places of their nodes in memory, in the order of their first node there.

    origin: (F,) the place of each in the order of the file. begin: (N + 1,), the faces whose first node is v are
    begin[v] … begin[v + 1] − 1.
    """

    origin: Ints
    begin: Ints


def check_size(mesh: Mesh) -> int:
    """How many corners the faces of a mesh have. Raises InputError for more nodes or faces than int32 can number."""
    blocks = [block for block in mesh.cells if block.dimension == 2]
    for count, what in ((len(mesh.points), "nodes"), (sum(len(block.nodes) for block in blocks), "cells")):
        if count > MOST:
            raise InputError(f"the mesh has {count:,} {what}: gmsnet can number at most {MOST:,}")
    return sum(len(block.nodes) * block.corners for block in blocks)


def _first(blocks: list[CellBlock], has_quads: bool) -> Offsets | None:
    """None where all are triangles, elsewhere in the mesh, too."""
    if not has_quads and all(block.corners == 3 for block in blocks):
        return None
    return _starts(np.repeat([block.corners for block in blocks], [len(block.nodes) for block in blocks]).astype(int))


def _starts(sizes: NDArray[Any]) -> Offsets:
    first = np.zeros(len(sizes) + 1, dtype=np.int64)
    np.cumsum(sizes, out=first[1:])
    return first.astype(offset_type(int(first[-1])), copy=False)


def _differ(blocks: list[CellBlock]) -> bool:
    """Do two of the faces lie in different regions?"""
    return bool(blocks) and not all((block.regions == blocks[0].regions[0]).all() for block in blocks)


def _joined(arrays: list[NDArray[Any]], dtype: type) -> NDArray[Any]:
    return np.concatenate(arrays, dtype=dtype, casting="same_kind") if arrays else np.empty(0, dtype=dtype)
