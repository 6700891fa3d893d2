"""How far the nodes of a hexahedron or a wedge may go before its Jacobian determinant has to be looked at again.

det J is a product of three vectors U, V and W, means of the edges along the three axes of the cell. On a hexahedron it
has 27 Bernstein coefficients, 9 on a wedge, all of them means of determinants of three edges. With m the largest
component of an edge, and coordinates known up to ±δ, these are off by 128u·m³ + δ(80m² + δ(160m + 100δ)) at most: a
determinant by 50u·m³ for its rounding and 36δm² + 72δ²m + 48δ³ (kernels.simplex.orientation3), their sums by as much.

One node that goes by d changes each of U, V and W by d at most, times a factor, and det J is linear in d, for products
with two of these changes vanish. So det J changes by 3L²|d| at most, L the longest edge, and while nodes go s in all,
by 3(L + s)²s. With a lower bound b of det J, s = 0.9b/3(L + s₀)², s₀ = 0.9b/3L², is the *slack*: so far no node makes
the cell invalid. The tenth left of b, and four times the error bound, cover the growth of that bound: s is below 0.3 L.
"""

from __future__ import annotations

import math

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex.predicates import UNDERFLOW, UNIT

# The ends and starts of edges along the axes: of U by V's and W's side, of V by U's and W's, of W by U's and V's.
HEXAHEDRON_EDGES = np.array([
    (1, 0), (5, 4), (2, 3), (6, 7), (3, 0), (7, 4), (2, 1), (6, 5), (4, 0), (7, 3), (5, 1), (6, 2),
])  # fmt: skip
WEDGE_EDGES = np.array([(1, 0), (4, 3), (2, 0), (5, 3), (3, 0), (4, 1), (5, 2)])  # U and V by the side, W by the corner
MOST = 12  # edges


@inlined
def dot_cross(e, i, j, k):
    """The determinant of three edges."""
    ax, ay, az = e[3 * i], e[3 * i + 1], e[3 * i + 2]
    bx, by, bz = e[3 * j], e[3 * j + 1], e[3 * j + 2]
    cx, cy, cz = e[3 * k], e[3 * k + 1], e[3 * k + 2]
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


@inlined
def add_cross(e, i, j, share, out, k):
    """Adds share·(edge i × edge j) to the vector k of ``out``."""
    ax, ay, az = share * e[3 * i], share * e[3 * i + 1], share * e[3 * i + 2]
    bx, by, bz = e[3 * j], e[3 * j + 1], e[3 * j + 2]
    out[3 * k] += ay * bz - az * by
    out[3 * k + 1] += az * bx - ax * bz
    out[3 * k + 2] += ax * by - ay * bx


@part
def edges_of(points, nodes, table, moved, x, y, z, e):
    """Writes the edges of a cell, with one node at another place, into e (36,).

    Returns the largest component of all, the longest edge squared, and the largest coordinate.
    """
    m, longest, reach = 0.0, 0.0, 0.0
    for k in range(len(table)):
        i, j = nodes[table[k, 0]], nodes[table[k, 1]]
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        qx, qy, qz = points[j, 0], points[j, 1], points[j, 2]
        if i == moved:
            px, py, pz = x, y, z
        if j == moved:
            qx, qy, qz = x, y, z
        reach = max(reach, max(max(abs(px), abs(py)), abs(pz)))
        reach = max(reach, max(max(abs(qx), abs(qy)), abs(qz)))
        px, py, pz = px - qx, py - qy, pz - qz
        e[3 * k], e[3 * k + 1], e[3 * k + 2] = px, py, pz
        m = max(m, max(max(abs(px), abs(py)), abs(pz)))
        longest = max(longest, px * px + py * py + pz * pz)
    return m, longest, reach


@part
def least_of_hexahedron(e, cross):
    """The least of the 27 coefficients, from the edges. cross: (36,) to work with."""
    for k in range(36):
        cross[k] = 0.0
    for a in range(2):  # of U × V, by the sides of V along U and of U along V: three along W
        for b in range(2):
            at, u, v = 3 * (2 * a + b), 2 * b, 4 + 2 * a
            add_cross(e, u, v, 1.0, cross, at)
            add_cross(e, u, v + 1, 0.5, cross, at + 1)
            add_cross(e, u + 1, v, 0.5, cross, at + 1)
            add_cross(e, u + 1, v + 1, 1.0, cross, at + 2)
    least = np.inf
    for c in range(3):
        for i in range(3):
            for j in range(3):
                total = 0.0
                for a in range(max(0, i - 1), min(1, i) + 1):
                    for b in range(max(0, j - 1), min(1, j) + 1):
                        at, w = 3 * (3 * (2 * a + b) + c), 3 * (8 + 2 * (i - a) + (j - b))
                        total += cross[at] * e[w] + cross[at + 1] * e[w + 1] + cross[at + 2] * e[w + 2]
                share = (0.5 if i == 1 else 1.0) * (0.5 if j == 1 else 1.0)
                least = min(least, share * total) if total == total else -np.inf
    return least


@part
def least_of_wedge(e):
    """The least of the 9 coefficients, from the edges."""
    least = np.inf
    for w in range(4, 7):
        middle = 0.5 * (dot_cross(e, 0, 3, w) + dot_cross(e, 1, 2, w))
        least = min(least, min(dot_cross(e, 0, 2, w), min(middle, dot_cross(e, 1, 3, w))))
        least = least if middle == middle else -np.inf
    return least


@part
def slack_of(points, nodes, is_hexahedron, unit, grain, moved, x, y, z, work):
    """The slack of a hexahedron or a wedge of positive sense, with one node at another place; −1 if it is not certain.

    work: (72,). Other arguments: see validity3.certified_solid.
    """
    e, cross = work[:36], work[36:72]
    table = HEXAHEDRON_EDGES if is_hexahedron else WEDGE_EDGES
    m, longest, reach = edges_of(points, nodes, table, moved, x, y, z, e)
    least = least_of_hexahedron(e, cross) if is_hexahedron else least_of_wedge(e)
    delta = unit * reach + grain
    bound = 128.0 * UNIT * m * m * m + UNDERFLOW + delta * (80.0 * m * m + delta * (160.0 * m + 100.0 * delta))
    if not least > bound:
        return -1.0
    certain = 0.9 * (least - 4.0 * bound)
    if not certain > 0.0:
        return 0.0
    length = math.sqrt(longest)
    far = certain / (3.0 * longest) + length
    return certain / (3.0 * far * far)
