"""The stage of second-order cells: the invalid are made valid, corners smoothed, and narrow cells given room.

The method of the call moves the corners, as if cells were straight, and they take their middles along: in a plane after
each of its sweeps (methods/curved.py), in space all together at the end (methods/solid_cells.py). Nodes of the
boundary, of interfaces, of line cells and of first-order cells stay, middles among them. A move is taken if all cells
around it are certified valid by the coefficients of their determinants (docs/guarantees.md).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.stars import counter_clockwise, curved_mesh
from gmsnet.kernels.simplex.bernstein import CORNERS, NAMES, WIDEST
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import LEVELS, VALID
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Field, method_named
from gmsnet.methods.curved import Curved
from gmsnet.methods.planar_cells import PlanarCells
from gmsnet.methods.solid_cells import SolidCells
from gmsnet.parallel.executor import Executor
from gmsnet.preserve.protection import protected, protected_volume
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import SecondOrder, State
from gmsnet.run.stop import CALLBACK, NO_PROGRESS, NOTHING_TO_MOVE
from gmsnet.run.sweep_stage import sweep
from gmsnet.topology.curved_solids import (
    CORNERS3,
    at_odds,
    curved_solids,
    has_curved,
    of_positive_sense,
    on_rim,
    table_of,
)
from gmsnet.topology.curved_solids import straight as straight_solids
from gmsnet.topology.held import OF_SECOND_ORDER
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import planar_points, space_points, taken
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

SWEEPS = 10
FIRST_ORDER = "node of first-order cells"
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def second_order_of(mesh: Mesh, topology: Topology, options: SmoothOptions) -> SecondOrder | None:
    """The second-order cells of a planar mesh and which of their nodes may move; None where there are none."""
    blocks = [block for block in mesh.cells if block.kind in NAMES and len(block.nodes)]
    if not blocks or mesh.plane is None or mesh.has_volumes:
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
    first = np.zeros(len(mesh.points), dtype=bool)
    first[topology.free] = True
    twin = straight(mesh)
    whole, near = Topology.and_points(twin, ~(may | first))
    corners = whole.holding(first, FIRST_ORDER)
    return SecondOrder(table, kind, may, whole, protected(twin, corners, options.preserved, options.fix_layers, near))


def second_order_solids_of(mesh: Mesh, topology: Volume, options: SmoothOptions) -> SecondOrder | None:
    """The same of volumes. topology: of those of the first order."""
    if not has_curved(mesh):
        return None
    table, kinds, number, others = table_of(mesh)
    nodes = len(mesh.points)
    regions = np.concatenate([block.regions for block in mesh.cells])[number]
    may = np.zeros(nodes, dtype=bool)
    may[topology.held.get(OF_SECOND_ORDER, np.empty(0, dtype=np.int64))] = True
    may &= ~(others | on_rim(table, kinds, regions, nodes) | at_odds(table, kinds, nodes))
    first = np.zeros(nodes, dtype=bool)
    first[topology.free] = True
    twin = straight_solids(mesh)
    whole = volume_of(wound_of(twin, ~(may | first)))
    inside_out = np.zeros(sum(len(block.nodes) for block in mesh.cells), dtype=bool)
    inside_out[whole.cell] = whole.orientation < 0
    table = of_positive_sense(table, kinds, inside_out[number])
    corner = np.zeros(nodes, dtype=bool)
    corner[whole.free] = True
    at_corners = np.zeros(nodes, dtype=bool)
    for kind, count in enumerate(CORNERS3):
        at_corners[table[kinds == kind, :count]] = True
    may &= corner | ~at_corners
    corners, near = whole.holding(first, FIRST_ORDER), taken(space_points(mesh), whole.memory)
    protection = protected_volume(corners, options.preserved, options.fix_layers, near, firm=False)
    return SecondOrder(table, kinds, may, whole, protection)


def straight(mesh: Mesh) -> Mesh:
    """The mesh (N × 2, in its plane) with straight cells instead of second-order ones; middles belong to no face."""
    kinds = {"triangle6": "triangle", "quad8": "quad", "quad9": "quad"}
    cells = (
        CellBlock(kinds[block.kind], block.nodes[:, : block.corners], block.regions) if block.kind in kinds else block
        for block in mesh.cells
    )
    return Mesh(planar_points(mesh), tuple(cells))


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


def untangle_second_order(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the invalid second-order cells valid, as many as can be."""
    given = state.second_order
    if given is None:
        return state
    cells = _opened(state)
    sign, quality = cells.judged()
    invalid, least = int((sign != 1).sum()), float(quality.min())
    by_id = np.empty_like(cells.free)
    by_id[state.topology.memory] = cells.free
    known = replace(given, free=by_id, sign=sign, invalid=(invalid, invalid), least=(least, least))
    state = replace(state, second_order=replace(known, unable=_unable(given, options)))
    if not (options.untangle and invalid and cells.free.any()):
        return state
    from gmsnet.untangle.curved import untangle_curved  # untangling takes 0.15 s more to import

    if isinstance(cells, SolidCells):
        _untangle_corners(cells, given, executor)
    untangle_curved(cells)
    return _judged(state, cells)


