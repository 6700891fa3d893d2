"""Layers of tetrahedra at walls: flat cells in columns of nodes that start at a boundary or an interface.

The halves and thirds of prisms that were grown from a wall have their nodes in columns. A column starts at a node of a
wall around which all cells are flat along the wall, as one or one by one (see flat_cells.py). It goes on, from row to
row, to the next node along its own direction, as long as the cells there are flat alike. Slivers are flat in directions
of their own, which cancel out around a node, and a mesh that was squeezed has no rows. So columns count that have ROWS
rows or more, FEWEST or more beside one another, whose cells are thinner at the wall than at their ends, or whose first
rows have one height, and higher ones follow. What lies around edges of the wall, between columns, belongs to them (see
column_gaps.py).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import columns as kernels
from gmsnet.kernels.topology import connectivity
from gmsnet.preserve.accepted_columns import FEWEST, accepted_of, linked
from gmsnet.preserve.column_gaps import neighbours, with_gaps
from gmsnet.preserve.flat_cells import BROAD, BROAD_THIRDS, feet, in_stars
from gmsnet.preserve.layers import Layers
from gmsnet.preserve.shared import Alone, Shared
from gmsnet.topology.held import ON_BOUNDARY, ON_INTERFACE
from gmsnet.topology.polygons import Ints
from gmsnet.topology.volume import Volume

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ids = NDArray[np.int64]

WALLS = (ON_BOUNDARY, ON_INTERFACE)  # why the nodes of walls are held
STILL_FLAT = 1.7  # how many times longer than thick cells are around a node inside
TURN = math.cos(math.radians(30.0))  # of a column from row to row
HIGHER = 2.5  # times as high as the row before it: no row of the same layer
LAST = 1.6  # the same for the last row
AT_ONCE = 1.1  # times as high as the lowest next row are rows that grow together
ROWS = 2  # nodes of a column above its wall


class _Front(NamedTuple):
    """The columns of a process, in the order of their feet. foot: (C,) names; number: (C,) among all of the mesh.

    normal: (C, 3); flatness: (C,) of the cells at the feet; width: (C,) of these cells.
    """

    foot: Ids
    number: Ids
    normal: Floats
    flatness: Floats
    width: Floats


def layers_of_volume(topology: Volume, points: Floats, shared: Shared | None = None) -> Layers:
    """The layers of a mesh of volumes as it is now; their cells in memory order. points: (N, 4) in memory order.

    shared: with the other processes that have parts of the mesh; each finds its own nodes and cells.
    """
    shared = Alone(topology) if shared is None else shared
    nodes, rows = len(points), topology.near
    none = Layers(np.zeros(nodes, dtype=bool), np.zeros(len(rows), dtype=bool), 1.0, 1.0, 0, (0, 0))
    wall = shared.spread(_wall_nodes(topology))
    broad = BROAD_THIRDS if topology.simplices.shapes is None else BROAD
    foot, normal, flatness = feet(points, rows, wall, broad)
    own = shared.own[foot]
    if shared.total(int(np.count_nonzero(own))) < FEWEST:
        return none
    foot, chosen = foot[own], np.zeros(nodes, dtype=bool)
    chosen[foot] = True
    number, width = shared.numbers(chosen), _widths(points, rows, wall, foot)
    front = _Front(shared.names[foot], number, normal[own], flatness[own], width)
    columns, heights, last, whole, high = _grown(topology, points, front, broad, shared)
    long: Flags = np.asarray((columns[:, ROWS : ROWS + 1] >= 0).any(axis=1))
    if shared.total(int(np.count_nonzero(long))) < FEWEST:
        return none
    chosen[foot] = long
    pairs = shared.names[linked(shared.own_near, shared.spread(chosen), wall)]
    free, row = shared.total(len(topology.free)), (columns[:, 1:] >= 0).sum(axis=1)
    accepted, found = shared.at_first(
        lambda *given: accepted_of(*given, free=free),
        (front.foot, long, heights[:, 0], np.nan_to_num(high).max(axis=1), row, front.flatness, last),
        (pairs,),
    )
    if found is None:
        return none
    solids = topology.simplices.solids
    nodes_of = rows if solids is None else solids.nodes
    whole, high = whole[accepted], high[accepted]
    inside = with_gaps(topology, points, whole, high, number[accepted], wall, shared)
    cells: Flags = np.asarray(inside[nodes_of].all(axis=1)) & shared.own_cells
    if not shared.total(int(cells.any())):
        return none  # columns without a cell between them are none
    held = np.zeros(nodes, dtype=bool)
    held[topology.memory] = inside & topology.near_free
    counts = shared.total(np.array([np.count_nonzero(cells), np.count_nonzero(shared.own_cells)]))
    median, largest = found
    return Layers(held, cells, median, largest, 0, (int(counts[0]), int(counts[1])))


def _wall_nodes(topology: Volume) -> Flags:
    """(N,) by places in memory: nodes of boundaries and interfaces, whether they slide or not."""
    wall = np.zeros(len(topology.memory), dtype=bool)
    for reasons in (topology.held, topology.sliding):
        for reason in WALLS:
            wall[topology.places[reasons.get(reason, np.empty(0, dtype=np.int64))]] = True
    return wall


def _widths(points: Floats, rows: Ints, wall: Flags, foot: Ints) -> Floats:
    """(C,) the mean lengths of the edges of these nodes that lie on their wall."""
    chosen = np.zeros(len(wall), dtype=bool)
    chosen[foot] = True
    one, two = neighbours(rows, chosen)
    on_wall = chosen[one] & wall[two]
    one, length = one[on_wall], np.linalg.norm(points[one[on_wall]] - points[two[on_wall]], axis=1)
    total, number = (np.bincount(one, weight, len(wall)) for weight in (length, None))
    found: Floats = total[foot] / np.maximum(number[foot], 1)
    return found


def _grown(
    topology: Volume, points: Floats, front: _Front, broad: float, shared: Shared
) -> tuple[Ids, Floats, Floats, Ids, Floats]:
    """The columns: (C, R) names from the foot on, −1 behind their ends; heights (C, R − 1); flatness of the last.

    And columns and heights with the node at the top of the last row, where there is one that is in no column: cells
    above are not flat any more, and so not all of those around that node. The lowest rows of all come first: so a layer
    that reaches from a wall to another one grows from where it is thin.
    """
    count, names = len(front.foot), shared.names
    inner = shared.spread(topology.near_free & (np.diff(topology.start) > 0))
    at, normal, last = front.foot.copy(), front.normal.copy(), np.full(count, np.nan)
    top, above = np.full(count, -1), np.zeros(count)
    taken = np.zeros(len(points), dtype=bool)
    rows, row = list[tuple[Ids, Ids, Ids, Floats]](), np.zeros(count, dtype=np.int64)
    before, stale = np.full(count, np.inf), np.ones(count, dtype=bool)
    to, height = np.full(count, -1), np.zeros(count)

    def take(places: Ids, takes: Flags) -> tuple[Flags]:
        """Takes some nodes, and tells which are taken then."""
        taken[places[takes]] = True
        return (taken[places],)

    def next_ones(places: Ids, normal: Floats) -> tuple[Ids, Floats]:
        """The next node over each, −1 where there is none, and how high it is."""
        if not len(places):
            return places, normal[:, 0]
        ends = np.full(len(points), -1, dtype=np.int32)
        ends[places] = np.arange(len(places))
        near = topology.near[connectivity.touching(topology.near, ends >= 0)]
        found, length = np.full(len(places), -1, dtype=np.int32), np.full(len(places), TURN)
        kernels.next_in_columns(points, near, ends, normal, inner, taken, found, length)
        return np.where(found >= 0, names[found], -1), length

    def first_ones(places: Ids, height: Floats, number: Ids) -> tuple[Flags, Floats, Floats]:
        """Of columns that would go on to one node the lowest, else the first one; how flat cells are there, and how."""
        order = np.lexsort((number, height))
        first = np.zeros(len(places), dtype=bool)
        first[order[np.unique(places[order], return_index=True)[1]]] = True
        return first, *in_stars(topology, points, places.astype(np.int32), broad, STILL_FLAT)

    shared.ask(front.foot, (np.ones(count, dtype=bool),), take)
    while shared.total(int(stale.any() or (to >= 0).any())):
        taken = shared.spread(taken)
        to[stale], height[stale] = shared.ask(at[stale], (normal[stale],), next_ones)
        to[stale & (height > HIGHER * before)] = -1
        lowest = shared.least(float(np.min(height, where=to >= 0, initial=np.inf)))
        step = np.flatnonzero((to >= 0) & (height <= AT_ONCE * lowest))
        first, flatness, direction = shared.ask(to[step], (height[step], front.number[step]), first_ones)
        ahead, there, flatness, direction = step[first], to.copy(), flatness[first], direction[first]
        alike = (flatness >= STILL_FLAT) & (abs((direction * normal[ahead]).sum(axis=1)) >= TURN)
        going, ending = ahead[alike], ahead[~alike]
        low = (height <= LAST * before) & (height * STILL_FLAT <= front.width)
        top[ending] = np.where(low[ending], to[ending], -1)
        above[ahead] = before[ahead] = height[ahead]
        to[step] = -1
        last[going], normal[going] = flatness[alike], direction[alike]
        at[going] = there[going]
        row[going] += 1
        rows.append((going, row[going], there[going], height[going]))
        waiting = np.flatnonzero(to >= 0)
        takes = np.repeat([True, False], [len(going), len(waiting)])
        (known,) = shared.ask(np.concatenate([there[going], to[waiting]]), (takes,), take)
        stale[:] = False
        stale[waiting], stale[going] = known[len(going) :], True
    columns = np.full((count, 2 + int(-shared.least(-float(row.max(initial=0))))), -1)
    heights = np.full((count, columns.shape[1] - 1), np.nan)
    columns[:, 0] = front.foot
    for of, number, node, high in rows:
        columns[of, number], heights[of, number - 1] = node, high
    topped = np.flatnonzero(top >= 0)
    (known,) = shared.ask(top[topped], (np.zeros(len(topped), dtype=bool),), take)
    whole, high, free = columns.copy(), heights.copy(), topped[~known]
    whole[free, 1 + row[free]], high[free, row[free]] = top[free], above[free]
    return columns[:, :-1], heights[:, :-1], last, whole, high
