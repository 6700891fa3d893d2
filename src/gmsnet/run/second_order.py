"""The stages of second-order cells: the invalid are made valid, and corners smoothed.

The method of the call moves the corners, as if cells were straight, and they take their middles along: in a plane after
each of its sweeps (methods/curved.py), in space all together at the end (methods/solid_cells.py). In a plane nodes of
first-order cells beside them move, too. Nodes of the boundary, of interfaces and of line cells stay, middles among
them. A move is taken if all cells around it are certified valid by the coefficients of their determinants
(docs/guarantees.md). Then follow the stages of run/room_stage.py.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.stars import counter_clockwise, curved_mesh
from gmsnet.kernels.simplex.bernstein import CORNERS, KINDS, NAMES, WIDEST
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Field, method_named
from gmsnet.methods.curved import Curved
from gmsnet.methods.planar_cells import PlanarCells
from gmsnet.methods.solid_cells import SolidCells
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.preserve.protection import Protection, protected, protected_volume
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import merit_of
from gmsnet.run.state import SecondOrder, State, with_corners
from gmsnet.run.stop import CALLBACK, NOTHING_TO_MOVE
from gmsnet.run.sweep_stage import sweep
from gmsnet.topology.curved_solids import curved_solids, remembered
from gmsnet.topology.held import OF_SECOND_ORDER
from gmsnet.topology.ordering import near_points, planar_points
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

FOR_GOOD = "its determinant is not positive where held nodes alone decide it"
NOT_FOUND = "no valid shape of it was found"
AS_FAR = "corners as far as curved cells let them"  # a stage
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def second_order_of(mesh: Mesh, topology: Topology, options: SmoothOptions) -> SecondOrder | None:
    """The second-order cells of a planar mesh, those beside them, and which of their nodes may move; None where there
    are none."""
    blocks = [block for block in mesh.cells if block.kind in NAMES and len(block.nodes)]
    if not blocks or mesh.plane is None or mesh.has_volumes:
        return None
    cells, kinds, regions, index, before = [], [], [], [], 0
    lines = list[NDArray[np.int64]]()
    for block in mesh.cells:
        if block.kind in KINDS:
            rows = np.full((len(block.nodes), WIDEST), -1, dtype=np.int32)
            rows[:, : block.nodes.shape[1]] = block.nodes
            cells.append(rows)
            kinds.append(np.full(len(rows), KINDS.index(block.kind), dtype=np.int8))
            regions.append(block.regions)
            index.append(np.arange(before, before + len(rows)))
        elif block.dimension == 1:
            lines.append(block.nodes[:, :2])
        before += len(block.nodes)
    table, kind, number = np.concatenate(cells), np.concatenate(kinds), np.concatenate(index)
    table = counter_clockwise(table, kind, topology.orientation_of(number) < 0)
    may = np.zeros(len(mesh.points), dtype=bool)
    may[topology.held.get(OF_SECOND_ORDER, np.empty(0, dtype=np.int64))] = True
    may[topology.free] = True
    for ids in topology.sliding.values():
        may[ids] = False
    edges = np.concatenate([*lines, np.empty((0, 2), dtype=np.int64)])
    may[_held_middles(table, kind, np.concatenate(regions), edges, len(may))] = False
    twin = straight(mesh)
    whole, near = Topology.and_points(twin, ~may)
    protection = protected(twin, whole, options.preserved, options.fix_layers, near)
    return SecondOrder(table, kind, may, whole, protection, number)


def straight(mesh: Mesh) -> Mesh:
    """The mesh (N × 2, in its plane) with straight cells instead of second-order ones; middles belong to no face."""
    kinds = {"triangle6": "triangle", "quad8": "quad", "quad9": "quad"}
    cells = (
        CellBlock(kinds[block.kind], block.nodes[:, : block.corners], block.regions) if block.kind in kinds else block
        for block in mesh.cells
    )
    return Mesh(planar_points(mesh), tuple(cells))


def _held_middles(
    cells: NDArray[np.int32], kinds: NDArray[np.int8], regions: NDArray[np.int64], lines: NDArray[np.int64], nodes: int
) -> NDArray[np.int64]:
    """The middles of edges between two regions and of line cells (L, 2), and those that are corners elsewhere."""
    ends, middles, of = [], [], []
    corner = np.zeros(nodes, dtype=bool)
    for kind, corners in enumerate(CORNERS):
        rows = np.flatnonzero(kinds == kind)
        corner[cells[rows, :corners]] = True
        for k in range(corners):
            ends.append(cells[rows][:, [k, (k + 1) % corners]])
            middles.append(cells[rows, corners + k])  # −1 of first-order cells
            of.append(regions[rows])
    pairs = np.sort(np.concatenate([*ends, lines]), axis=1)
    key = pairs[:, 0].astype(np.int64) * nodes + pairs[:, 1]
    middle, region = np.concatenate(middles), np.concatenate(of)
    marked = np.isin(key[: len(middle)], key[len(middle) :])
    order = np.argsort(key[: len(middle)], kind="stable")
    same = key[order][1:] == key[order][:-1]
    between = order[1:][same & (region[order][1:] != region[order][:-1])]
    marked |= np.isin(key[: len(middle)], key[between])
    held = np.zeros(nodes, dtype=bool)
    held[middle[marked & (middle >= 0)]] = True
    also = middle[middle >= 0]
    held[also[corner[also]]] = True
    return np.flatnonzero(held)


def untangle_second_order(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Makes the invalid second-order cells valid, and in a plane first-order ones beside them, as many as can be."""
    given = state.second_order
    if given is None:
        return state
    cells = opened(state)
    sign, quality = cells.judged()
    by_id = np.empty_like(cells.free)
    by_id[state.topology.memory] = cells.free
    known = replace(given, free=by_id, sign=sign, quality=quality, unable=_unable(given, options))
    invalid, least = known.figures(sign, quality)
    known = replace(known, invalid=(invalid, invalid), least=(least, least))
    if isinstance(cells, SolidCells):
        known = replace(known, linked=cells.mesh)
    state = replace(state, second_order=known)
    if not (options.untangle and (sign != 1).any() and cells.free.any()):
        return state
    return _mended(state, options, executor, cells)


