"""Facets that nodes slide over: the way to the nearest one, and the cubic Bézier triangle over each.

A facet has three vertices, and the three facets across its edges, the edge from vertex k to k + 1 the k-th. A vertex is
a node as it was, with the unit normal of one of its patches. The cubic has the vertices as corners and their normals
there (Vlachos, Peters, Boyd, Mitchell: Curved PN triangles, 2001). The handles of an edge are those of an arc:
2/(3(1 + cos α)) of its length, α the angle between the edge and the tangent t, the part of it across the normal. Since
cos α = |t|/length, that is t·2·length²/(3|t|(length + |t|)). Control points are found where they are needed: if they
were kept, those of a large surface would not fit into a processor's caches.

Functions are told no more of a surface than they need: all that is passed to a part is copied.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.star.pieces import LONGEST_WALK, NOWHERE


@inlined
def corners_of(facet, f):
    """The three vertices of a facet."""
    return np.uint32(facet[f, 0]), np.uint32(facet[f, 1]), np.uint32(facet[f, 2])


@inlined
def foot_on(ux, uy, uz, vx, vy, vz, px, py, pz):
    """The second and third barycentric coordinates of the foot of p on the plane of 0, u and v; 0 without an area."""
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    pu, pv = px * ux + py * uy + pz * uz, px * vx + py * vy + pz * vz
    double = uu * vv - uv * uv
    there = double > 0.0
    double = double if there else 1.0
    return ((vv * pu - uv * pv) / double if there else 0.0), ((uu * pv - uv * pu) / double if there else 0.0)


@inlined
def barycentric(vertex, i, j, k, x, y, z):
    """The second and third barycentric coordinates of the foot of a point on the plane of three vertices."""
    ax, ay, az = vertex[i, 0], vertex[i, 1], vertex[i, 2]
    return foot_on(
        vertex[j, 0] - ax, vertex[j, 1] - ay, vertex[j, 2] - az,
        vertex[k, 0] - ax, vertex[k, 1] - ay, vertex[k, 2] - az, x - ax, y - ay, z - az,
    )  # fmt: skip


@inlined
def along_edge(vertex, i, j, x, y, z):
    """How far along the edge from vertex i to j the foot of a point is, from 0 to 1."""
    ux, uy, uz = vertex[j, 0] - vertex[i, 0], vertex[j, 1] - vertex[i, 1], vertex[j, 2] - vertex[i, 2]
    square = ux * ux + uy * uy + uz * uz
    if not square > 0.0:
        return 0.0
    t = (x - vertex[i, 0]) * ux + (y - vertex[i, 1]) * uy + (z - vertex[i, 2]) * uz
    return min(max(t / square, 0.0), 1.0)


@part
def walk(vertex, facet, f, x, y, z):
    """The facet nearest to a point, from facet f on, and the three barycentric coordinates there, none below 0."""
    last = NOWHERE
    for _ in range(LONGEST_WALK):
        p, q, r = corners_of(facet, f)
        b, c = barycentric(vertex, p, q, r, x, y, z)
        a = 1.0 - b - c
        if a >= 0.0 and b >= 0.0 and c >= 0.0:
            return f, a, b, c
        # Across the edge that it lies behind most; the edge opposite to a is from corner 1 to 2.
        k = 1 if a <= b and a <= c else 2 if b <= c else 0
        onward = np.int64(facet[f, 3 + k])
        if onward in (NOWHERE, last):  # the rim, or the ridge between two facets
            if k == 0:
                t = along_edge(vertex, p, q, x, y, z)
                return f, 1.0 - t, t, 0.0
            if k == 1:
                t = along_edge(vertex, q, r, x, y, z)
                return f, 0.0, 1.0 - t, t
            t = along_edge(vertex, r, p, x, y, z)
            return f, t, 0.0, 1.0 - t
        last, f = f, onward
    p, q, r = corners_of(facet, f)
    b, c = barycentric(vertex, p, q, r, x, y, z)  # around a peak
    a, b, c = max(1.0 - b - c, 0.0), max(b, 0.0), max(c, 0.0)
    whole = a + b + c
    return f, a / whole, b / whole, c / whole


@inlined
def handle(ex, ey, ez, length, nx, ny, nz):
    """The handle of an edge of this length at its end with the unit normal n."""
    over = (ex * nx + ey * ny) + ez * nz
    tx, ty, tz = ex - over * nx, ey - over * ny, ez - over * nz
    size = np.sqrt((tx * tx + ty * ty) + tz * tz)
    below = 3.0 * size * (length + size)
    share = 2.0 * length * length / (below if below > 0.0 else 1.0)
    return tx * share, ty * share, tz * share


@inlined
def corner_handles(px, py, pz, nx, ny, nz, qx, qy, qz, mx, my, mz):
    """The handles of the edge from p to q, with normals n and m: at p along it, at q along it."""
    ex, ey, ez = qx - px, qy - py, qz - pz
    length = np.sqrt((ex * ex + ey * ey) + ez * ez)
    hx, hy, hz = handle(ex, ey, ez, length, nx, ny, nz)
    gx, gy, gz = handle(ex, ey, ez, length, mx, my, mz)
    return hx, hy, hz, gx, gy, gz


@inlined
def blended(a, b, c, p, q, r, pq, qp, qr, rq, rp, pr):
    """A coordinate of the place on the cubic with corners p, q and r; pq the handle at p towards q."""
    one, two, three, four, five, six = p + pq, q - qp, q + qr, r - rq, r + rp, p - pr
    edges = a * b * (a * one + b * two) + b * c * (b * three + c * four) + c * a * (c * five + a * six)
    mean = (one + two + three + four + five + six) / 6.0
    centre = mean + 0.5 * (mean - (p + q + r) / 3.0)
    return a * a * a * p + b * b * b * q + c * c * c * r + 3.0 * edges + 6.0 * a * b * c * centre


@inlined
def within(limit, px, py, pz, x, y, z):
    """(x, y, z), or the place on the way there from (px, py, pz) at this distance from it."""
    dx, dy, dz = x - px, y - py, z - pz
    far = np.sqrt(dx * dx + dy * dy + dz * dz)
    beyond = far > limit
    share = limit / (far if beyond else 1.0)
    return px + share * dx if beyond else x, py + share * dy if beyond else y, pz + share * dz if beyond else z


@inlined
def on_cubic(a, b, c, limit, px, py, pz, lx, ly, lz, qx, qy, qz, mx, my, mz, rx, ry, rz, nx, ny, nz):
    """The place on the cubic over the facet p, q, r with normals l, m, n, at most so far from the one on the facet."""
    pqx, pqy, pqz, qpx, qpy, qpz = corner_handles(px, py, pz, lx, ly, lz, qx, qy, qz, mx, my, mz)
    qrx, qry, qrz, rqx, rqy, rqz = corner_handles(qx, qy, qz, mx, my, mz, rx, ry, rz, nx, ny, nz)
    rpx, rpy, rpz, prx, pry, prz = corner_handles(rx, ry, rz, nx, ny, nz, px, py, pz, lx, ly, lz)
    return within(
        limit, a * px + b * qx + c * rx, a * py + b * qy + c * ry, a * pz + b * qz + c * rz,
        blended(a, b, c, px, qx, rx, pqx, qpx, qrx, rqx, rpx, prx),
        blended(a, b, c, py, qy, ry, pqy, qpy, qry, rqy, rpy, pry),
        blended(a, b, c, pz, qz, rz, pqz, qpz, qrz, rqz, rpz, prz),
    )  # fmt: skip


@part
def over_facet(vertex, facet, limit, f, a, b, c):
    """The place on the cubic over facet f, at most so far from the one on the facet."""
    i, j, k = corners_of(facet, f)
    return on_cubic(
        a, b, c, limit,
        vertex[i, 0], vertex[i, 1], vertex[i, 2], vertex[i, 3], vertex[i, 4], vertex[i, 5],
        vertex[j, 0], vertex[j, 1], vertex[j, 2], vertex[j, 3], vertex[j, 4], vertex[j, 5],
        vertex[k, 0], vertex[k, 1], vertex[k, 2], vertex[k, 3], vertex[k, 4], vertex[k, 5],
    )  # fmt: skip


@inlined
def on_facet(vertex, facet, f, a, b, c):
    """The place on facet f itself."""
    i, j, k = corners_of(facet, f)
    return (
        a * vertex[i, 0] + b * vertex[j, 0] + c * vertex[k, 0],
        a * vertex[i, 1] + b * vertex[j, 1] + c * vertex[k, 1],
        a * vertex[i, 2] + b * vertex[j, 2] + c * vertex[k, 2],
    )


@inlined
def upright(x, y, z):
    """A vector at length 1; one of no length along z."""
    length = np.sqrt(x * x + y * y + z * z)
    there = length > 0.0
    length = length if there else 1.0
    return x / length if there else 0.0, y / length if there else 0.0, z / length if there else 1.0


@inlined
def normal_on(vertex, facet, f, a, b, c):
    """The unit normal at a place of facet f, between those of its vertices."""
    i, j, k = corners_of(facet, f)
    return upright(
        a * vertex[i, 3] + b * vertex[j, 3] + c * vertex[k, 3],
        a * vertex[i, 4] + b * vertex[j, 4] + c * vertex[k, 4],
        a * vertex[i, 5] + b * vertex[j, 5] + c * vertex[k, 5],
    )
