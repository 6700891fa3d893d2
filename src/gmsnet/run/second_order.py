"""The stage of second-order planar cells: what is invalid is made valid, and what is nearly so gets room.

Corners of such cells take their middles along (kernels/curved). Nodes of the boundary, of interfaces, of line cells and
of first-order cells stay, middles among them. A move is taken if all cells around it are certified valid by the
coefficients of their determinants (docs/guarantees.md).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.descend import improve_nodes
from gmsnet.kernels.curved.stars import counter_clockwise, curved_mesh
from gmsnet.kernels.simplex.bernstein import CORNERS, NAMES, WIDEST
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import LEVELS, VALID, MeshGuard, Precision
from gmsnet.kernels.topology import connectivity
from gmsnet.measure.curved import judge_curved
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.executor import Executor
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import SecondOrder, State
from gmsnet.topology.held import OF_SECOND_ORDER
from gmsnet.topology.topology import Topology

LOW = 0.5  # a cell whose certified bound over its straight size is less gets more room
SWEEPS = 10


def second_order_of(mesh: Mesh, topology: Topology) -> SecondOrder | None:
    """The second-order cells of a planar mesh and which of their nodes may move; None where there are none."""
    blocks = [block for block in mesh.cells if block.kind in NAMES and len(block.nodes)]
    if not blocks or mesh.plane is None:
        return None
    cells, kinds, regions, index, before = [], [], [], [], 0
    first_order = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.cells:
        if block.kind in NAMES:
            rows = np.full((len(block.nodes), WIDEST), -1, dtype=np.int32)
            rows[:, : block.nodes.shape[1]] = block.nodes
            cells.append(rows)
            kinds.append(np.full(len(rows), NAMES.index(block.kind), dtype=np.int8))
            regions.append(block.regions)
            index.append(np.arange(before, before + len(rows)))
        else:
            first_order[block.nodes] = True
        before += len(block.nodes)
    table, kind, number = np.concatenate(cells), np.concatenate(kinds), np.concatenate(index)
    table = counter_clockwise(table, kind, topology.orientation_of(number) < 0)
    may = np.zeros(len(mesh.points), dtype=bool)
    may[topology.held.get(OF_SECOND_ORDER, np.empty(0, dtype=np.int64))] = True
    may &= ~first_order
    may[_on_interfaces(table, kind, np.concatenate(regions))] = False
    return SecondOrder(table, kind, may)


def _on_interfaces(cells: NDArray[np.int32], kinds: NDArray[np.int8], regions: NDArray[np.int64]) -> NDArray[np.int32]:
    """The middles of edges between two regions."""
    middles, of = [], []
    for kind, corners in enumerate(CORNERS):
        rows = np.flatnonzero(kinds == kind)
        middles.append(cells[rows, corners : 2 * corners].ravel())
        of.append(np.repeat(regions[rows], corners))
    nodes, region = np.concatenate(middles), np.concatenate(of)
    order = np.argsort(nodes, kind="stable")
    nodes, region = nodes[order], region[order]
    found: NDArray[np.int32] = nodes[1:][(nodes[1:] == nodes[:-1]) & (region[1:] != region[:-1])]
    return found


def improve_second_order(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Untangles second-order cells, then moves the nodes around those whose certified bound is low."""
    given, precision = state.second_order, state.precision
    if given is None or not given.free.any():
        return state
    from gmsnet.untangle.curved import free_inner, untangle_curved  # untangling takes 0.15 s more to import

    memory = state.topology.memory
    points = np.empty_like(state.points)
    points[memory] = state.points
    mesh = curved_mesh(points, given.cells, given.kinds, ~given.free)
    free = given.free.copy()
    free[mesh.edges[~mesh.dragged].ravel()] = False  # ends and middles of edges with one cell
    before, quality = judge_curved(points, mesh.cells, mesh.kinds, precision)
    was = points.copy()
    if options.untangle and (before != 1).any():
        untangle_curved(points, mesh, free, precision)
    floor = -math.inf
    if options.guard != LEVELS[VALID]:
        floor = _floor(points[memory], state.topology, free[memory], precision)
    guard, tally = MeshGuard(*precision, floor), np.zeros(3, dtype=np.int64)
    inner = np.flatnonzero(free_inner(mesh, free))
    corners = np.flatnonzero(free & (np.diff(mesh.edge_start) > 0))
    for _ in range(min(SWEEPS, options.max_sweeps)):
        moved = int(tally[MOVED])
        improve_nodes(points, mesh, inner, LOW, guard, tally)
        improve_nodes(points, mesh, corners, LOW, guard, tally)
        if tally[MOVED] == moved:
            break
    after, better = judge_curved(points, mesh.cells, mesh.kinds, precision)
    lost = ((before == 1) & (after != 1)).any() or (after != 1).sum() > (before != 1).sum()
    if lost:
        points, after, better = was, before, quality
    count = int((points != was).any(axis=1).sum())
    note = (
        f"second order: {_counted(int((before != 1).sum()))} before, {_counted(int((after != 1).sum()))} after; "
        f"the least bound of a determinant over that of the straight cell {quality.min():.3g} before, "
        f"{better.min():.3g} after; {count:,} of {int(free.sum()):,} free nodes moved"
    )
    made = replace(given, free=free, invalid=int((after != 1).sum()), untangled=bool((before != 1).any()))
    return replace(state, points=points[memory], totals=None, second_order=made, remarks=(*state.remarks, note))


def _counted(cells: int) -> str:
    return f"{cells:,} invalid cell{'' if cells == 1 else 's'}"


def _floor(points: NDArray[np.float64], topology: Topology, free: NDArray[np.bool_], precision: Precision) -> float:
    """An upper bound of the least D/L of the straight cells with a free corner, −∞ if one of them may be inverted.

    points, free: in memory order.
    """
    from gmsnet.kernels.untangle.cells import least_ratio

    rows = connectivity.touching(topology.near, free)
    least = float(least_ratio(points, topology.simplices.take(rows), precision.unit, precision.grain))
    return least if least > 0.0 else -math.inf
