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
def list_nodes(first, corner, orientation, origin, chosen, apart, triangles, quads, fan_start, fan, start, around):
    """Writes the nodes around each chosen node, in CSR form.

    origin: (F,) the place of each face in the file, on which alone the order of cells depends. fan_start, fan: the
    neighbours of each chosen node in CSR form, counter-clockwise. start: (N + 1,) has where the nodes of each begin.
    apart: (N,) the nodes around are listed cell by cell: for each triangle the next two, and then for each quad the
    next three, counter-clockwise. Else a node has triangles alone, and they are its neighbours, or quads alone:
    neighbour and diagonal node in turn.

    Faces that are near in memory have near nodes, and those that are near in the file may not: so faces are gone
    through as they stand in memory, and the few at a node brought to the order of the file.
    """
    begin = np.empty(len(triangles) + 1, dtype=np.int64)  # of the corners at each node that is listed cell by cell
    begin[0] = 0
    for v in range(len(triangles)):
        begin[v + 1] = begin[v] + (triangles[v] + quads[v] if chosen[v] and apart[v] else 0)
        if chosen[v] and quads[v] == 0 and not apart[v]:
            for k in range(triangles[v]):
                around[start[v] + k] = fan[fan_start[v] + k]
    corners, end = np.empty(begin[len(triangles)], dtype=np.int64), begin[:-1].copy()  # 4·face + its corner
    for f in range(len(first) - 1):
        n = first[f + 1] - first[f]
        if n != 3 and n != 4:
            continue
        for h in range(first[f], first[f + 1]):
            v = corner[h]
            if not chosen[v] or (quads[v] == 0 and not apart[v]):
                continue
            if apart[v]:
                put_in_order(corners, begin[v], end[v], 4 * f + (h - first[f]), origin)
                end[v] += 1
                continue
            after, _ = around_corner(first, corner, orientation, f, h)
            k = 0
            while fan[fan_start[v] + k] != after:
                k += 1
            around[start[v] + 2 * k], around[start[v] + 2 * k + 1] = after, corner[across(first, f, h)]
    for v in range(len(triangles)):
        at, quad = np.int64(start[v]), np.int64(start[v]) + 2 * triangles[v]
        for k in range(begin[v], begin[v + 1]):
            f = corners[k] // 4
            h = first[f] + corners[k] % 4
            after, before = around_corner(first, corner, orientation, f, h)
            if first[f + 1] - first[f] == 3:
                around[at], around[at + 1] = after, before
                at += 2
            else:
                around[quad], around[quad + 1], around[quad + 2] = after, corner[across(first, f, h)], before
                quad += 3


@inlined
def across(first, f, h):
    """The corner of quad f that is not next to its corner h."""
    return h + 2 if h + 2 < first[f + 1] else h - 2


@inlined
def put_in_order(corners, begin, end, new, origin):
    """Puts a corner among those from begin to end, which stand as their faces do in the file."""
    k, place = end, origin[new // 4]
    while k > begin and origin[corners[k - 1] // 4] > place:
        corners[k] = corners[k - 1]
        k -= 1
    corners[k] = new


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


@kernel
def rows_of_cells_with(rows, cells, chosen):
    """The places (int32, ascending) of all corner simplices of the cells that have a chosen node. chosen: (N,)."""
    found = np.empty(len(rows), dtype=np.int32)
    count = t = 0
    while t < len(rows):
        end, has = t, False
        while end < len(rows) and cells[end] == cells[t]:
            has |= chosen[rows[end, 0]] | chosen[rows[end, 1]] | chosen[rows[end, 2]]
            end += 1
        for k in range(t, end):
            found[count] = k
            count += has
        t = end
    return found[:count].copy()


@kernel
def take(taken, rows, orientation, shapes, cells, to_rows, to_orientation, to_shapes, to_cells):
    """Writes some corner simplices, by their places ``taken``, one after the other."""
    for k in range(len(taken)):
        t = np.uint32(taken[k])
        for corner in range(3):
            to_rows[k, corner] = rows[t, corner]
        to_orientation[k], to_shapes[k], to_cells[k] = orientation[t], shapes[t], cells[t]