def mend_rest(state: State, options: SmoothOptions, executor: Executor) -> State:
    """Tries once more to make the cells valid that are not, from where smoothing has taken their corners."""
    given = state.second_order
    if given is None or not options.untangle or given.in_vain or NOT_FOUND not in given.reasons.values():
        return state
    done = _mended(state, options, executor, opened(state))
    assert done.second_order is not None
    if done.second_order.invalid[1] < given.invalid[1]:
        return stopped(done, np.ones(1, dtype=bool))  # there may be more to gain now
    return replace(state, second_order=replace(given, in_vain=True), interruption=done.interruption)


def _mended(state: State, options: SmoothOptions, executor: Executor, cells: PlanarCells | SolidCells) -> State:
    """The state with as many of its cells valid as can be. cells: as ``opened`` gives them."""
    from gmsnet.untangle.curved import untangle_curved  # untangling takes 0.15 s more to import

    given = state.second_order
    assert given is not None
    for_good, interruption = np.zeros(len(given.cells), dtype=bool), None
    try:
        with interruptible():
            for_good = untangle_curved(cells, corners_alone(given).topology, executor).for_good
    except KeyboardInterrupt as caught:  # whole patches are mended, or as they were
        interruption = caught
    state = judged(state, cells)
    assert state.second_order is not None
    assert state.second_order.sign is not None
    left = [] if interruption is not None else np.flatnonzero(state.second_order.sign != 1).tolist()
    reasons = {int(given.numbers[k]): FOR_GOOD if for_good[k] else NOT_FOUND for k in left}
    state = _protected_anew(replace(state, second_order=replace(state.second_order, reasons=reasons)), options)
    return state if interruption is None else state.interrupted(interruption)


