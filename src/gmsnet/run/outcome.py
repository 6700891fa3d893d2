"""What a call of ``smooth`` ends with: the best mesh as it is written, its measures, and what there is to say."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.sliding import Sliding
from gmsnet.constraints.sliding_in_space import SurfaceSliding
from gmsnet.kernels.topology.write_back import put_back
from gmsnet.measure.judged import Judged
from gmsnet.measure.report import ASPECT, QualityReport, measure, measured_again
from gmsnet.measure.surface_change import Compared, surface_change
from gmsnet.measure.totals import Totals, totals_of, totals_with_others
from gmsnet.mesh.mesh import Mesh
from gmsnet.metric.conformity import Conformity, ConformityChange
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial
from gmsnet.preserve.protection import LAYER, WALL, Protection, carried_note, wall_note
from gmsnet.preserve.wall_heights import height_note
from gmsnet.run.options import SmoothOptions
from gmsnet.run.smooth_result import SmoothResult
from gmsnet.run.state import Final, State, with_corners
from gmsnet.run.stop import by_target
from gmsnet.run.untangle_stage import still_inverted
from gmsnet.topology.held import OF_FACE, OF_LINE, OF_SECOND_ORDER, ON_BOUNDARY, ON_INTERFACE
from gmsnet.topology.ordering import near_points
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]
# Of two meshes that of the lesser rank is the better. It is told from all cells, and from those with a free node.
Rank = Callable[[QualityReport, Totals | None], Any]


def write_back(state: State, options: SmoothOptions, executor: Executor) -> State:
    """The last stage: the best points in the order of the input, and their measures."""
    rank = ranking(options)
    if state.second_order is not None and state.second_order.invalid[0]:  # whose mending may cost straight cells shape
        rank = inverted_alone
    if state.motion is not None or state.metric is not None:  # in which meshes were compared
        rank = inverted_alone
    final = outcome(
        state.mesh, state.topology, state.points, state.before, rank, state.start, executor, state.totals,
        with_corners(state), state.first, again=state.second_order is not None and state.second_order.solid,
    )  # fmt: skip
    if state.metric is not None:
        plane = list(state.mesh.plane or (0, 1))  # in the units of the input, though its extent may be another now
        near = np.ldexp(final.points[:, plane][state.topology.memory], -state.mesh.exponent)
        state = replace(state, conformity=(*state.conformity, Conformity.of(near, state.planar, state.metric)))
    missed = len(options.target.missed_in(final.after)) if options.target else None
    reason = by_target(state.stop_reason, missed, swept=bool(state.history))
    state = replace(state, stop_reason=reason)
    beside = state.protection.beside
    if beside is not None and final.moved.any() and not state.before.inverted and state.motion is None:
        heights = height_note(beside, state.start, state.points)
        state = replace(state, remarks=(*state.remarks, *heights))
    nothing = np.empty((0, 2))
    shapes = np.empty(0, dtype=np.float32)
    return replace(state, start=nothing, points=nothing, shapes=shapes, floor_of=None, final=final)


def result_of(state: State, options: SmoothOptions, began: float) -> SmoothResult:
    """What the caller gets. began: when the call did, by ``time.perf_counter``."""
    assert state.final is not None
    points, moved, after, judged = state.final
    return SmoothResult(
        mesh=state.restore(points),
        points=points.copy(),
        before=state.before,
        after=after,
        sweeps=state.history[-1].index if state.history else 0,
        stop_reason=state.stop_reason,
        moved=moved,
        held=_held(state),
        history=list(state.history),
        notes=[*_notes(state, options), *_of_angles(after, options)],
        unmended=still_inverted(after, _why_not_mended(state)),
        topology=with_corners(state),
        seconds=time.perf_counter() - began,
        invalid_curved=0 if state.second_order is None else state.second_order.invalid[1],
        conformity=None if state.metric is None else ConformityChange(*state.conformity),
        asked=options.asked,
        compared=_compared(state, points),
        judged=judged,
    )


def _why_not_mended(state: State) -> Mapping[int, str]:
    given = state.second_order
    return state.reasons if given is None else {**state.reasons, **given.reasons}


def _compared(state: State, points: Floats) -> Compared | None:
    """The boundary along which nodes slide, in the input and now."""
    return compared_of(state.sliding, state.mesh.points, points)


def compared_of(sliding: object, before: Floats, after: Floats) -> Compared | None:
    """A surface with its points (N, 3) before and after; None where no node slides on one."""
    if not isinstance(sliding, SurfaceSliding) or sliding.constraint is None:
        return None
    return Compared(sliding.facets.rows, before, after)


def bound_note(compared: Compared | None, asked: float | None) -> list[str]:
    """What to say where facets have gone further than they were asked to, over the diagonal of their box."""
    change = None if compared is None or asked is None else surface_change(compared)
    if change is None or asked is None or change.hausdorff <= asked * change.diagonal:
        return []
    return [
        f"hausdorff: the bound is not kept, the distance is {change.hausdorff / change.diagonal:.3g} of the diagonal, "
        f"and {asked:.3g} was asked for: "
        "it is looked at in places of facets alone, of which those at tips and folds lie over one another"
    ]


def _held(state: State) -> dict[str, NDArray[np.int64]]:
    """Reason → ids; nodes of second-order cells that could move in their stages are not among them.

    Nodes of their boundary are told as such, whatever faces and lines the file has there; and those between regions.
    """
    held, given = dict(state.topology.held), state.second_order
    if given is None:
        return held
    if OF_SECOND_ORDER in held:
        still = held.pop(OF_SECOND_ORDER)
        still = still[~given.free[still]]
        if len(still):
            held[OF_SECOND_ORDER] = still
        on_purpose = given.protection.topology.held
        held |= {reason: on_purpose[reason] for reason in (LAYER, WALL) if reason in on_purpose}
    outside = [(reason, ON_BOUNDARY, given.outer) for reason in (OF_LINE, OF_FACE, OF_SECOND_ORDER)]
    for reason, where, nodes in (*outside, (OF_SECOND_ORDER, ON_INTERFACE, given.between)):
        there = np.isin(held.get(reason, nodes[:0]), nodes)
        if there.any():
            ids = held.pop(reason)
            held[where] = np.union1d(held.get(where, nodes[:0]), ids[there])
            if not there.all():
                held[reason] = ids[~there]
    return held


def _notes(state: State, options: SmoothOptions) -> list[str]:
    protection, near_walls, of_order = state.protection, [], []
    if protection.walls is not None:
        carried = carried_note(len(protection.topology.held.get(WALL, ())))
        near_walls.append(carried if state.motion else _wall_note(protection, moved=state.released))
    slid = []
    if isinstance(state.sliding, Sliding | SurfaceSliding) and state.final is not None:
        slid.append(state.sliding.note(state.mesh.with_points(state.final.points), state.final.moved))
        slid.extend(bound_note(_compared(state, state.final.points), options.hausdorff))
    given = state.second_order
    if given is not None and given.sign is not None and state.final is not None:
        of_order.append(given.note(state.final.moved))
        of_order.extend(note for note in given.protection.notes if note not in protection.notes)
        if given.protection.walls is not None:
            of_order.append(_wall_note(given.protection, moved=False))
    held, untangling = [], [*state.untangling]
    if state.final is not None:
        _, _, after, compared = state.final
        if untangling and state.reasons and not after.inverted:
            untangling[-1] += "; in the end none is inverted"
        held = compared.note(state.before.totals, after.totals, after.symbol)
        other = state.motion is not None or state.metric is not None or (given is not None and given.invalid[0])
        held += [] if options.target or other else compared.price(after.symbol)
    return [*protection.notes, *near_walls, *untangling, *slid, *state.remarks, *held, *of_order]


def _of_angles(after: QualityReport, options: SmoothOptions) -> list[str]:
    missed = len(options.target.missed_in(after)) if options.target_angle is not None else None
    return large_angles(greatest_angle(after, options), missed, options)


def greatest_angle(report: QualityReport, options: SmoothOptions) -> float:
    """In degrees, where angles have a target, else 0."""
    return float(report.column(report.angles[1]).max(initial=0.0)) if options.target_angle is not None else 0.0


def large_angles(greatest: float, missed: int | None, options: SmoothOptions) -> list[str]:
    """Says so where the target of angles is met, and a quad has a large one: it asks for the smallest alone."""
    if missed or options.target_angle is None or greatest <= 180.0 - options.target_angle:
        return []
    told = f"the greatest one is {greatest:.5g}°"
    return [f"target: it is of small angles alone, and {told}: a target of 1/q is of both"]


def _wall_note(protection: Protection, *, moved: bool) -> str:
    assert protection.walls is not None
    return wall_note(protection.walls, len(protection.topology.held.get(WALL, ())), moved)


def outcome(
    mesh: Mesh, topology: Topology | Volume, best: Floats, before: QualityReport, rank: Rank,
    start: Floats | None = None, executor: Executor = serial, totals: Totals | None = None,
    compared: Topology | Volume | None = None, known: tuple[Topology | Volume, Totals] | None = None, *,
    again: bool = False,
) -> Final:  # fmt: skip
    """The best mesh as it is in the input's order; that of the input if the quick sums misjudged it.

    best: (N, 2) in memory order. All nodes that it does not move keep their very bits. start: ``near_points`` of the
    mesh. totals: of ``best`` and the scored cells, where they are known. compared: the connectivity whose cells meshes
    are compared by, with other nodes held, if not this one. known: totals of the input, and of which connectivity.
    again: the cells of ``before`` are measured, which are more than those of the topology.
    """
    if start is None:
        start = near_points(mesh, topology)
    plane, factors = mesh.plane or (0, 1, 2), factors_of(mesh.exponent)
    points, moved = mesh.points.copy(), np.zeros(len(mesh.points), dtype=bool)
    count, exact = put_back(best, start, topology.memory, plane, *factors, points, moved)
    if count and mesh.rounding is not None:
        points, exact = mesh.rounding.kept(mesh.points, points), False
        moved &= (points != mesh.points).any(axis=1)
        count = int(np.count_nonzero(moved))
    compared = compared or topology
    whole = compared.scored is compared.simplices and not again
    first = before.totals if whole else None
    if known is not None and known[0] is compared:
        first = known[1]
    elif not whole or isinstance(topology, Shell):
        first = totals_of(start, compared.scored, executor)
    if not count:
        return Final(mesh.points, moved, before, Judged(first, first))
    points.flags.writeable = False  # so that the mesh need not copy them
    written = mesh.with_points(points)
    near = best if exact else near_points(written, topology)
    last = totals if exact and compared is topology else None
    last = last or totals_of(near, compared.scored, executor)
    if again:
        after = measured_again(before, written)
    else:
        every = last if whole else None
        if compared is topology and isinstance(topology, Topology) and topology.plane is not None:
            every = totals_with_others(near, topology, last, executor)
        after = measure(written, topology, near, executor, every)
    if rank(after, last) <= rank(before, first):
        return Final(points, moved, after, Judged(first, last))
    moved[:] = False
    return Final(mesh.points, moved, before, Judged(first, first))


def factors_of(exponent: int) -> tuple[float, float]:
    """Two normal powers of two by which to multiply one after the other for 2 to the power of the exponent.

    The first one is 1 unless the exponent is too large or too small for a single float.
    """
    most = max(min(exponent, 1000), -1000)
    return 2.0 ** (exponent - most), 2.0**most


def inverted_alone(report: QualityReport, _: Totals | None) -> int:
    """Fewer inverted cells, and nothing else."""
    return report.inverted


def ranking(options: SmoothOptions) -> Rank:
    """Nearer to the target, of all cells, if there is one."""
    target = options.target
    return target.rank if target else rank_by(options.best_by)


def rank_by(best_by: str) -> Rank:
    """Fewer inverted cells first; then, of the cells with a free node, see ``merit_of``."""
    return lambda report, totals: (report.inverted, *merit_of(totals, best_by))


def merit_of(totals: Totals | None, best_by: str) -> tuple[float, ...]:
    """Less for a larger q̂, or for a larger least and then mean 1/q if not all are triangles in a plane."""
    if totals is None:
        return ()
    if math.isnan(totals.qhat) or not totals.in_plane:
        return -totals.shape_min, -totals.shape_mean
    return (-(totals.qhat_aspect if best_by == ASPECT else totals.qhat),)
