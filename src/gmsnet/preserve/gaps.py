"""Gaps in the rows of layers: where cells are as thick as long, as at a blunt nose, and so not stretched.

The rows of the layer end at one side of such cells and go on at the other, with the same spacing, which is meant there
as well. Nodes that lie in no cell of a layer are in a gap of it if

- one layer lies all around them, and reaches further from its wall than they do: what lies between the layers of two
  walls, or inside of one that goes around, is farthest from them;
- their cells have right angles, as cells in rows have;
- and they are few: else the layer is the gap in them.

Gaps are looked for in layers of walls alone (see anchored.py): where cells are stretched alike for other reasons,
there are holes in them, too, and nobody meant those.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import connectivity
from gmsnet.kernels.topology.components import pieces

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

SINE = 0.95  # of the angle of a cell that is nearest to a right one, at least; half of those in no rows have less
FEWEST = 6  # nodes: fewer have been thrown out of a row
PART = 0.1  # of the nodes of the layer, at most


def in_gaps(
    triangles: Ints,
    orientation: NDArray[np.int8],
    equal: Flags,
    points: Floats,
    rim: Flags,
    layers: Flags,
    wall: Floats,
) -> Flags:
    """(N,) which nodes are in gaps of layers.

    triangles: (S, 3), all of them, by node id. equal: (S,) which are triangles; the others are corners of quads, 0 the
    corner itself. points: (N, 2). rim: (N,) which nodes are on boundaries or interfaces. layers: (N,) the corners of
    the cells of layers. wall: (W, 2) places on their walls.
    """
    from scipy.spatial import cKDTree  # it takes a tenth of a second to import

    outside = ~layers
    gap, layer = pieces(triangles, outside), pieces(triangles, layers)  # told by the least of their nodes
    size, of_layer = (np.bincount(x[some], minlength=len(x)) for x, some in ((gap, outside), (layer, layers)))
    closed = size >= FEWEST
    closed[gap[rim & outside]] = False
    rows = connectivity.touching(triangles, closed[gap] & outside)
    if not len(rows):
        return np.zeros(len(gap), dtype=bool)
    corners = triangles[rows]  # of each simplex, those outside are in one gap
    beside = layers[corners]
    name, of_row = np.unique(np.where(beside, -1, gap[corners]).max(axis=1), return_inverse=True)
    least, most = np.full(len(name), len(gap)), np.full(len(name), -1)
    np.minimum.at(least, of_row, np.where(beside, layer[corners], len(gap)).min(axis=1))
    np.maximum.at(most, of_row, np.where(beside, layer[corners], -1).max(axis=1))
    good = (least == most) & (size[name] <= PART * of_layer[most])
    good[of_row[~_right_angled(points[corners], orientation[rows], equal[rows])]] = False
    away, within, without = cKDTree(wall).query(points[corners])[0], np.zeros(len(name)), np.zeros(len(name))
    np.maximum.at(within, of_row, np.where(beside, 0.0, away).max(axis=1))
    np.maximum.at(without, of_row, np.where(beside, away, 0.0).max(axis=1))
    closed[name[~good | (within >= without)]] = False
    return np.asarray(closed[gap] & outside)


def _right_angled(corners: Floats, orientation: NDArray[np.int8], equal: Flags) -> Flags:
    """Which simplices, with these corners (K, 3, 2), have nearly a right angle; of a quad, at its corner."""
    edge = np.roll(corners, -1, axis=1) - corners
    double = (edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]) * orientation
    length = np.hypot(edge[..., 0], edge[..., 1])
    product = length * np.roll(length, 1, axis=1)  # of the two edges at each corner
    return np.asarray(double >= SINE * np.where(equal, product.min(axis=1), product[:, 0]))
