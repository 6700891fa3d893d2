"""Volumes of the region "domain" with the faces around them by marker."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Rows = Mapping[str, Ints]  # kind → the cells (C × n)

SIDES = ("left", "right", "front", "back", "bottom", "top")  # x = 0, x = 1, y = 0, …


def marked_volume(
    points: Floats, rows: Rows, side_of: Callable[[Floats, Ints], Ints], markers: Sequence[str], size: float
) -> Mesh:
    """The mesh of some cells in the region "domain" and of the faces around them by marker.

    side_of: the number of the marker of each face (B × 3 or 4), from 0.
    """
    names: dict[tuple[int, int], str] = {(3, 1): "domain"} | {(2, k): name for k, name in enumerate(markers, 1)}
    blocks = [CellBlock(kind, cells, np.ones(len(cells), dtype=np.int64)) for kind, cells in rows.items() if len(cells)]
    for kind, faces in outer_faces(rows).items():
        blocks.append(CellBlock(kind, faces, side_of(points, faces) + 1))
    return Mesh(points * size, tuple(blocks), names)


def outer_faces(rows: Rows) -> Rows:
    """The triangles and quads of one cell alone, seen from outside."""
    found: dict[str, Ints] = {}
    for kind, corners in (("triangle", 3), ("quad", 4)):
        faces = np.concatenate(
            [np.empty((0, corners), dtype=np.int64), *(_facets(*each, corners) for each in rows.items())]
        )
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        if (count == 1).any():
            found[kind] = faces[np.sort(first[count == 1])]
    return found


def _facets(kind: str, cells: Ints, corners: int) -> Ints:
    """(F × corners) the facets of so many corners, cell by cell."""
    facets = [facet for facet in CELLS[kind].facets if len(facet) == corners]
    found: Ints = cells[:, np.array(facets, dtype=np.int64).reshape(-1, corners)].reshape(-1, corners)
    return found


def on_sides(points: Floats, faces: Ints) -> Ints:
    """(B,) which side of the unit cube each face lies in, 6 for none."""
    corners = points[faces]
    on = np.stack([(corners[:, :, k // 2] == k % 2).all(axis=1) for k in range(6)])
    side: Ints = np.where(on.any(axis=0), on.argmax(axis=0), len(SIDES))
    return side
