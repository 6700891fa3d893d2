"""Layers of quads followed along their rows, to where single quads are hardly stretched any more.

Where a row of a layer goes around a trailing edge, or where the cells of the last rows are nearly squares, the stretch
around nodes is too small to tell a layer. But quads tell which rows they are in: across a short edge is the next quad
of the row, across a long edge that of the next row. A quad is added to a layer if its corners are nearly right angles
and

- it continues a row: it is not much thicker than long, and as thick at its far end;
- or it begins the next row, with RUN neighbours that do: it is longer than thick, and about as thick as the quad before
  it. (Quads that were thrown about look so one by one, but not so many in a row.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import winding
from gmsnet.kernels.topology.components import pieces
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.topology.polygons import Offsets, offset_type

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


SINE = 0.75  # of the angle at a corner, at least
ROW, NEXT_ROW = 0.8, 1.2  # length over thickness, at least: of the next quad in a row, of one in the next row
FAR_END, THICKNESS = 1.3, 2.0  # ratios, at most: of a quad's thickness at its ends, to that of the quad before it
CLEAR = 1.5  # length over thickness of a quad whose own shape tells which of its edges lie along the row
RUN = 8  # quads of the next row beside one another


def followed(quads: NDArray[np.int32], points: Floats, inside: Flags) -> Flags:
    """(Q,) bool: the quads (Q, 4) inside layers, and those that continue them. points: (N, 2). inside: (Q,)."""
    inside = inside.copy()
    rows = np.flatnonzero(inside)
    if not len(rows):
        return inside
    twin = _twins(quads, len(points))
    rows = rows[((twin[rows] >= 0) & ~inside[twin[rows] // 4]).any(axis=1)]  # those with something beside them to add
    pair, _, _ = _measured(quads[rows], points)
    # Which edges of a quad lie along the row, 0 and 2, or 1 and 3, and its thickness; the same in a next row, where so.
    along, next_along = np.full((2, len(quads)), -1, dtype=np.int8)
    across, next_across = np.zeros((2, len(quads)))
    along[rows], across[rows] = np.argmax(pair, axis=1), pair.min(axis=1)
    rows = rows[pair.max(axis=1) >= CLEAR * pair.min(axis=1)]
    waiting = rows[:0]  # what may begin a next row
    while len(rows):
        one, k = np.repeat(rows, 4), np.tile(np.arange(4), len(rows))
        edge = twin[one, k]
        new = (edge >= 0) & ~inside[edge // 4]
        one, k, two, there = one[new], k[new], edge[new] // 4, edge[new] % 4
        pair, length, square = _measured(quads[two], points)
        every = np.arange(len(two))
        ahead = (k - along[one]) % 2 == 1  # over a short edge, to the next quad of the row
        lies = np.where(ahead, there + 1, there) % 2
        thick, long, before = pair[every, 1 - lies], pair[every, lies], across[one]
        ends = length[every, (lies + 1) % 4], length[every, (lies + 3) % 4]
        in_row = ahead & square & (long >= ROW * thick) & (np.maximum(*ends) <= FAR_END * np.minimum(*ends))
        next_row = ~ahead & square & (long >= NEXT_ROW * thick)
        next_row &= (thick <= THICKNESS * before) & (before <= THICKNESS * thick)
        next_along[two[next_row]], next_across[two[next_row]] = lies[next_row], thick[next_row]
        # What is reached in both directions lies along its longer edges: written last.
        taken = np.flatnonzero(in_row)
        taken = taken[np.argsort((long / thick)[taken], kind="stable")]
        inside[two[taken]], along[two[taken]], across[two[taken]] = True, lies[taken], thick[taken]
        begun = two[:0]
        if next_row.any():
            waiting = np.union1d(waiting, two[next_row])
            waiting = waiting[~inside[waiting]]
            begun = waiting[_many_beside(waiting, next_along[waiting].astype(np.int64), twin)]
        inside[begun], along[begun], across[begun] = True, next_along[begun], next_across[begun]
        rows = sorted_unique(np.concatenate([two[taken], begun]))
    return inside


def _measured(quads: NDArray[np.int32], points: Floats) -> tuple[Floats, Floats, Flags]:
    """Of quads: lengths of edges 0 and 2 together, and 1 and 3 (Q, 2), of each edge (Q, 4); are all corners square?"""
    corner = points[quads]
    edge = np.roll(corner, -1, axis=1) - corner
    length, back = np.hypot(edge[..., 0], edge[..., 1]), np.roll(edge, 1, axis=1)
    sine = np.abs(back[..., 0] * edge[..., 1] - back[..., 1] * edge[..., 0])
    square = (sine >= SINE * length * np.roll(length, 1, axis=1)).all(axis=1)
    return length[:, :2] + length[:, 2:], length, np.asarray(square)


def _many_beside(chosen: Ints, lies: Ints, twin: Offsets) -> Flags:
    """Which of the chosen quads (ascending) are among RUN or more of them that are beside one another in a row."""
    if len(chosen) < RUN:
        return np.zeros(len(chosen), dtype=bool)
    one = np.tile(np.arange(len(chosen), dtype=np.int32), 2)
    edge = np.concatenate([twin[chosen, (lies + 1) % 4], twin[chosen, (lies + 3) % 4]])
    two = np.minimum(np.searchsorted(chosen, edge // 4), len(chosen) - 1).astype(np.int32)
    beside = (edge >= 0) & (chosen[two] == edge // 4)
    edges = np.column_stack([one[beside], two[beside]])
    label = pieces(edges, np.ones(len(chosen), dtype=bool))
    many: Flags = np.bincount(label)[label] >= RUN
    return many


def _twins(quads: NDArray[np.int32], nodes: int) -> Offsets:
    """(Q, 4) across each edge, 4 times the quad plus its edge there; negative where not just one other has the edge."""
    kind = offset_type(quads.size)
    first, corner = np.arange(0, quads.size + 1, 4, dtype=kind), quads.ravel()
    twin, by_low = np.empty(quads.size, dtype=kind), np.empty(quads.size, dtype=kind)
    winding.match(first, corner, len(quads), np.zeros(nodes + 2, dtype=kind), by_low, np.empty_like(corner), twin)
    return twin.reshape(-1, 4)
