"""The stars of meshes that are not all triangles: the nodes around each node, and the corner simplices of cells.

Faces are polygons in CSR form: face f has the corners corner[first[f] : first[f + 1]]. Those of three and of four
corners are listed; orientation (F,) is −1 where a face is read backwards.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel
from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL, SQUARE


@kernel
def count_cells(first, corner, chosen, triangles, quads):
    """Adds to (N,) how many triangles, and how many quads, each chosen node has."""
    for f in range(len(first) - 1):
        n = first[f + 1] - first[f]
        for h in range(first[f], first[f + 1]):
            v = corner[h]
            if chosen[v]:
                triangles[v] += n == 3
                quads[v] += n == 4


@inlined
def around_corner(first, corner, orientation, f, h):
    """The nodes after and before corner h of face f, as it is read."""
    low, high = first[f], first[f + 1]
    after, before = corner[h + 1 if h + 1 < high else low], corner[h - 1 if h > low else high - 1]
    if orientation[f] < 0:
        return before, after
    return after, before


@kernel
def list_nodes(first, corner, orientation, order, chosen, apart, triangles, quads, fan_start, fan, start, around):
    """Writes the nodes around each chosen node, in CSR form.

    order: (F,) the faces in the order of the file, on which alone the order of cells depends. fan_start, fan: the
    neighbours of each chosen node in CSR form, counter-clockwise. start: (N + 1,) has where the nodes of each begin.
    apart: (N,) the nodes around are listed cell by cell: for each triangle the next two, and then for each quad the
    next three, counter-clockwise. Else a node has triangles alone, and they are its neighbours, or quads alone:
    neighbour and diagonal node in turn.
    """
    at = np.empty((2, len(triangles)), dtype=np.int64)
    for v in range(len(triangles)):
        at[0, v] = start[v]
        at[1, v] = start[v] + 2 * triangles[v]
        if chosen[v] and quads[v] == 0 and not apart[v]:
            for k in range(triangles[v]):
                around[start[v] + k] = fan[fan_start[v] + k]
    for f in order:
        n = first[f + 1] - first[f]
        if n != 3 and n != 4:
            continue
        for h in range(first[f], first[f + 1]):
            v = corner[h]
            if not chosen[v] or (quads[v] == 0 and not apart[v]):
                continue
            after, before = around_corner(first, corner, orientation, f, h)
            if n == 3:
                around[at[0, v]], around[at[0, v] + 1] = after, before
                at[0, v] += 2
                continue
            diagonal = corner[h + 2 if h + 2 < first[f + 1] else h - 2]
            if not apart[v]:
                k = 0
                while fan[fan_start[v] + k] != after:
                    k += 1
                around[start[v] + 2 * k], around[start[v] + 2 * k + 1] = after, diagonal
            else:
                around[at[1, v]], around[at[1, v] + 1], around[at[1, v] + 2] = after, diagonal, before
                at[1, v] += 3


@kernel
def corner_simplices(first, corner, orientation, rows, shapes, cells):
    """Writes the corner simplices of all triangles and quads, counter-clockwise; returns how many.

    rows: (S, 3), the corner first, with room for one a triangle and four a quad. shapes, cells: (S,).
    """
    found = 0
    for f in range(len(first) - 1):
        n = first[f + 1] - first[f]
        if n != 3 and n != 4:
            continue
        for h in range(first[f], first[f] + (1 if n == 3 else 4)):
            after, before = around_corner(first, corner, orientation, f, h)
            rows[found, 0], rows[found, 1], rows[found, 2] = corner[h], after, before
            shapes[found], cells[found] = EQUILATERAL if n == 3 else SQUARE, f
            found += 1
    return found
