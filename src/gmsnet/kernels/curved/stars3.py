"""Second-order volume cells as kernels see them: cells around each node, and the nodes that follow corners.

A *follower* is a node that is no corner: in the middle of an edge, a four-sided face or a hexahedron. Its offset from
the mean of the corners there is kept in a frame of these corners, so that it turns and grows with them:

- of an edge, turned by the least rotation from the edge as it was to the edge as it is, and scaled with its length;
- of a face, by coordinates along its diagonals e and f, and e × f/√|e × f|;
- of a hexahedron, by coordinates along its three mean edges.

What is kept does not change while corners move, so that no error adds up. Where a frame has no size, it is zero.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.mean_ratio3 import TINY, determinant, square

WIDEST3 = 27
NO_FOLLOWER = -1
EDGE, FACE = 2, 4  # corners of a follower; of a hexahedron there are eight
OPPOSITE_TURN = 1e-9  # 1 + cos of a turn: an edge that turns over so exactly has no least rotation


class CurvedSolids(NamedTuple):
    """Cells, and what is around each node.

    cells: (C, 27), of positive sense, −1 past the last node. kinds: (C,) numbers of ``forms``, the Jacobian
    determinants of the kinds. corners: (K,) of the kinds; simplices: (K, 8, 4) their corner simplices, −1 past the
    last, and shapes: (K,) the rows of WEIGHTS3. cell_start, cell_of: CSR by node, the cells around. start,
    follower_of: CSR by corner, the followers. follower: (F,) nodes; frame: (F, 8) the corners around, −1 past the
    last; dragged: (F,) whether it goes along; number: (N,) of each node among the followers, or NO_FOLLOWER. kept:
    (F, 6) its offset.
    """

    cells: NDArray[np.int32]
    kinds: NDArray[np.int8]
    forms: tuple[Any, ...]
    corners: NDArray[np.int64]
    simplices: NDArray[np.int32]
    shapes: NDArray[np.int64]
    cell_start: NDArray[np.int64]
    cell_of: NDArray[np.int32]
    start: NDArray[np.int64]
    follower_of: NDArray[np.int32]
    follower: NDArray[np.int32]
    frame: NDArray[np.int32]
    dragged: NDArray[np.bool_]
    number: NDArray[np.int32]
    kept: NDArray[np.float64]


@inlined
def corners_of(mesh, f):
    """How many corners a follower has around it."""
    return 2 if mesh.frame[f, 2] < 0 else 4 if mesh.frame[f, 4] < 0 else 8


@inlined
def mean_place(points, mesh, f, count):
    """The mean of its corners."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(count):
        i = mesh.frame[f, k]
        x, y, z = x + points[i, 0], y + points[i, 1], z + points[i, 2]
    return x / count, y / count, z / count


@inlined
def axes(points, corner, count, out):
    """The three vectors of the frame of a face or a hexahedron, into out (9,)."""
    for axis in range(3):
        if count == FACE:
            out[axis] = points[corner[2], axis] - points[corner[0], axis]
            out[3 + axis] = points[corner[3], axis] - points[corner[1], axis]
            continue
        out[axis], out[3 + axis], out[6 + axis] = 0.0, 0.0, 0.0
        for k in range(8):
            share = 0.25 * points[corner[k], axis]
            out[axis] += share if k % 4 in (1, 2) else -share
            out[3 + axis] += share if k % 4 in (2, 3) else -share
            out[6 + axis] += share if k >= 4 else -share
    if count == FACE:
        ax, ay, az, bx, by, bz = out[0], out[1], out[2], out[3], out[4], out[5]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        share = 1.0 / math.sqrt(max(math.sqrt(square(x, y, z)), TINY))
        out[6], out[7], out[8] = share * x, share * y, share * z


@inlined
def remember3(points, mesh, f):
    """Keeps the offset of a follower as it is."""
    count, kept = corners_of(mesh, f), mesh.kept[f]
    mx, my, mz = mean_place(points, mesh, f, count)
    i = mesh.follower[f]
    x, y, z = points[i, 0] - mx, points[i, 1] - my, points[i, 2] - mz
    if count == EDGE:
        a, b = mesh.frame[f, 0], mesh.frame[f, 1]
        for axis in range(3):
            kept[3 + axis] = points[b, axis] - points[a, axis]
        kept[0], kept[1], kept[2] = x, y, z
    else:
        remember_in_frame(points, mesh.frame[f], count, x, y, z, kept)


