"""How far the nodes of a hexahedron or a wedge may go before its Jacobian determinant has to be looked at again.

det J is a product of three vectors U, V and W, means of the edges along the three axes of the cell. On a hexahedron it
has 27 Bernstein coefficients, 9 on a wedge, all of them means of determinants of three edges. With m the largest
component of an edge, and coordinates known up to ±δ, these are off by 128u·m³ + δ(80m² + δ(160m + 100δ)) at most: a
determinant by 50u·m³ for its rounding and 36δm² + 72δ²m + 48δ³ (kernels.simplex.orientation3), their sums by as much.

An edge changes by 2e at most while no node has gone further than e in all, and so do U, V and W. det J then changes by
(L + 2e)³ − L³ at most, L the longest edge before. With a lower bound b of det J the *slack* is the e at which that is
0.9b: so far no node makes the cell invalid. The tenth left of b, and four times the error bound, cover the growth of
that bound: L + 2e is below 1.24 L, the largest component below 1.43 times what it was.
"""

from __future__ import annotations

import math
from functools import partial, reduce
from typing import Any

import numpy as np

from gmsnet.kernels.jit import vectors
from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.simplex.cube_root import cube_root
from gmsnet.kernels.simplex.mean_ratio3 import HEXAHEDRON
from gmsnet.kernels.simplex.predicates import UNDERFLOW, UNIT

# The ends and starts of edges along the axes: of U by V's and W's side, of V by U's and W's, of W by U's and V's.
HEXAHEDRON_EDGES = np.array([
    (1, 0), (5, 4), (2, 3), (6, 7), (3, 0), (7, 4), (2, 1), (6, 5), (4, 0), (7, 3), (5, 1), (6, 2),
])  # fmt: skip
WEDGE_EDGES = np.array([(1, 0), (4, 3), (2, 0), (5, 3), (3, 0), (4, 1), (5, 2)])  # U and V by the side, W by the corner
MOST = 12  # edges
CELLS = 8  # that are looked at together
PLACES, LEAST, LARGEST, LONGEST, REACH, SLACK, ALONE = 0, 24, 25, 26, 27, 28, 29  # rows of CELLS numbers
FOR_ONE = 72  # numbers to work with, of a cell alone


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


@inlined
def lesser(one, other):
    """The smaller of two numbers; what is not a number stays so."""
    return other if other < one or other != other else one


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
                least = lesser(least, share * total)
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

    work: (FOR_ONE,). Other arguments: see validity3.certified_solid.
    """
    e, cross = work[:36], work[36:72]
    table = HEXAHEDRON_EDGES if is_hexahedron else WEDGE_EDGES
    m, longest, reach = edges_of(points, nodes, table, moved, x, y, z, e)
    least = least_of_hexahedron(e, cross) if is_hexahedron else least_of_wedge(e)
    return slack_from(least, m, longest, reach, unit, grain)


@inlined
def slack_from(least, m, longest, reach, unit, grain):
    """The same from the least coefficient, and from what ``edges_of`` returns."""
    delta = unit * reach + grain
    bound = 128.0 * UNIT * m * m * m + UNDERFLOW + delta * (80.0 * m * m + delta * (160.0 * m + 100.0 * delta))
    certain, length = 0.9 * (least - 4.0 * bound), math.sqrt(longest)
    slack = 0.4999 * (cube_root(length * length * length + certain) - length)
    slack = slack if certain > 0.0 else 0.0
    return slack if least > bound else -1.0


@part
def slacks_of(points, solids, cells, numbers, count, unit, grain, moved, x, y, z, work):
    """The slack of the first ``count`` of CELLS hexahedra and wedges, into the row SLACK of a workspace.

    work: (ALONE·CELLS + FOR_ONE,). numbers: (CELLS,) of the cells in ``cells``. Other arguments: see ``slack_of``.
    """
    hexahedra = 0
    for lane in range(count):
        hexahedra += solids.kind[cells[numbers[lane]]] == HEXAHEDRON
    if hexahedra > 0:
        for lane in range(CELLS):
            cell = cells[numbers[min(lane, count - 1)]]
            for j in range(8):
                i = np.uint32(solids.nodes[cell, j])
                px, py, pz = points[i, 0], points[i, 1], points[i, 2]
                if i == moved:
                    px, py, pz = x, y, z
                at = (PLACES + 3 * j) * CELLS + lane
                work[at], work[at + CELLS], work[at + 2 * CELLS] = px, py, pz
        look_at_hexahedra(work)
        for lane in range(CELLS):
            work[SLACK * CELLS + lane] = slack_from(
                work[LEAST * CELLS + lane], work[LARGEST * CELLS + lane], work[LONGEST * CELLS + lane],
                work[REACH * CELLS + lane], unit, grain,
            )  # fmt: skip
    for lane in range(count):
        cell = cells[numbers[lane]]
        if solids.kind[cell] != HEXAHEDRON:
            alone = work[ALONE * CELLS :]
            work[SLACK * CELLS + lane] = slack_of(points, solids.nodes[cell], False, unit, grain, moved, x, y, z, alone)


@partial(vectors.lanewise, width=CELLS)
def look_at_hexahedra(lanes: vectors.Lanes, work: Any) -> Any:
    """The least coefficient of hexahedra, and what ``edges_of`` returns, of the coordinates from row PLACES on.

    work: rows of one number of each cell. The same bits as of one cell alone.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        base = vectors.data_of(context, builder, signature.args[0], arguments[0])
        place = [lanes.load_double(builder, base, PLACES + k) for k in range(24)]
        edges = [place[3 * i + axis] - place[3 * j + axis] for i, j in HEXAHEDRON_EDGES for axis in range(3)]
        squares = [x * x + y * y + z * z for x, y, z in zip(edges[::3], edges[1::3], edges[2::3], strict=True)]
        found = {
            LEAST: vectors.as_written(least_of_hexahedron, lesser=vectors.lesser)(edges, [0.0] * 36),
            LARGEST: reduce(vectors.larger, [edge.size() for edge in edges]),
            LONGEST: reduce(vectors.larger, squares),
            REACH: reduce(vectors.larger, [each.size() for each in place]),
        }
        for row, value in found.items():
            lanes.store_double(base, row, value)
        return context.get_dummy_value()

    return lanes.types.void(work), generate
