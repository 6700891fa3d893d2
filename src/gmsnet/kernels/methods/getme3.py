"""GETMe for tetrahedra, all at once: every node goes to a mean of its places in the transformed cells around it.

Vartziotis, Wipper, Schwald: The geometric element transformation method for tetrahedral mesh smoothing (Computer
Methods in Applied Mechanics and Engineering 199, 2009). Each node of a tetrahedron goes along the normal n of the
opposite face, which points to it where the volume is positive:

    p' = p + σ·n/√|n|,

which is as long as an edge, so that a size does not matter. The result is scaled about the centroid to the sum of
lengths of the edges before. In a flat or inverted cell the nodes go to the sides on which they belong.

The mean has the weights (1 − η)^k, so that bad cells say most. All shifts are planned before anything moves; the guard
then makes them colour by colour.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.methods.descent3 import gather3
from gmsnet.kernels.simplex.mean_ratio3 import TINY, determinant, shape_of, square
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.stars3 import truncate3


@inlined
def along_normal(ax, ay, az, bx, by, bz, sigma):
    """σ·n/√|n| of the normal a × b."""
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    share = sigma / math.sqrt(max(math.sqrt(square(x, y, z)), TINY))
    return share * x, share * y, share * z


@inlined
def edges(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """The sum of the lengths of the edges between four nodes, and that of their squares."""
    ab, ac, ad = square(ax - bx, ay - by, az - bz), square(ax - cx, ay - cy, az - cz), square(ax - dx, ay - dy, az - dz)
    bc, bd, cd = square(bx - cx, by - cy, bz - cz), square(bx - dx, by - dy, bz - dz), square(cx - dx, cy - dy, cz - dz)
    lengths = (math.sqrt(ab) + math.sqrt(ac) + math.sqrt(ad)) + (math.sqrt(bc) + math.sqrt(bd) + math.sqrt(cd))
    return lengths, (ab + ac + ad) + (bc + bd + cd)


@part
def transformed3(e, sigma):
    """Where the node at the origin goes in the tetrahedron with the spokes e (9,), and η of that before."""
    ax, ay, az, bx, by, bz, cx, cy, cz = e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8]
    px, py, pz = along_normal(bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az, -sigma)
    qx, qy, qz = along_normal(bx, by, bz, cx, cy, cz, sigma)
    rx, ry, rz = along_normal(cx, cy, cz, ax, ay, az, sigma)
    sx, sy, sz = along_normal(ax, ay, az, bx, by, bz, sigma)
    qx, qy, qz, rx, ry, rz = qx + ax, qy + ay, qz + az, rx + bx, ry + by, rz + bz
    sx, sy, sz = sx + cx, sy + cy, sz + cz
    before, squares = edges(0.0, 0.0, 0.0, ax, ay, az, bx, by, bz, cx, cy, cz)
    after, _ = edges(px, py, pz, qx, qy, qz, rx, ry, rz, sx, sy, sz)
    share = before / max(after, TINY)
    gx, gy, gz = 0.25 * (px + qx + rx + sx), 0.25 * (py + qy + ry + sy), 0.25 * (pz + qz + rz + sz)
    # The normals of a closed surface add up to zero, but not over the roots of their lengths: the centroid has moved.
    hx, hy, hz = 0.25 * (ax + bx + cx), 0.25 * (ay + by + cy), 0.25 * (az + bz + cz)
    double = determinant(ax, ay, az, bx, by, bz, cx, cy, cz)
    return hx + share * (px - gx), hy + share * (py - gy), hz + share * (pz - gz), shape_of(double, squares)


@kernel
def plan(points, blocks, first, last, sigma, exponent, shifts):
    """The shifts (B·LANES3, 3) of the stars in the blocks first…last; nothing moves. exponent: k."""
    ends = np.empty((blocks.most_simplices, 9))
    for block in range(first, last):
        for lane in range(blocks.filled[block]):
            count, radius = gather3(points, blocks, block, lane, ends)
            total, x, y, z = 0.0, 0.0, 0.0, 0.0
            for k in range(count):
                tx, ty, tz, shape = transformed3(ends[k], sigma)
                weight = 1.0
                for _ in range(exponent):
                    weight *= 1.0 - shape
                total, x, y, z = total + weight, x + weight * tx, y + weight * ty, z + weight * tz
            share, at = radius / total if total > 0.0 else 0.0, block * LANES3 + lane
            shifts[at, 0], shifts[at, 1], shifts[at, 2] = share * x, share * y, share * z


@kernel
def carry_out(points, blocks, first, last, guard, shifts, tally):
    """The guard moves the stars in the blocks first…last, of one colour, by their planned shifts."""
    for block in range(first, last):
        for lane in range(blocks.filled[block]):
            x, y, z = shifts[block * LANES3 + lane]
            if x != 0.0 or y != 0.0 or z != 0.0:
                truncate3(points, blocks, block, lane, x, y, z, guard, tally)
