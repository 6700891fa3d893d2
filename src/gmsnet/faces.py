"""The two-dimensional cells of a mesh as polygons (their corners), numbered so that near faces are near in memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels import layout
from gmsnet.mesh import CORNERS, Mesh

Ints = NDArray[np.int32]

SMOOTHED = ("triangle",)  # the cell types whose nodes may move


@dataclass(frozen=True, eq=False)
class Faces:
    """Polygons in CSR form: face f has the corners corner[first[f] : first[f + 1]].

    region: (F,) int64. smoothable: (F,) bool, is it of a type whose nodes may move? origin: (F,) int32, the place of
    each in the order of the file. cell: (F,) int64, in the order of the file, its index among all cells of the mesh.
    """

    first: Ints
    corner: Ints
    region: NDArray[np.int64]
    smoothable: NDArray[np.bool_]
    origin: Ints
    cell: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.first) - 1

    @classmethod
    def of(cls, mesh: Mesh) -> Faces:
        """The faces in the order of the file, by node ids."""
        corner, corners, region, smoothable, cell = [], [], [], [], []
        before = 0
        for block in mesh.cells:
            count = len(block.nodes)
            if block.dimension == 2:
                size = CORNERS.get(block.kind, block.nodes.shape[1])
                corner.append(block.nodes[:, :size].ravel())
                corners.append(np.full(count, size, dtype=np.int32))
                region.append(block.regions)
                smoothable.append(np.full(count, block.kind in SMOOTHED))
                cell.append(np.arange(before, before + count))
            before += count
        if sum(len(c) for c in corner) >= 2**31:
            raise InputError("the mesh has more than 2³¹ cell corners, which is more than gmsnet can number")
        sizes = _joined(corners, np.int32)
        first = np.zeros(len(sizes) + 1, dtype=np.int32)
        np.cumsum(sizes, out=first[1:])
        return cls(
            first=first,
            corner=_joined(corner, np.int32),
            region=_joined(region, np.int64),
            smoothable=_joined(smoothable, np.bool_),
            origin=np.arange(len(sizes), dtype=np.int32),
            cell=_joined(cell, np.int64),
        )

    def renumbered(self, position: Ints) -> Faces:
        """The faces by the places of their nodes in memory (N,), in the order of their first node there."""
        order, first, corner = layout.order_faces(self.first, self.corner, position)
        return Faces(first, corner, _picked(self.region, order), _picked(self.smoothable, order), order, self.cell)

    def triangles(self) -> tuple[Ints, Ints]:
        """The faces with three corners: which (T,), and their corners (T, 3)."""
        three = np.flatnonzero(np.diff(self.first) == 3).astype(np.int32)
        if len(three) == len(self):
            return three, self.corner.reshape(-1, 3)
        return three, self.corner[self.first[three][:, None] + np.arange(3)]


def _joined(arrays: list[NDArray[Any]], dtype: type) -> NDArray[Any]:
    return np.concatenate(arrays).astype(dtype, copy=False) if arrays else np.empty(0, dtype=dtype)


def _picked(values: NDArray[Any], order: Ints) -> NDArray[Any]:
    """values[order], without the walk through memory where all are equal."""
    return values if len(values) and (values == values[0]).all() else values[order]
