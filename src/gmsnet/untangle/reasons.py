"""Why a cell could not be untangled: what is proven to stand against it, and where."""

from __future__ import annotations

import numpy as np
import scipy.optimize
import scipy.sparse

from gmsnet.measure.signs import exact_signs
from gmsnet.topology.topology import Topology
from gmsnet.untangle.crossings import held_edges, near_crossings
from gmsnet.untangle.patch import Flags, Floats, free_nodes_of
from gmsnet.untangle.result import StillInverted
from gmsnet.untangle.state import UntanglingState

HELD = "all its nodes are held"
CROSSING = "the boundary crosses itself here"
HELD_CROSSING = "edges whose nodes are held cross each other here"
EMPTY = "no position of its free node makes all triangles of its star positive"
CLUSTER = 100  # bad cells around one that cannot be untangled, at maximum: more may have reasons of their own
FOR_GOOD = (CROSSING, HELD, EMPTY, HELD_CROSSING)
ROUNDING = "it is positive, but by no more than its coordinates may be off by"


def reasons(topology: Topology, points: Floats, bad: Flags, sweeps: int) -> tuple[StillInverted, ...]:
    """One row for each bad cell (T, bool), ascending. sweeps: how many there were."""
    rows = np.flatnonzero(bad)
    if not len(rows):
        return ()
    cells = topology.near[rows]
    held = ~topology.near_free[cells]
    places = points[cells].mean(axis=1)
    signs = exact_signs(points, topology.near[rows], topology.near_orientation[rows])
    boundary, fixed = (near_crossings(points, edges, cells) for edges in held_edges(topology))
    empty: dict[int, bool] = {}
    out = []
    for k, (row, cell) in enumerate(zip(rows.tolist(), cells, strict=True)):
        reason, place = f"not untangled within {sweeps} sweeps", places[k]
        if signs[k] > 0:
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
    rows = reasons(tangle.topology, points, bad, 0)
    known = np.array([row.reason in FOR_GOOD for row in rows])
    if not known.any():
        return False
    cells = tangle.topology.near[bad]
    nodes, count = len(points), len(rows)
    own = np.repeat(np.arange(count), 3)
    graph = scipy.sparse.csr_matrix((np.ones(3 * count), (own, count + cells.ravel())), shape=(count + nodes,) * 2)
    cluster = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][:count]
    size, reasons_known = np.bincount(cluster), np.bincount(cluster, known)
    hopeless = known | ((reasons_known > 0) & (size <= CLUSTER))[cluster]
    before = tangle.frozen.sum()
    tangle.frozen |= free_nodes_of(tangle.topology, np.flatnonzero(bad)[hopeless])
    return bool(tangle.frozen.sum() > before)


def freeze(tangle: UntanglingState) -> bool:
    """Freezes the free nodes of bad cells with such a reason; are there any, and bad cells without one?"""
    topology = tangle.topology
    rows = [row.triangle for row in reasons(topology, tangle.points, tangle.bad, 0) if row.reason in FOR_GOOD]
    tangle.frozen = free_nodes_of(topology, np.array(rows, dtype=np.intp))
    return bool(tangle.frozen.any() and tangle.bad_nodes().any())


def has_no_place(points: Floats, topology: Topology, v: int, known: dict[int, bool]) -> bool:
    """Is the ring of v all held, and is there no place for v at which all triangles of its star are positive?"""
    if v not in known:
        ring = topology.near_ring[topology.near_start[v] : topology.near_start[v + 1]]
        known[v] = not topology.near_free[ring].any() and kernel_depth(points[ring]) <= 0.0
    return known[v]


def kernel_depth(ring: Floats) -> float:
    """How far the deepest place in a ring (n, 2), counter-clockwise, is from the lines of its edges, over its size.

    The linear programme max t, n_j·(x − r_j) ≥ t for the inner normals n_j of the edges; 0 or less: no place sees all
    edges from the left. An edge of no length has a triangle of no area wherever x is.
    """
    size = float(np.ptp(ring, axis=0).max())
    if size == 0.0:
        return 0.0
    local = (ring - ring.mean(axis=0)) / size
    along = np.roll(local, -1, axis=0) - local
    length = np.linalg.norm(along, axis=1)
    if (length == 0.0).any():
        return 0.0
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
    rows = np.column_stack([-normal, np.ones(len(ring))])
    result = scipy.optimize.linprog(
        [0.0, 0.0, -1.0], A_ub=rows, b_ub=-(normal * local).sum(axis=1), bounds=[(-2, 2), (-2, 2), (-2, 1)]
    )
    return float(-result.fun)
