"""Rotations in space at all nodes of a mesh: how they turn edges, and those that fit moved edges best.

A rotation is a unit quaternion (x, y, z, w). An edge turns by the mean of those at its two ends, which lies half way
between them.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part

ROUNDS, SETTLED = 30, 1e-9  # of the search for the best rotation; radians
FLAT, TINY = 1e-9, 1e-300


@inlined
def rotated(x, y, z, w, a, b, c):
    """A vector (a, b, c) turned by a unit quaternion."""
    s, t, u = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * s + y * u - z * t, b + w * t + z * s - x * u, c + w * u + x * t - y * s


@inlined
def between(attitude, i, j):
    """The rotation half way between those of two nodes, on the shorter way."""
    ax, ay, az, aw = attitude[i, 0], attitude[i, 1], attitude[i, 2], attitude[i, 3]
    bx, by, bz, bw = attitude[j, 0], attitude[j, 1], attitude[j, 2], attitude[j, 3]
    sign = 1.0 if ax * bx + ay * by + az * bz + aw * bw >= 0.0 else -1.0
    x, y, z, w = ax + sign * bx, ay + sign * by, az + sign * bz, aw + sign * bw
    size = 1.0 / math.sqrt(x * x + y * y + z * z + w * w)
    return x * size, y * size, z * size, w * size


@kernel
def turn_edges(edges, ways, attitude, sense, out):
    """Ways (E, 3) along edges (E, 2), turned by the rotations at their nodes (N, 4), or back (sense −1), into out."""
    for e in range(len(edges)):
        x, y, z, w = between(attitude, edges[e, 0], edges[e, 1])
        found = rotated(sense * x, sense * y, sense * z, w, ways[e, 0], ways[e, 1], ways[e, 2])
        out[e, 0], out[e, 1], out[e, 2] = found


@kernel
def pulls(edges, weight, ways, attitude, points, out):
    """What pulls at each node (N, 3): the weighted sum over its edges of what they miss of their ways, turned."""
    out[:] = 0.0
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        x, y, z, w = between(attitude, i, j)
        a, b, c = rotated(x, y, z, w, ways[e, 0], ways[e, 1], ways[e, 2])
        a = weight[e] * (a - (points[j, 0] - points[i, 0]))
        b = weight[e] * (b - (points[j, 1] - points[i, 1]))
        c = weight[e] * (c - (points[j, 2] - points[i, 2]))
        out[i, 0] -= a
        out[i, 1] -= b
        out[i, 2] -= c
        out[j, 0] += a
        out[j, 1] += b
        out[j, 2] += c


@inlined
def newton_turn(p):
    """The turn by which Newton's method makes Σ R_kl m_kl larger, where p is m Rᵀ; a shorter one where it is no sum
    that is concave about there."""
    x, y, z = p[2, 1] - p[1, 2], p[0, 2] - p[2, 0], p[1, 0] - p[0, 1]
    a, b, c = p[1, 1] + p[2, 2], p[0, 0] + p[2, 2], p[0, 0] + p[1, 1]
    d, e, f = -0.5 * (p[0, 1] + p[1, 0]), -0.5 * (p[0, 2] + p[2, 0]), -0.5 * (p[1, 2] + p[2, 1])
    minor = a * b - d * d
    whole = c * minor - a * f * f - b * e * e + 2.0 * d * e * f
    size = abs(a) + abs(b) + abs(c)
    if a > FLAT * size and minor > FLAT * size * size and whole > FLAT * size * size * size:
        return (
            ((b * c - f * f) * x + (e * f - c * d) * y + (d * f - b * e) * z) / whole,
            ((e * f - c * d) * x + (a * c - e * e) * y + (d * e - a * f) * z) / whole,
            ((d * f - b * e) * x + (d * e - a * f) * y + minor * z) / whole,
        )
    factor = 2.0 / max(size, TINY)
    return x * factor, y * factor, z * factor


@part
def turn_towards(m, q):
    """Turns q to the rotation R with the largest Σ R_kl m_kl, and returns by how many radians that was.

    Steps as those of Müller, Bender, Chentanez, Macklin: A robust method to extract the rotational part of
    deformations, Motion in Games 2016, but by Newton's method.
    """
    fx, fy, fz, fw = q[0], q[1], q[2], q[3]
    p = np.empty((3, 3))
    for _ in range(ROUNDS):
        p[:] = 0.0
        for k in range(3):
            a, b, c = rotated(q[0], q[1], q[2], q[3], 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2))
            for i in range(3):
                p[i, 0] += m[i, k] * a
                p[i, 1] += m[i, k] * b
                p[i, 2] += m[i, k] * c
        x, y, z = newton_turn(p)
        angle = math.sqrt(x * x + y * y + z * z)
        if not angle > SETTLED or not angle < np.inf:
            break
        half = 0.5 * min(angle, 1.0)
        s, w = math.sin(half) / angle, math.cos(half)
        x, y, z = s * x, s * y, s * z
        q[0], q[1], q[2], q[3] = (
            w * q[0] + x * q[3] + y * q[2] - z * q[1],
            w * q[1] + y * q[3] + z * q[0] - x * q[2],
            w * q[2] + z * q[3] + x * q[1] - y * q[0],
            w * q[3] - x * q[0] - y * q[1] - z * q[2],
        )
        size = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        for k in range(4):
            q[k] *= size
    same = abs(q[0] * fx + q[1] * fy + q[2] * fz + q[3] * fw)
    return 2.0 * math.acos(min(same, 1.0))


@kernel
def fit(edges, weight, ways, points, chosen, attitude):
    """Turns the rotations of chosen nodes (N,) to those that take the ways of their edges best to what these are now.

    Returns by how many radians the one did that turned most.
    """
    moments = np.zeros((len(points), 3, 3))
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        for k in range(3):
            now = weight[e] * (points[j, k] - points[i, k])
            for m in range(3):
                more = now * ways[e, m]
                moments[i, k, m] += more
                moments[j, k, m] += more
    most = 0.0
    for i in range(len(points)):
        if chosen[i]:
            most = max(most, turn_towards(moments[i], attitude[i]))
    return most
