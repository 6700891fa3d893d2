"""Two-dimensional cases of OpenFOAM: one layer of cells between ``empty`` patches, read as the mesh of one plane.

Each point of the plane stands in the file twice, and both move together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gmsnet.cells.table import face_name
from gmsnet.io.foam_cells import Faces, Ints
from gmsnet.io.foam_patches import Patch
from gmsnet.io.places import ranges
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock

NEAR = 1e-6  # of the extent: so near are two points of which one is behind the other


class Plane(NamedTuple):
    """points: (n,) those of the front plane; node: (N,) for which of them each point of the file stands; axes: of the
    plane.
    """

    points: Ints
    node: Ints
    axes: tuple[int, int]


def plane_of(points: NDArray[np.float64], faces: Faces, patches: list[Patch], cells: int) -> Plane | None:
    """The plane of a case that is one layer of cells thick; None where it is not."""
    on_empty = np.zeros(len(faces.sizes), dtype=bool)
    for patch in patches:
        if patch.kind == "empty":
            on_empty[patch.start : patch.start + patch.faces] = True
    if not on_empty.any() or not len(points):
        return None
    extent = np.ptp(points, axis=0)
    for axis in range(3):
        middle = points[:, axis].min() / 2 + points[:, axis].max() / 2
        back = points[:, axis] > middle
        spread = max(np.ptp(points[side, axis]) if side.any() else 0.0 for side in (back, ~back))
        if not back.any() or spread > NEAR * extent[axis] or back.sum() * 2 != len(points):
            continue
        plane = _paired(points, ((1, 2), (0, 2), (0, 1))[axis], back, NEAR * float(extent.max()))
        if plane is not None and _is_one_layer(faces, plane, back, on_empty, cells):
            return plane
    return None


def _paired(points: NDArray[np.float64], axes: tuple[int, int], back: NDArray[np.bool_], near: float) -> Plane | None:
    front, behind = np.flatnonzero(~back), np.flatnonzero(back)
    one, other = points[front][:, axes], points[behind][:, axes]
    orders = np.lexsort(one.T), np.lexsort(other.T)
    if np.array_equal(one[orders[0]], other[orders[1]]):
        mate = np.empty_like(orders[0])
        mate[orders[1]] = orders[0]
    else:
        distance, mate = cKDTree(one).query(other)
        if distance.max() > near or len(sorted_unique(mate)) != len(front):
            return None
    node = np.empty(len(points), dtype=np.int64)
    node[front], node[behind] = np.arange(len(front)), mate
    return Plane(front, node, axes)


def _is_one_layer(faces: Faces, plane: Plane, back: NDArray[np.bool_], on_empty: NDArray[np.bool_], cells: int) -> bool:
    """Has each cell a face in front and one behind, of the same points, both on empty patches, and others across?"""
    of_face = np.repeat(np.arange(len(faces.sizes)), faces.sizes)
    behind = np.bincount(of_face, back[faces.points], len(faces.sizes)).astype(np.int64)
    front_face, back_face = behind == 0, behind == faces.sizes
    across = ~(front_face | back_face)
    if (on_empty != ~across).any() or (faces.sizes[across] != 4).any() or (behind[across] != 2).any():
        return False
    fronts, backs = np.flatnonzero(front_face), np.flatnonzero(back_face)
    for chosen in (fronts, backs):
        if not np.array_equal(np.sort(faces.owner[chosen]), np.arange(cells)):
            return False
    fronts, backs = (chosen[np.argsort(faces.owner[chosen])] for chosen in (fronts, backs))
    if (faces.sizes[fronts] != faces.sizes[backs]).any():
        return False
    one, other = (_sorted_nodes(faces, plane, chosen) for chosen in (fronts, backs))
    return bool((one == other).all())


def _sorted_nodes(faces: Faces, plane: Plane, chosen: Ints) -> Ints:
    """The points of the plane of some faces, face by face, in ascending order."""
    nodes = plane.node[faces.points[ranges(faces.starts[chosen], faces.sizes[chosen])]]
    rank = np.repeat(np.arange(len(chosen)), faces.sizes[chosen])
    return nodes[np.lexsort((nodes, rank))]


def cells_in(
    plane: Plane, faces: Faces, patches: list[Patch], back: NDArray[np.bool_], regions: Ints
) -> list[CellBlock]:
    """The cells of the plane, in their order as far as one kind goes, and the edges of each patch.

    back: (N,) which points of the file are behind.
    """
    of_face = np.repeat(np.arange(len(faces.sizes)), faces.sizes)
    behind = np.bincount(of_face, back[faces.points], len(faces.sizes))
    fronts = np.flatnonzero(behind == 0)
    fronts = fronts[np.argsort(faces.owner[fronts])]
    blocks = []
    for size in np.unique(faces.sizes[fronts]).tolist():
        some = fronts[faces.sizes[fronts] == size]
        blocks.append(CellBlock(face_name(size), plane.node[faces.corners(some, size)], regions[faces.owner[some]]))
    for number, patch in enumerate(patches, 1):
        if patch.kind != "empty" and patch.faces:
            sides = faces.corners(patch.members, 4)
            edges = sides[~back[sides]].reshape(-1, 2)
            blocks.append(CellBlock("line", plane.node[edges], np.full(len(edges), number)))
    return blocks