def _untangle_corners(cells: SolidCells, given: SecondOrder, executor: Executor) -> None:
    """Where straight cells are inverted: the corners go where these are not, if that makes more cells valid."""
    from gmsnet.untangle.space import untangle_volume

    every = np.arange(len(cells.mesh.cells))
    inverted = int((cells.straight_signs(every) != 1).sum())
    topology = given.protection.topology
    if inverted and isinstance(topology, Volume):
        done = untangle_volume(cells.points, topology, cells.precision, executor, inverted)
        cells.take(done.points)


def smooth_corners(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The sweeps of the method over the corners of second-order cells, which take their middles along."""
    given = state.second_order
    if given is None or given.unable or state.stop_reason == CALLBACK or not given.free.any():
        return state
    cells, room = _opened(state), -math.inf
    if options.guard != LEVELS[VALID]:
        sign, quality = cells.judged()
        room = float(quality[sign == 1].min(initial=cells.low))
    corners = replace(given.protection, base=given.protection.base.holding(~given.free, OF_SECOND_ORDER))
    curved = Curved(cells.mesh, room) if isinstance(cells, PlanarCells) else None
    ready = replace(
        state, points=cells.points, totals=None, protection=corners, released=False, sliding=None,
        smoother=options.smoother(), curved=curved,
    )  # fmt: skip
    done = sweep(ready, options, executor)
    if done.stop_reason == NOTHING_TO_MOVE:
        return state
    state = replace(state, history=done.history, interruption=done.interruption, stop_reason=done.stop_reason)
    if isinstance(cells, PlanarCells):
        return _judged(state, cells._replace(points=done.points))
    level = LEVELS.index(options.guard)
    guard = Field(cells.points, corners.topology, state.precision, level).guard(executor)
    cells.advance(done.points, guard, room)
    return _judged(state, cells)


def make_room(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Moves the nodes around second-order cells whose certified bound is low, inner middles first."""
    given = state.second_order
    if given is None or state.stop_reason == CALLBACK or not given.free.any():
        return state
    cells = _opened(state)
    topology = given.protection.topology
    inner, corners = np.flatnonzero(cells.inner), np.flatnonzero(cells.free & topology.near_free)
    level, tally = LEVELS.index(options.guard), np.zeros(3, dtype=np.int64)
    for _ in range(min(SWEEPS, options.max_sweeps)):
        moved = int(tally[MOVED])
        guard = Field(cells.points, topology, state.precision, level).guard(executor)
        cells.improve(inner, cells.low, guard, tally)
        cells.improve(corners, cells.low, guard, tally)
        if tally[MOVED] == moved:
            break
    if state.stop_reason == NOTHING_TO_MOVE:
        state = state.ended(NO_PROGRESS)
    return _judged(state, cells)


def _opened(state: State) -> PlanarCells | SolidCells:
    """A copy of the points, the second-order cells, and which nodes may move, all by places in memory."""
    given = state.second_order
    assert given is not None
    topology, points = state.topology, state.points.copy()
    table = np.where(given.cells >= 0, topology.places[given.cells], np.int32(-1))
    free = given.free[topology.memory]
    if given.solid:
        return SolidCells(points, curved_solids(points, table, given.kinds, ~free), free, state.precision)
    mesh = curved_mesh(points, table, given.kinds, ~free)
    free[mesh.edges[~mesh.dragged].ravel()] = False  # ends and middles of edges with one cell
    return PlanarCells(points, mesh, free, state.precision)


def _judged(state: State, cells: PlanarCells | SolidCells) -> State:
    """The state with these points, and how its cells are now; as it was if one of them has lost its validity."""
    given = state.second_order
    assert given is not None
    assert given.sign is not None
    sign, quality = cells.judged()
    if ((given.sign == 1) & (sign != 1)).any():
        return state
    invalid, least = (given.invalid[0], int((sign != 1).sum())), (given.least[0], float(quality.min()))
    known = replace(given, sign=sign, invalid=invalid, least=least)
    return replace(state, points=cells.points, totals=None, second_order=known)


def _unable(given: SecondOrder, options: SmoothOptions) -> str:
    """Why the method does not move corners, to be added to the note; "" if it does."""
    if given.solid:
        return ""  # the method was asked for the kinds of straight cells when the call began
    quads = (given.kinds != NAMES.index("triangle6")).any()
    if not quads or method_named(options.method_name).moves("quad", options.objective):
        return ""
    return f"; {options.method_name} moves triangles alone, so that no corner was moved for its cells' shape"
