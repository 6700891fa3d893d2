"""Groups of cells that cannot all be better than a bound, found all at once in arrays (proofs:
gmsnet.measure.bounds.bounds)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.bounds.apexes import FEW, ROOT3, best_apex, best_apex_of_many, meet, starts

Floats = NDArray[np.float64]
Places = NDArray[np.intp]
Flags = NDArray[np.bool_]

HELD, FREE_CORNER, CORNER, RING, HELD_CORNER = range(5)  # kinds of groups
OF_ONE_CELL = (HELD, HELD_CORNER)
NOWHERE = -1  # no node
ABOVE = 1e-6  # what is added to a bound for rounding


class Groups(NamedTuple):
    """kind, node (NOWHERE where there is none), angle (of a corner, radians) and bound: (G,).

    Those of group g are rows[first[g] : first[g + 1]] of the triangles.
    """

    kind: NDArray[np.int8]
    node: Places
    angle: Floats
    bound: Floats
    first: Places
    rows: Places

    @classmethod
    def of(cls, kind: int, node: Places, angle: Floats, bound: Floats, count: Places, rows: Places) -> Groups:
        """Of one kind; count: (G,) cells in each."""
        return cls(np.full(len(node), kind, dtype=np.int8), node, angle, bound, starts(count), rows)

    @classmethod
    def joined(cls, parts: list[Groups]) -> Groups:
        """All of them, those with the minimum bounds first, then by nodes."""
        kind, node, angle, bound = (np.concatenate([part[k] for part in parts]) for k in range(4))
        count = np.concatenate([np.diff(part.first) for part in parts])
        rows = np.concatenate([part.rows for part in parts])
        order = np.lexsort((node, bound))
        source = spread(starts(count)[:-1][order], count[order])
        return cls(kind[order], node[order], angle[order], bound[order], starts(count[order]), rows[source])


class Corners(NamedTuple):
    """Corners (K,) of triangles, those of one node in a row: (node, left, right) is counter-clockwise where D > 0."""

    node: Places
    row: Places
    left: Places
    right: Places

    def taken(self, chosen: Flags | Places) -> Corners:
        """Some of them."""
        return Corners(*(each[chosen] for each in self))


def spread(first: Places, count: Places) -> Places:
    """first[0], first[0] + 1, … count[0] of them, then from first[1] on, and so on."""
    return np.repeat(first - starts(count)[:-1], count) + np.arange(count.sum())


def best_with_corner(angle: Floats) -> Floats:
    """1/q of the best triangle that has a corner of this angle: √3 sin θ/(2 − cos θ), 0 from 180° on."""
    return np.where(angle < math.pi, ROOT3 * np.sin(angle) / (2.0 - np.cos(angle)), 0.0)


def collect(
    points: Floats, triangles: NDArray[np.int32], orientation: NDArray[np.int8], free: Flags, below: float
) -> Groups:
    """All groups with a bound less than ``below``. points: (N, 2). triangles: (T, 3). orientation: (T,) ±1. free:
    (N,)."""
    may = free[triangles]
    number = may[:, 0].astype(np.int8) + may[:, 1] + may[:, 2]
    degree = np.bincount(triangles.ravel(), minlength=len(free))
    full = best_with_corner(2.0 * math.pi / np.maximum(degree, 1))
    crowded = free & (degree > 0) & (full < below)
    some = np.flatnonzero((number > 0) & (number < 3))
    beside = np.zeros(len(free), dtype=bool)
    beside[triangles[some][~may[some]]] = True
    alone = triangles[number == 1][may[number == 1]]  # free nodes with an opposite edge that is held
    beside |= np.bincount(alone, minlength=len(free)) > 1
    around = corners_at(crowded | beside, triangles, orientation)
    return Groups.joined(
        [
            held_cells(points, triangles, orientation, np.flatnonzero(number == 0), below),
            full_turns(around, crowded, degree, full),
            *rings(points, around, free, below),
            between_held_edges(points, around, free, below),
        ]
    )


def corners_at(chosen: Flags, triangles: NDArray[np.int32], orientation: NDArray[np.int8]) -> Corners:
    """The corners at the chosen nodes (N,)."""
    row, corner = np.nonzero(chosen[triangles])
    order = np.argsort(triangles[row, corner], kind="stable")
    row, corner = row[order], corner[order]
    node, left, right = (triangles[row, (corner + k) % 3].astype(np.intp) for k in range(3))
    back = orientation[row] < 0
    return Corners(node, row, np.where(back, right, left), np.where(back, left, right))


def held_cells(
    points: Floats, triangles: NDArray[np.int32], orientation: NDArray[np.int8], rows: Places, below: float
) -> Groups:
    """Cells (rows) all of whose nodes are held."""
    a, b, c = (points[triangles[rows, k]] for k in range(3))
    u, v = b - a, c - a
    lengths = 2.0 * (u * u + v * v - u * v).sum(axis=1)
    double = orientation[rows] * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    bound = np.divide(2.0 * ROOT3 * double, lengths, out=np.zeros(len(rows)), where=lengths > 0.0)
    rows, bound = rows[bound < below], bound[bound < below]
    ones = np.ones(len(rows), dtype=np.intp)
    return Groups.of(HELD, np.full(len(rows), NOWHERE), np.zeros(len(rows)), bound, ones, rows)


def full_turns(around: Corners, crowded: Flags, degree: Places, full: Floats) -> Groups:
    """All cells around free nodes with so many of them that ``full`` is the most that all can have."""
    nodes = np.flatnonzero(crowded)
    rows = around.row[crowded[around.node]]
    return Groups.of(FREE_CORNER, nodes, np.full(len(nodes), 2.0 * math.pi), full[nodes], degree[nodes], rows)


def rings(points: Floats, around: Corners, free: Flags, below: float) -> Iterator[Groups]:
    """The cells around each free node whose opposite edges are held, if there are two or more; by their number."""
    edges = around.taken(free[around.node] & ~free[around.left] & ~free[around.right])
    nodes, first, count = np.unique(edges.node, return_index=True, return_counts=True)
    yield large_rings(points, edges, count, below)
    for number in np.unique(count[(count > 1) & (count <= FEW)]).tolist():
        chosen = count == number
        at = first[chosen][:, None] + np.arange(number)
        start, end = points[edges.left[at]], points[edges.right[at]]
        middle, along = start - start[:, :1] + 0.5 * (end - start), end - start
        upright = np.stack([-along[..., 1], along[..., 0]], axis=-1)
        tight = np.flatnonzero(~meet(middle, upright, np.full(len(at), below - ABOVE)))
        bound = best_apex(middle[tight], upright[tight]) + ABOVE
        tight, bound = tight[bound < below], bound[bound < below]
        yield Groups.of(
            RING, nodes[chosen][tight], np.zeros(len(tight)), bound, np.full(len(tight), number),
            edges.row[at[tight]].ravel(),
        )  # fmt: skip


def large_rings(points: Floats, edges: Corners, count: Places, below: float) -> Groups:
    """Of ``rings``, those of more than FEW edges. count: (nodes,) of the edges, those of one node in a row."""
    edges = edges.taken(np.repeat(count > FEW, count))
    count = count[count > FEW]
    first = starts(count)
    begin, end = points[edges.left], points[edges.right]
    along = end - begin
    middle = begin - np.repeat(begin[first[:-1]], count, axis=0) + 0.5 * along
    upright = np.column_stack([-along[:, 1], along[:, 0]])
    bound = best_apex_of_many(middle, upright, first, below - ABOVE) + ABOVE
    tight = bound < below
    return Groups.of(
        RING, edges.node[first[:-1][tight]], np.zeros(np.count_nonzero(tight)), bound[tight], count[tight],
        edges.row[np.repeat(tight, count)],
    )  # fmt: skip


def between_held_edges(points: Floats, around: Corners, free: Flags, below: float) -> Groups:
    """The cells between two neighbouring held edges at a held node, or all around it."""
    fans = around.taken(~free[around.node])
    onward, torn = successors(fans, len(free))
    held = ~free[fans.left]
    heads = np.flatnonzero(np.diff(fans.node, prepend=NOWHERE))
    whole = ~np.logical_or.reduceat(held, heads) if len(heads) else np.zeros(0, dtype=bool)  # no edge there is held
    held[heads[whole]] = True
    begin = np.flatnonzero(held & ~np.isin(fans.node, torn))
    chain, at = np.arange(len(begin)), begin
    members, ends = [(chain, at)], np.full(len(begin), NOWHERE)
    while len(at):
        end = fans.right[at]
        over = (end == fans.left[begin[chain]]) | ~free[end]
        ends[chain[over]] = end[over]
        further = ~over & (onward[at] >= 0)  # an end that is not held is no end: nothing is known
        chain, at = chain[further], onward[at[further]]
        members.append((chain, at))
    chain, at = (np.concatenate(each) for each in zip(*members, strict=True))
    order = np.argsort(chain, kind="stable")
    count = np.bincount(chain, minlength=len(begin))
    node, start = fans.node[begin], fans.left[begin]
    u, v = points[start] - points[node], points[np.maximum(ends, 0)] - points[node]
    angle = np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(axis=1))
    angle[angle < 1e-9] += 2.0 * math.pi  # next to 0 it cannot be told from a full turn, for which the bound is larger
    angle[ends == start] = 2.0 * math.pi
    bound = best_with_corner(angle / np.maximum(count, 1)) + ABOVE
    kept = (ends != NOWHERE) & (count > 1) & (bound < below)  # a cell by itself is of the kind HELD
    rows = fans.row[at[order]][kept[chain[order]]]
    return Groups.of(CORNER, node[kept], angle[kept], bound[kept], count[kept], rows)


def successors(fans: Corners, nodes: int) -> tuple[Places, Places]:
    """The corner after each around its node, −1 where there is none; and the nodes with more than one fan on a side.

    There two triangles begin, or end, at one edge.
    """
    before, after = fans.node * nodes + fans.left, fans.node * nodes + fans.right
    order = np.argsort(before, kind="stable")
    known = before[order]
    torn = fans.node[order[1:][known[1:] == known[:-1]]]
    ended = np.sort(after)
    torn = np.union1d(torn, ended[1:][ended[1:] == ended[:-1]] // max(nodes, 1))
    place = np.minimum(np.searchsorted(known, after), max(len(known) - 1, 0))
    found = known[place] == after if len(known) else np.zeros(0, dtype=bool)
    return np.where(found, order[place], -1) if len(known) else place, torn