@part
def remember_in_frame(points, corner, count, x, y, z, kept):
    """The same of one that no edge has: its offset (x, y, z) in the frame of its corners. Apart, for it takes memory of
    its own, and what does so costs an edge ten times its time."""
    out = np.empty(9)
    axes(points, corner, count, out)
    ax, ay, az, bx, by, bz, cx, cy, cz = out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7], out[8]
    size = determinant(ax, ay, az, bx, by, bz, cx, cy, cz)
    share = 1.0 / size if abs(size) > TINY else 0.0
    kept[0] = share * determinant(x, y, z, bx, by, bz, cx, cy, cz)
    kept[1] = share * determinant(ax, ay, az, x, y, z, cx, cy, cz)
    kept[2] = share * determinant(ax, ay, az, bx, by, bz, x, y, z)


@kernel
def remember_followers(points, mesh, followers):
    """Keeps the offsets of some followers (K,) as they are."""
    for k in range(len(followers)):
        remember3(points, mesh, followers[k])


@inlined
def turned(x, y, z, px, py, pz, qx, qy, qz):
    """A vector turned by the least rotation from p to q, and scaled by |q|/|p|; zero where p has no length."""
    before, after = math.sqrt(square(px, py, pz)), math.sqrt(square(qx, qy, qz))
    if not before > 0.0:
        return 0.0, 0.0, 0.0
    share = after / before
    if after > 0.0:
        px, py, pz, qx, qy, qz = px / before, py / before, pz / before, qx / after, qy / after, qz / after
        vx, vy, vz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
        c = 1.0 + (px * qx + py * qy + pz * qz)
        if c > OPPOSITE_TURN:
            wx, wy, wz = vy * z - vz * y, vz * x - vx * z, vx * y - vy * x
            ux, uy, uz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
            x, y, z = x + wx + ux / c, y + wy + uy / c, z + wz + uz / c
    return share * x, share * y, share * z


@part
def in_frame(points, corner, count, kept):
    """What is kept of a follower that no edge has, by the frame that its corners have now."""
    out = np.empty(9)
    axes(points, corner, count, out)
    return (
        kept[0] * out[0] + kept[1] * out[3] + kept[2] * out[6],
        kept[0] * out[1] + kept[1] * out[4] + kept[2] * out[7],
        kept[0] * out[2] + kept[1] * out[5] + kept[2] * out[8],
    )


@part
def drag3(points, mesh, f, single):
    """Puts a follower where its kept offset says."""
    count, kept = corners_of(mesh, f), mesh.kept[f]
    mx, my, mz = mean_place(points, mesh, f, count)
    if count == EDGE:
        a, b = mesh.frame[f, 0], mesh.frame[f, 1]
        dx, dy, dz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        x, y, z = turned(kept[0], kept[1], kept[2], kept[3], kept[4], kept[5], dx, dy, dz)
    else:
        x, y, z = in_frame(points, mesh.frame[f], count, kept)
    put3(points, mesh.follower[f], mx + x, my + y, mz + z, single)


@inlined
def put3(points, i, x, y, z, single):
    """Writes a node's coordinates, rounded to single precision where the file keeps that."""
    if single:
        x, y, z = np.float64(np.float32(x)), np.float64(np.float32(y)), np.float64(np.float32(z))
    points[i, 0], points[i, 1], points[i, 2] = x, y, z


@part
def place3(points, mesh, i, x, y, z, single):
    """Puts a node there, and what follows it."""
    put3(points, i, x, y, z, single)
    for k in range(mesh.start[i], mesh.start[i + 1]):
        if mesh.dragged[mesh.follower_of[k]]:
            drag3(points, mesh, mesh.follower_of[k], single)


@inlined
def as_it_was(points, start, mesh, f):
    """Are all corners around a follower where they were?"""
    for k in range(corners_of(mesh, f)):
        i = mesh.frame[f, k]
        if points[i, 0] != start[i, 0] or points[i, 1] != start[i, 1] or points[i, 2] != start[i, 2]:
            return False
    return True


@kernel
def put_all(points, start, mesh, nodes, targets, single):
    """Puts corners (K,) at targets (K, 3), then what follows them; nothing is judged.

    start: (N, 3 or more), where all nodes were when offsets were kept. Followers of corners that are there are, too.
    """
    for k in range(len(nodes)):
        put3(points, nodes[k], targets[k, 0], targets[k, 1], targets[k, 2], single)
    for k in range(len(nodes)):
        for j in range(mesh.start[nodes[k]], mesh.start[nodes[k] + 1]):
            f = mesh.follower_of[j]
            if mesh.dragged[f]:
                if as_it_was(points, start, mesh, f):
                    i = mesh.follower[f]
                    put3(points, i, start[i, 0], start[i, 1], start[i, 2], False)
                else:
                    drag3(points, mesh, f, single)
