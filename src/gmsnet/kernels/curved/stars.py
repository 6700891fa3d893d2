"""Second-order planar meshes as kernels see them: cells and edges around each node, and the offsets of middle nodes.

The middle m of an edge from a to b is kept as the complex number ρ = (m − (a + b)/2)/(b − a). It says how far m is off
the straight edge, in a frame that turns and grows with the edge. The centre of a nine-node quad is kept in the same
way: its offset from the place of an eight-node quad's centre, over f = (p₂ − p₀) − i(p₃ − p₁). A quad of positive area
has f ≠ 0: f is the part of its linear map that keeps angles. Where the divisor is zero, ρ is zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.bernstein import CORNERS, NODES, QUAD9, WIDEST

NO_EDGE = -1
CENTRE = 8  # the place of the centre in a nine-node quad
REVERSED = (  # the nodes of each kind, read the other way round
    (0, 2, 1, 5, 4, 3), (0, 3, 2, 1, 7, 6, 5, 4), (0, 3, 2, 1, 7, 6, 5, 4, 8), (0, 2, 1), (0, 3, 2, 1),
)  # fmt: skip


class CurvedMesh(NamedTuple):
    """Cells, and what is around each node.

    cells: (C, 9), counter-clockwise, −1 past the last node. kinds: (C,) see kernels.simplex.bernstein.
    cell_start, cell_of: CSR by node, the cells around corners, middles and centres. edge_start, edge_of: CSR by node,
    the edges around corners. edges: (E, 3) start, end and middle. dragged: (E,) whether the middle goes along when an
    end moves. edge_of_middle: (N,) NO_EDGE where a node is no middle. ratio: (E, 2) ρ of edges; centre_ratio: (C, 2) ρ
    of centres. centre_dragged: (C,). corner: (N,) which nodes are corners.
    """

    cells: NDArray[np.int32]
    kinds: NDArray[np.int8]
    cell_start: NDArray[np.int64]
    cell_of: NDArray[np.int32]
    edge_start: NDArray[np.int64]
    edge_of: NDArray[np.int32]
    edges: NDArray[np.int32]
    dragged: NDArray[np.bool_]
    edge_of_middle: NDArray[np.int32]
    ratio: NDArray[np.float64]
    centre_dragged: NDArray[np.bool_]
    centre_ratio: NDArray[np.float64]
    corner: NDArray[np.bool_]


def curved_mesh(
    points: NDArray[np.float64], cells: NDArray[np.int32], kinds: NDArray[np.int8], held: NDArray[np.bool_]
) -> CurvedMesh:
    """A mesh of second-order cells with the offsets that ``points`` (N, 2) have, and first-order cells beside them.

    cells, kinds: see CurvedMesh. held: (N,) nodes that stay whatever moves. A middle goes along if its edge is in two
    cells, which agree on its ends, and it is not held: middles on the boundary stay, and so do those that the caller
    holds (interfaces, markers). One of the two cells may be of first order; its edge is straight.
    """
    rows, places, ends, straight = [], [], [], [np.empty((0, 2), dtype=cells.dtype)]
    corner = np.zeros(len(points), dtype=bool)
    for kind in range(len(CORNERS)):
        of_kind = np.flatnonzero(kinds == kind)
        corner[cells[of_kind, : CORNERS[kind]]] = True
        for k in range(CORNERS[kind]):
            after = (k + 1) % CORNERS[kind]
            if NODES[kind] > CORNERS[kind]:
                ends.append(cells[of_kind][:, [k, after, CORNERS[kind] + k]])
            else:
                straight.append(cells[of_kind][:, [k, after]])
    for k in range(WIDEST):
        of_place = np.flatnonzero(cells[:, k] >= 0)
        rows.append(of_place)
        places.append(cells[of_place, k])
    cell_start, cell_of = _by_node(np.concatenate(places), np.concatenate(rows), len(points))
    uses = np.concatenate(ends)
    _, first, number, count = np.unique(uses[:, 2], return_index=True, return_inverse=True, return_counts=True)
    pairs = np.sort(uses[:, :2], axis=1)
    torn = np.bincount(number[(pairs != pairs[first][number]).any(axis=1)], minlength=len(first)) > 0
    edges = np.ascontiguousarray(uses[first], dtype=np.int32)
    numbers = np.arange(len(edges))
    edge_start, edge_of = _by_node(edges[:, :2].T.ravel(), np.concatenate([numbers, numbers]), len(points))
    edge_of_middle = np.full(len(points), NO_EDGE, dtype=np.int32)
    edge_of_middle[edges[:, 2]] = numbers
    beside = _uses_of(np.sort(np.concatenate(straight), axis=1), pairs[first], len(points))
    dragged = (count + beside == 2) & ~torn & ~held[edges[:, 2]]
    made = CurvedMesh(
        np.ascontiguousarray(cells, dtype=np.int32), np.ascontiguousarray(kinds, dtype=np.int8), cell_start, cell_of,
        edge_start, edge_of, edges, dragged, edge_of_middle, np.zeros((len(edges), 2)),
        (kinds == QUAD9) & ~held[cells[:, CENTRE]], np.zeros((len(cells), 2)), corner,
    )  # fmt: skip
    remember_all(np.ascontiguousarray(points, dtype=np.float64), made)
    return made


def _uses_of(pairs: NDArray[np.int32], wanted: NDArray[np.int32], nodes: int) -> NDArray[np.int64]:
    """How often each of the wanted pairs of nodes (E, 2) is among some (K, 2), the lesser node first in both."""
    known, key = (each[:, 0].astype(np.int64) * nodes + each[:, 1] for each in (pairs, wanted))
    known.sort()
    return np.searchsorted(known, key, side="right") - np.searchsorted(known, key, side="left")


def _by_node(
    nodes: NDArray[np.int32], items: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """CSR: for each node the items that stand beside it, in ascending order."""
    order = np.lexsort((items, nodes))
    return np.searchsorted(nodes[order], np.arange(count + 1)), items[order].astype(np.int32)


def counter_clockwise(
    cells: NDArray[np.int32], kinds: NDArray[np.int8], turned: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """The table of cells with those that are wound clockwise (``turned``) read the other way round."""
    made = cells.copy()
    for kind, order in enumerate(REVERSED):
        rows = np.flatnonzero(turned & (kinds == kind))
        made[rows[:, None], np.arange(NODES[kind])] = cells[rows][:, list(order)]
    return made


@kernel
def remember_all(points, mesh):
    """Stores the offsets of all middles and centres as they are."""
    for e in range(len(mesh.edges)):
        remember_middle(points, mesh, e)
    for c in range(len(mesh.cells)):
        if mesh.kinds[c] == QUAD9:
            remember_centre(points, mesh, c)


@part
def remember_middle(points, mesh, e):
    """Stores the offset of the middle of an edge."""
    a, b, m = mesh.edges[e, 0], mesh.edges[e, 1], mesh.edges[e, 2]
    x = points[m, 0] - 0.5 * (points[a, 0] + points[b, 0])
    y = points[m, 1] - 0.5 * (points[a, 1] + points[b, 1])
    store_ratio(mesh.ratio, e, x, y, points[b, 0] - points[a, 0], points[b, 1] - points[a, 1])


@part
def remember_centre(points, mesh, c):
    """Stores the offset of the centre of a nine-node quad."""
    x, y = serendipity(points, mesh.cells, c)
    i = mesh.cells[c, CENTRE]
    fx, fy = frame(points, mesh.cells, c)
    store_ratio(mesh.centre_ratio, c, points[i, 0] - x, points[i, 1] - y, fx, fy)


@part
def store_ratio(ratio, k, x, y, dx, dy):
    """ratio[k] = (x + iy)/(dx + idy), zero where the divisor is."""
    square = dx * dx + dy * dy
    if square > 0.0:
        ratio[k, 0], ratio[k, 1] = (x * dx + y * dy) / square, (y * dx - x * dy) / square
    else:
        ratio[k, 0], ratio[k, 1] = 0.0, 0.0


@inlined
def serendipity(points, cells, c):
    """The centre of the eight-node quad with the same outline: (2 Σm − Σp)/4."""
    x, y = 0.0, 0.0
    for k in range(4):
        p, m = cells[c, k], cells[c, 4 + k]
        x += 0.5 * points[m, 0] - 0.25 * points[p, 0]
        y += 0.5 * points[m, 1] - 0.25 * points[p, 1]
    return x, y


@inlined
def frame(points, cells, c):
    """f = (p₂ − p₀) − i(p₃ − p₁) of a quad."""
    p, q, r, s = cells[c, 0], cells[c, 1], cells[c, 2], cells[c, 3]
    fx = (points[r, 0] - points[p, 0]) + (points[s, 1] - points[q, 1])
    fy = (points[r, 1] - points[p, 1]) - (points[s, 0] - points[q, 0])
    return fx, fy


@inlined
def drag_middle(points, mesh, e, single):
    """Puts the middle of an edge where its stored offset says: (a + b)/2 + ρ(b − a)."""
    a, b, m = mesh.edges[e, 0], mesh.edges[e, 1], mesh.edges[e, 2]
    dx, dy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    x = 0.5 * (points[a, 0] + points[b, 0]) + (mesh.ratio[e, 0] * dx - mesh.ratio[e, 1] * dy)
    y = 0.5 * (points[a, 1] + points[b, 1]) + (mesh.ratio[e, 0] * dy + mesh.ratio[e, 1] * dx)
    put(points, m, x, y, single)


@inlined
def drag_centre(points, mesh, c, single):
    """Puts the centre of a nine-node quad where its stored offset says."""
    x, y = serendipity(points, mesh.cells, c)
    fx, fy = frame(points, mesh.cells, c)
    x += mesh.centre_ratio[c, 0] * fx - mesh.centre_ratio[c, 1] * fy
    y += mesh.centre_ratio[c, 0] * fy + mesh.centre_ratio[c, 1] * fx
    put(points, mesh.cells[c, CENTRE], x, y, single)


@inlined
def put(points, i, x, y, single):
    """Writes a node's coordinates, rounded to single precision where the file keeps that."""
    if single:
        x, y = np.float64(np.float32(x)), np.float64(np.float32(y))
    points[i, 0], points[i, 1] = x, y