def smooth_corners(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The sweeps of the method over the corners of second-order cells, which take their middles along.

    Those of solids may be stopped where they do not all arrive, those of a plane where cells are thin.
    """
    given = state.second_order
    if given is None or given.unable or state.stop_reason == CALLBACK or not given.free.any():
        return state
    cells, corners = opened(state), corners_alone(given)
    curved = Curved(cells.mesh, given.room) if isinstance(cells, PlanarCells) else None
    ready = replace(
        state, points=cells.points, totals=None, protection=corners, released=False, sliding=None,
        smoother=options.smoother(), curved=curved, stop_reason="",
    )  # fmt: skip
    done = sweep(ready, options, executor)
    if done.stop_reason == NOTHING_TO_MOVE:
        return state
    state = replace(state, history=done.history, interruption=done.interruption, stop_reason=done.stop_reason)
    if isinstance(cells, PlanarCells):
        assert given.quality is not None
        state = judged(state, cells._replace(points=done.points))
        assert state.second_order is not None
        assert state.second_order.quality is not None
        return stopped(state, np.minimum(given.quality, state.second_order.quality) < cells.low)
    level = LEVELS.index(options.guard)
    guard = Field(cells.points, corners.topology, state.precision, level).guard(executor)
    cells.advance(done.points, guard, given.room, np.asarray(given.sign == 1))
    state = stopped(state, (cells.points != done.points).any(axis=1)[cells.corner])
    topology = with_corners(state)
    after, before = (totals_of(points, topology.scored, executor) for points in (cells.points, state.points))
    if not options.target and rank_of(after, options) > rank_of(before, options):
        return _as_they_are(state, before)  # a move of all corners together may cost what the method gained
    return _as_they_are(judged(state, cells), after)


def _as_they_are(state: State, totals: Totals | None) -> State:
    """The state with its last look at the cells as they are: the method saw straight ones where corners did not go.

    That is a stage of its own where some did not.
    """
    if totals is None or not state.history:
        return state
    assert state.second_order is not None
    *looks, last = state.history
    seen = replace(last, inverted=totals.inverted, min_shape=totals.shape_min, mean_shape=totals.shape_mean)
    if last.stage and state.second_order.stopped:
        looks, seen = [*looks, last], replace(seen, stage=AS_FAR, moved=0, truncated=0, dropped=0)
    return replace(state, history=(*looks, seen))


def stopped(state: State, flags: Flags) -> State:
    """The state, and whether any of the flags is set: that corners may have been stopped."""
    assert state.second_order is not None
    return replace(state, second_order=replace(state.second_order, stopped=bool(flags.any())))


def rank_at(
    points: Floats, straight: Topology | Volume, options: SmoothOptions, executor: Executor
) -> tuple[float, ...]:  # fmt: skip
    """Of two places of the corners those of the lesser rank are the better, by the rule of the last stage."""
    return rank_of(totals_of(points, straight.scored, executor), options)


def rank_of(totals: Totals | None, options: SmoothOptions) -> tuple[float, ...]:
    """The same of totals over the cells that are compared."""
    return (0 if totals is None else totals.inverted, *merit_of(totals, options.best_by))


def opened(state: State) -> PlanarCells | SolidCells:
    """A copy of the points, the second-order cells, and which nodes may move, all by places in memory."""
    given = state.second_order
    assert given is not None
    topology, points = state.topology, state.points.copy()
    free = given.free[topology.memory]
    if given.linked is not None:
        return SolidCells(points, remembered(points, given.linked), free, state.precision)
    table = np.where(given.cells >= 0, topology.places[given.cells], np.int32(-1))
    if given.solid:
        return SolidCells(points, curved_solids(points, table, given.kinds, ~free), free, state.precision)
    mesh = curved_mesh(points, table, given.kinds, ~free)
    free[mesh.edges[~mesh.dragged].ravel()] = False  # ends and middles of edges with one cell
    return PlanarCells(points, mesh, free, state.precision)


def judged(state: State, cells: PlanarCells | SolidCells) -> State:
    """The state with these points, and how its cells are now; as it was if one of them has lost its validity."""
    given = state.second_order
    assert given is not None
    assert given.sign is not None
    sign, quality = cells.judged()
    if ((given.sign == 1) & (sign != 1)).any():
        return state
    invalid, least = given.figures(sign, quality)
    known = replace(
        given, sign=sign, quality=quality, invalid=(given.invalid[0], invalid), least=(given.least[0], least)
    )
    return replace(state, points=cells.points, totals=None, second_order=known)


def corners_alone(given: SecondOrder) -> Protection:
    """The protection with the nodes alone free that may move."""
    return replace(given.protection, base=given.protection.base.holding(~given.free, OF_SECOND_ORDER))


def _protected_anew(state: State, options: SmoothOptions) -> State:
    """What is protected as the cells are once they are untangled: tangles are no layers."""
    given = state.second_order
    assert given is not None
    if isinstance(given.whole, Volume):
        volume = protected_volume(given.whole, options.preserved, options.fix_layers, state.points, firm=True)
        return replace(state, second_order=replace(given, protection=volume))
    points = np.empty_like(state.points)
    points[given.whole.memory] = state.points
    mesh = Mesh(points, ())
    near = near_points(mesh, given.whole)
    found = protected(mesh, given.whole, options.preserved, options.fix_layers, near, firm=True)
    return replace(state, second_order=replace(given, protection=found))


def _unable(given: SecondOrder, options: SmoothOptions) -> str:
    """Why the method does not move corners, to be added to the note; "" if it does."""
    if given.solid:
        return ""  # the method was asked for the kinds of straight cells when the call began
    quads = any(CORNERS[kind] == 4 for kind in np.unique(given.kinds))
    if not quads or method_named(options.method_name).moves("quad", options.objective):
        return ""
    return f"; {options.method_name} moves triangles alone, so that no corner was moved for its cells' shape"
