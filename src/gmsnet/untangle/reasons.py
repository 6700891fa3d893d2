"""Why a cell could not be untangled: what is proven to stand against it, and where."""

from __future__ import annotations

import numpy as np
import scipy.optimize
import scipy.sparse

from gmsnet.measure.signs import exact_signs
from gmsnet.topology.outline import held_edges
from gmsnet.topology.topology import Topology
from gmsnet.untangle.cells import corners_of, first_rows, whole_cells
from gmsnet.untangle.crossings import near_crossings
from gmsnet.untangle.patch import Flags, Floats, Ints, free_among
from gmsnet.untangle.result import HELD, StillInverted
from gmsnet.untangle.state import UntanglingState

CROSSING = "the boundary crosses itself here"
HELD_CROSSING = "edges whose nodes are held cross each other here"
EMPTY = "no position of its free node makes all cells of its star positive"
CLUSTER = 100  # bad cells around one that cannot be untangled, at maximum: more may have reasons of their own
FOR_GOOD = (CROSSING, HELD, EMPTY, HELD_CROSSING)
ROUNDING = "it is positive, but by no more than its coordinates may be off by"


def reasons(topology: Topology, points: Floats, bad: Flags, sweeps: int) -> tuple[StillInverted, ...]:
    """One row for each bad cell (T, bool: all rows of it), ascending. sweeps: how many there were."""
    rows = first_rows(topology, bad)
    if not len(rows):
        return ()
    cells, sides = corners_of(topology, rows)
    held = ~topology.near_free[cells]
    places = points[cells].mean(axis=1)
    if cells.shape[1] > 3:
        places[sides == 3] = points[cells[sides == 3, :3]].mean(axis=1)
    every = np.flatnonzero(bad)
    inverted = np.zeros(len(bad), dtype=bool)
    inverted[every] = exact_signs(points, topology.near[every], topology.near_orientation[every]) <= 0
    positive = ~whole_cells(topology, inverted)[rows]
    boundary, fixed = (near_crossings(points, edges, cells) for edges in held_edges(topology))
    empty: dict[int, bool] = {}
    out = []
    for k, (row, cell) in enumerate(zip(rows.tolist(), cells, strict=True)):
        reason, place = f"not untangled within {sweeps} sweeps", places[k]
        if positive[k]:
            reason = ROUNDING
        elif np.isfinite(boundary[k, 0]):
            reason, place = CROSSING, boundary[k]
        elif held[k].all():
            reason = HELD
        elif any(has_no_place(points, topology, v, empty) for v in cell[~held[k]].tolist()):
            reason = EMPTY
        elif np.isfinite(fixed[k, 0]):
            reason, place = HELD_CROSSING, fixed[k]
        out.append(StillInverted(row, reason, (float(place[0]), float(place[1]))))
    return tuple(out)


def freeze_hopeless(tangle: UntanglingState, points: Floats, bad: Flags) -> bool:
    """Freezes the free nodes of what no patch can mend, however large: the bad cells (of some points) with a reason of
    FOR_GOOD, and the few that hang together with them. Are there new ones?
    """
    tangle.reach.need_all()  # a boundary that crosses itself may be far off
    rows = reasons(tangle.topology, points, bad, 0)
    known = np.array([row.reason in FOR_GOOD for row in rows])
    if not known.any():
        return False
    cells, _ = corners_of(tangle.topology, first_rows(tangle.topology, bad))
    nodes, (count, corners) = len(points), cells.shape
    own = np.repeat(np.arange(count), corners)
    graph = scipy.sparse.csr_matrix((np.ones(cells.size), (own, count + cells.ravel())), shape=(count + nodes,) * 2)
    cluster = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][:count]
    size, reasons_known = np.bincount(cluster), np.bincount(cluster, known)
    hopeless = known | ((reasons_known > 0) & (size <= CLUSTER))[cluster]
    before = tangle.frozen.sum()
    tangle.frozen |= free_among(tangle.topology, cells[hopeless])
    return bool(tangle.frozen.sum() > before)


def freeze(tangle: UntanglingState) -> bool:
    """Freezes the free nodes of bad cells with such a reason; are there any, and bad cells without one?"""
    tangle.reach.need_all()
    topology = tangle.topology
    rows = [row.row for row in reasons(topology, tangle.points, tangle.bad, 0) if row.reason in FOR_GOOD]
    tangle.frozen = free_among(topology, corners_of(topology, np.array(rows, dtype=np.intp)).nodes)
    return bool(tangle.frozen.any() and tangle.bad_nodes().any())


def has_no_place(points: Floats, topology: Topology, v: int, known: dict[int, bool]) -> bool:
    """Are all nodes around v held, and is there no place for v at which all cells of its star are positive?"""
    if v not in known:
        around = topology.near_ring[topology.near_start[v] : topology.near_start[v + 1]]
        known[v] = (
            not topology.near_free[around].any() and kernel_depth(*points[opposite_edges(topology, v, around)]) <= 0.0
        )
    return known[v]


def opposite_edges(topology: Topology, v: int, around: Ints) -> Ints:
    """(2, k) tails and heads of the edges that v must have on its left for each simplex of its star to be positive."""
    if topology.patterns is None or topology.near_pattern is None:
        return np.stack([around, np.roll(around, -1)])
    first, end = topology.patterns.first[topology.near_pattern[v] :][:2]
    return around[topology.patterns.pair[first:end].T]


def kernel_depth(tails: Floats, heads: Floats) -> float:
    """How far the deepest place is from the lines of some edges (n, 2), left of all of them, over their size.

    The linear programme max t, n_j·(x − r_j) ≥ t for the left normals n_j of the edges; 0 or less: no place sees all
    edges from the left. An edge of no length has a triangle of no area wherever x is.
    """
    size = float(np.ptp(tails, axis=0).max())
    if size == 0.0:
        return 0.0
    middle = tails.mean(axis=0)
    local = (tails - middle) / size
    along = (heads - middle) / size - local
    length = np.linalg.norm(along, axis=1)
    if (length == 0.0).any():
        return 0.0
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
    rows = np.column_stack([-normal, np.ones(len(tails))])
    result = scipy.optimize.linprog(
        [0.0, 0.0, -1.0], A_ub=rows, b_ub=-(normal * local).sum(axis=1), bounds=[(-2, 2), (-2, 2), (-2, 1)]
    )
    return float(-result.fun)