@inlined
def place(points, mesh, i, x, y, single):
    """Puts a node at (x, y), and what it drags along: middles of its edges, then centres of its cells."""
    put(points, i, x, y, single)
    for k in range(mesh.edge_start[i], mesh.edge_start[i + 1]):
        e = mesh.edge_of[k]
        if mesh.dragged[e]:
            drag_middle(points, mesh, e, single)
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c = mesh.cell_of[k]
        if mesh.centre_dragged[c] and mesh.cells[c, CENTRE] != i:
            drag_centre(points, mesh, c, single)


@part
def remember(points, mesh, i):
    """Stores the offset of a middle or a centre that has moved by itself."""
    e = mesh.edge_of_middle[i]
    if e != NO_EDGE:
        remember_middle(points, mesh, e)
    for k in range(mesh.cell_start[i], mesh.cell_start[i + 1]):
        c = mesh.cell_of[k]
        if mesh.kinds[c] == QUAD9 and mesh.cells[c, CENTRE] == i:
            remember_centre(points, mesh, c)


@kernel
def dragged(points, mesh, nodes, targets, single):
    """Puts nodes (K,) at targets (K, 2), one after the other, with what they drag along. Nothing is judged."""
    for k in range(len(nodes)):
        place(points, mesh, nodes[k], targets[k, 0], targets[k, 1], single)
