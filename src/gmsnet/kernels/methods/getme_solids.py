"""GETMe for hexahedra, wedges, pyramids and tetrahedra beside them, all at once.

Vartziotis, Wipper: Fast smoothing of mixed volume meshes based on the effective geometric element transformation
method (Computer Methods in Applied Mechanics and Engineering 201–204, 2012). The centres of the facets at a corner of a
cell span a polygon with the mean c and the area vector n. The corner goes to

    p' = c + σ·n/√|n|,

with a σ of each kind, for which the ideal cell keeps its shape (gmsnet.cells.dual). The cell is then scaled about its
centroid, so that its corners are as far from it as before, in the root of the mean square.

Nodes go to the mean of their places in the transformed cells, with the weights (1 − η)^k, as in getme3.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.simplex.mean_ratio3 import TINY, WEIGHTS3, measured_by, shape_of, square
from gmsnet.kernels.star.space_blocks import LANES3, is_present, rows_in

NONE = -1
MOST = 8  # corners of a cell


class Duals(NamedTuple):
    """By the kind of a cell (kernels.simplex.mean_ratio3), NONE where there is nothing.

    corners: (K,) how many. facets: (K, 6, 4) corners. around: (K, 8, 4) the facets at each corner, in order, counter-
    clockwise as seen from outside. simplices: (K, 8, 4). sigma: (K,).
    """

    corners: NDArray[np.int32]
    facets: NDArray[np.int32]
    around: NDArray[np.int32]
    simplices: NDArray[np.int32]
    sigma: NDArray[np.float64]


@part
def worst_corner(corners, kind, duals):
    """η of the worst corner of a cell."""
    worst, w = np.inf, WEIGHTS3[kind]
    for k in range(MOST):
        v, a, b, c = duals.simplices[kind, k]
        if v == NONE:
            break
        x, y, z = corners[v]
        double, lengths, _, _, _, _, _, _ = measured_by(
            corners[a, 0] - x, corners[a, 1] - y, corners[a, 2] - z,
            corners[b, 0] - x, corners[b, 1] - y, corners[b, 2] - z,
            corners[c, 0] - x, corners[c, 1] - y, corners[c, 2] - z, w[0], w[1], w[2], w[3], w[4], w[5],
        )  # fmt: skip
        worst = min(worst, shape_of(double, lengths))
    return worst


@part
def centres_of_facets(corners, kind, duals, centres):
    """The mean of the corners of each facet, into (6, 3)."""
    for f in range(len(centres)):
        count, x, y, z = 0, 0.0, 0.0, 0.0
        for corner in duals.facets[kind, f]:
            if corner != NONE:
                count, x, y, z = count + 1, x + corners[corner, 0], y + corners[corner, 1], z + corners[corner, 2]
        share = 1.0 / max(count, 1)
        centres[f, 0], centres[f, 1], centres[f, 2] = share * x, share * y, share * z


@part
def regularised(centres, around, sigma, place):
    """Writes c + σ·n/√|n| of the facets around a corner, (4,), into ``place``."""
    count, x, y, z, nx, ny, nz = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(around)):
        if around[k] == NONE:
            break
        this, other = centres[around[k]], centres[around[0]]
        if k + 1 < len(around) and around[k + 1] != NONE:
            other = centres[around[k + 1]]
        count, x, y, z = count + 1, x + this[0], y + this[1], z + this[2]
        nx, ny = nx + this[1] * other[2] - this[2] * other[1], ny + this[2] * other[0] - this[0] * other[2]
        nz += this[0] * other[1] - this[1] * other[0]
    share = sigma * math.sqrt(0.5 / max(math.sqrt(square(nx, ny, nz)), TINY))
    place[0], place[1], place[2] = x / count + share * nx, y / count + share * ny, z / count + share * nz


@part
def about_centroid(corners, count):
    """Takes the first corners to their centroid. Returns where that was, and the sum of their squared distances."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(count):
        x, y, z = x + corners[k, 0], y + corners[k, 1], z + corners[k, 2]
    x, y, z, total = x / count, y / count, z / count, 0.0
    for k in range(count):
        corners[k, 0], corners[k, 1], corners[k, 2] = corners[k, 0] - x, corners[k, 1] - y, corners[k, 2] - z
        total += square(corners[k, 0], corners[k, 1], corners[k, 2])
    return x, y, z, total


@part
def transformed_solid(corners, kind, own, duals, centres, places, place):
    """Writes into ``place`` where corner ``own`` of a cell goes. corners: (8, 3), which are taken to their centroid."""
    count = duals.corners[kind]
    x, y, z, before = about_centroid(corners, count)
    centres_of_facets(corners, kind, duals, centres)
    for k in range(count):
        regularised(centres, duals.around[kind, k], duals.sigma[kind], places[k])
    _, _, _, after = about_centroid(places, count)
    share = math.sqrt(before / max(after, TINY))
    place[0], place[1], place[2] = x + share * places[own, 0], y + share * places[own, 1], z + share * places[own, 2]


@part
def fetch_cell(points, nodes, count, i, corners):
    """Writes the corners of a cell as seen from node i, over the size of the cell, into (8, 3). Returns the size, and
    which corner node i is."""
    own, size = 0, 0.0
    for k in range(count):
        v = nodes[k]
        own = k if v == i else own
        for axis in range(3):
            corners[k, axis] = points[v, axis] - points[i, axis]
            size = max(size, abs(corners[k, axis]))
    inverse = 1.0 / max(size, TINY)
    for k in range(count):
        for axis in range(3):
            corners[k, axis] *= inverse
    return size, own


@part
def is_new(seen, count, cell):
    """Is a cell none of the first ``count`` ones?"""
    new = True
    for k in range(count):
        new &= seen[k] != cell
    return new


@kernel
def plan(points, blocks, first, last, duals, exponent, shifts):
    """The shifts (B·LANES3, 3) of the stars in the blocks first…last; nothing moves. exponent: k."""
    mixture, solids = blocks.mixture, blocks.mixture.solids
    corners, places, centres = np.empty((MOST, 3)), np.empty((MOST, 3)), np.empty((6, 3))
    place, seen = np.empty(3), np.empty(blocks.most_simplices, dtype=np.int32)
    for block in range(first, last):
        at = blocks.at[block]
        for lane in range(blocks.filled[block]):
            i, cells, total, x, y, z = blocks.centre[block * LANES3 + lane], 0, 0.0, 0.0, 0.0, 0.0
            for row in range(rows_in(mixture, blocks, block, lane)):
                cell = mixture.owner[at // 3 + row * LANES3 + lane]
                if not is_present(mixture, at, row, lane) or not is_new(seen, cells, cell):
                    continue
                seen[cells] = cell
                cells += 1
                kind = np.int64(solids.kind[cell])
                size, own = fetch_cell(points, solids.nodes[cell], duals.corners[kind], i, corners)
                weight, short = 1.0, 1.0 - worst_corner(corners, kind, duals)
                for _ in range(exponent):
                    weight *= short
                transformed_solid(corners, kind, own, duals, centres, places, place)
                total, weighted = total + weight, weight * size
                x, y, z = x + weighted * place[0], y + weighted * place[1], z + weighted * place[2]
            share, to = 1.0 / total if total > 0.0 else 0.0, block * LANES3 + lane
            shifts[to, 0], shifts[to, 1], shifts[to, 2] = share * x, share * y, share * z
