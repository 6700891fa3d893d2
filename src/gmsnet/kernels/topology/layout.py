"""The order in memory: near nodes near each other, and stars of one colour and degree in blocks of LANES.

Large arrays are made by the callers: NumPy gets them in large pages, which are several times as fast to touch first.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES, inlined, kernel, part

BITS = 11  # of the 32 along the curve, by which points are sorted at a time


@part
def spread(x):
    """The lower 16 bits of x with a zero between any two."""
    x = (x | (x << 8)) & 0x00FF00FF
    x = (x | (x << 4)) & 0x0F0F0F0F
    x = (x | (x << 2)) & 0x33333333
    return (x | (x << 1)) & 0x55555555


@kernel
def morton_order(points, box, keys, other, memory, position):
    """Orders the points (N, 2) along a Morton curve over a grid of 2¹⁶ × 2¹⁶; those of one square by their ids.

    box: (2, 2) the least and the greatest coordinates that the grid spans; none (0, 2) where those of the points do.
    Writes memory (N,), the ids in that order, and position (N,), the place of each id in it. keys, other: (N,) int64,
    to work with.
    """
    n = len(points)
    left, right, bottom, top = np.inf, -np.inf, np.inf, -np.inf
    for i in range(n):
        left, right = min(left, points[i, 0]), max(right, points[i, 0])
        bottom, top = min(bottom, points[i, 1]), max(top, points[i, 1])
    if len(box):
        left, right, bottom, top = box[0, 0], box[1, 0], box[0, 1], box[1, 1]
    extent = max(right - left, top - bottom)
    scale = 65535.0 / extent if extent > 0.0 else 0.0
    at = no_counts()
    for i in range(n):
        x, y = np.int64((points[i, 0] - left) * scale), np.int64((points[i, 1] - bottom) * scale)
        keys[i] = counted(spread(x) | spread(y) << 1, i, at)
    sort_keys(keys, other, at, memory, position)


@kernel
def morton_codes(points, box, codes):
    """Writes where points lie along the curves of ``morton_order`` and ``morton_order3``. box: as there, not none.

    points: (N, 2), or (N, 3 or more) where the box is (2, 3). codes: (N,) int64.
    """
    axes, extent = box.shape[1], 0.0
    for axis in range(axes):
        extent = max(extent, box[1, axis] - box[0, axis])
    scale = (65535.0 if axes == 2 else 1023.0) / extent if extent > 0.0 else 0.0
    for i in range(len(points)):
        code = np.int64(0)
        for axis in range(axes):
            at = np.int64((points[i, axis] - box[0, axis]) * scale)
            code |= (spread(at) if axes == 2 else spread3(at)) << axis
        codes[i] = code


@kernel
def morton_order3(points, box, keys, other, memory, position):
    """The same of points (N, 3 or more) in space, over a grid of 2¹⁰ × 2¹⁰ × 2¹⁰. box: (2, 3), or none (0, 3)."""
    low, extent = np.empty(3), 0.0
    for axis in range(3):
        low[axis], high = np.inf, -np.inf
        for i in range(len(points)):
            low[axis], high = min(low[axis], points[i, axis]), max(high, points[i, axis])
        if len(box):
            low[axis], high = box[0, axis], box[1, axis]
        extent = max(extent, high - low[axis])
    scale = 1023.0 / extent if extent > 0.0 else 0.0
    at = no_counts()
    for i in range(len(points)):
        code = np.int64(0)
        for axis in range(3):
            code |= spread3(np.int64((points[i, axis] - low[axis]) * scale)) << axis
        keys[i] = counted(code, i, at)
    sort_keys(keys, other, at, memory, position)


@part
def spread3(x):
    """The lower 10 bits of x with two zeros between any two."""
    x = (x | (x << 16)) & 0x030000FF
    x = (x | (x << 8)) & 0x0300F00F
    x = (x | (x << 4)) & 0x030C30C3
    return (x | (x << 2)) & 0x09249249


@part
def no_counts():
    """For ``counted``: by digit, the last one first, how many keys have each."""
    at = np.empty(3 << BITS, dtype=np.int64)
    for k in range(len(at)):
        at[k] = 0
    return at


@inlined
def counted(code, i, at):
    """The key of node i with this code of up to 32 bits, its digits counted."""
    mask = (1 << BITS) - 1
    at[code & mask] += 1
    at[(1 << BITS) + (code >> BITS & mask)] += 1
    at[(2 << BITS) + (code >> 2 * BITS)] += 1
    return code << 31 | i


@part
def sort_keys(keys, other, at, memory, position):
    """Sorts keys that have been ``counted``, and writes the order. other: as long as keys, to work with."""
    n, mask = len(keys), (1 << BITS) - 1
    for digit in range(3):
        end, begin = 0, digit << BITS
        for k in range(begin, begin + mask + 1):
            end, at[k] = end + at[k], end
        for i in range(n):
            k = begin + (keys[i] >> 31 + digit * BITS & mask)
            other[at[k]] = keys[i]
            at[k] += 1
        keys, other = other, keys
    for i in range(n):
        node = keys[i] & 0x7FFFFFFF
        memory[i] = node
        position[node] = i


@inlined
def corners_before(first, face):
    """How many corners the faces before this one have, which may be one past the last. first: see ``span``."""
    return 3 * face if first is None else np.int64(first[face])


@inlined
def span(first, face):
    """Where the corners of a face begin, and how many it has. first: CSR, or None where all faces are triangles."""
    if first is None:
        return 3 * face, 3
    return np.int64(first[face]), np.int64(first[face + 1]) - np.int64(first[face])


@kernel
def order_faces(first, corner, position, start, place, order):
    """Orders faces (CSR, by node ids) by the lowest place of their nodes in memory, else as they are.

    position: (N,). start: (N + 2,) zeros; its first N + 1 become where the faces of each lowest place begin. Writes
    place, the corners by their places in memory, and order (F,).
    """
    most = len(position) - 1
    for f in range(len(order)):
        low, count = span(first, f)
        lowest = most
        for k in range(count):
            at = position[np.uint64(corner[np.uint64(low + k)])]
            place[np.uint64(low + k)] = at
            lowest = min(lowest, np.int64(at))
        start[np.uint64(lowest + 2)] += 1
    for k in range(2, len(start)):
        start[k] += start[k - 1]
    for f in range(len(order)):
        low, count = span(first, f)
        lowest = most
        for k in range(count):
            lowest = min(lowest, np.int64(place[np.uint64(low + k)]))
        at = start[np.uint64(lowest + 1)]
        start[np.uint64(lowest + 1)] = at + 1
        order[np.uint64(at)] = f


@kernel
def take_faces(first, corner, order, new_first, new_corner):
    """Writes the corners of faces (CSR) in another order of the faces; new_first: where each is to begin, or None."""
    for i in range(len(order)):
        low, count = span(first, np.int64(order[i]))
        to, _ = span(new_first, i)
        for k in range(count):
            new_corner[np.uint64(to + k)] = corner[np.uint64(low + k)]


@kernel
def fill_blocks(free, start, ring, kind, sizes, block, to, centre, rings, offset, degree, filled):
    """Writes the stars of the free nodes (by places, ascending) into blocks of LANES stars of one colour and degree.

    A block stands where its first star does among those of its colour, so that what is near in memory is visited at
    about the same time, of whatever degree. start, ring: CSR by places. kind: (F,) of each star, colour·K + k for one
    of K kinds. sizes: (K,) how many nodes are around a star of each. block, to: by colour, the first block and where
    its ring begins in ``rings``; counted up here. Writes the arrays of ``kernels.star.block.Blocks``; filled: zeros
    before. The lanes left over repeat the last star.
    """
    open_block = np.empty(len(block) * len(sizes), dtype=np.int64)  # of each kind, the one that has room
    for k in range(len(open_block)):
        open_block[k] = -1
    for i in range(len(free)):
        v, k = free[i], kind[i]
        n = sizes[k % len(sizes)]
        b = open_block[k]
        if b < 0:
            colour = k // len(sizes)
            b = open_block[k] = block[colour]
            block[colour] = b + 1
            offset[b], degree[b] = to[colour], n
            to[colour] += LANES * n
        lane = filled[b]
        filled[b] = lane + 1
        if lane + 1 == LANES:
            open_block[k] = -1
        centre[b * LANES + lane] = v
        at, low = offset[b] + lane, np.int64(start[v])
        for j in range(n):
            rings[at + j * LANES] = ring[low + j]
    for b in range(len(filled)):
        last = filled[b] - 1
        for lane in range(last + 1, LANES):
            centre[b * LANES + lane] = centre[b * LANES + last]
            for row in range(offset[b], offset[b] + LANES * degree[b], LANES):
                rings[row + lane] = rings[row + last]
