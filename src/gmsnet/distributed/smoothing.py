"""One run over all ranks: sweeps where methods look at one star at a time, else the whole mesh on the first rank."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.agreement import everywhere, raise_everywhere
from gmsnet.distributed.along import Found, found_on_first, where_on
from gmsnet.distributed.answered import Answered
from gmsnet.distributed.executor import Ranks
from gmsnet.distributed.frame import framed
from gmsnet.distributed.gathered import Whole, gathered
from gmsnet.distributed.ghosts import surrounded
from gmsnet.distributed.library import mpi
from gmsnet.distributed.on_first import smoothed_on_first
from gmsnet.distributed.part import Part
from gmsnet.distributed.piece import Piece
from gmsnet.distributed.readied import Ready, meant, readied
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.skin import found_on_the_skin
from gmsnet.distributed.stages import swept
from gmsnet.distributed.told import counts_of, held, missing, remarks, worst_of
from gmsnet.errors import InputError
from gmsnet.kernels.topology.places import places_in
from gmsnet.kernels.topology.write_back import put_back
from gmsnet.measure.judged import Judged
from gmsnet.measure.report import QualityReport, measure
from gmsnet.measure.target import Nearness
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.measure.worst import Place
from gmsnet.methods import Smoother
from gmsnet.methods.base import CELLS
from gmsnet.run.options import CPU, SmoothOptions
from gmsnet.run.outcome import factors_of, greatest_angle, large_angles, merit_of
from gmsnet.run.set_up import check_options, check_target
from gmsnet.run.state import State
from gmsnet.run.stop import by_target
from gmsnet.topology.mixed_volume import wound_of
from gmsnet.topology.ordering import planar_points, space_points, taken
from gmsnet.topology.shell import Shell
from gmsnet.topology.solids import KINDS

Floats = NDArray[np.float64]

SHARED = (*CELLS, *KINDS, "line", "vertex")  # the kinds of cells that sweeps over ranks know
NO_NORMALS = "update_normals is of a whole mesh, and here each rank has its part of one: leave it out"
BESIDE = ("polyhedron", "polygon")  # beside volumes of these kinds: their nodes are held


def smoothed(piece: Piece, options: SmoothOptions, comm: Any, known: Whole | None = None) -> RankResult:
    """The mesh of all pieces smoothed; the same bits as a serial run gives. Called by all ranks alike.

    known: the whole mesh, if the first rank has it anyway.
    """
    began = time.perf_counter()
    lacking = options.update_normals and comm.rank == 0 and known is None
    raise_everywhere(comm, NO_NORMALS if lacking else "")
    smoother, given = everywhere(comm, partial(_smoother, options)), known
    if options.join_regions:
        piece = piece.with_one_region()
        known = None if known is None else known._replace(mesh=known.mesh.with_one_region())
    around, counts = surrounded(piece, comm), counts_of(piece, comm)
    why = _not_shared(counts, smoother, options)
    if why:
        return smoothed_on_first(piece, options, comm, why, began, given)
    mesh, found, wound = framed(comm, around.mesh(piece)), None, None
    if mesh.has_volumes:
        wound = wound_of(mesh, around.nodes.held_on(comm.rank))
    if options.slides and (mesh.has_volumes or mesh.plane is not None) and not comm.bcast(known is not None):
        found = found_on_the_skin(piece, around, mesh, wound, options, comm)
    if found is None and (options.slides or (mesh.plane is None and not mesh.has_volumes)):
        known = gathered(piece, comm, known)
        found = found_on_first(known, smoother, options, comm)
        if found.why:
            return smoothed_on_first(piece, options, comm, found.why, began, given or known)
    part = Part.of(around, mesh, comm, None if found is None else found.along, wound)
    del wound  # whose facets are wanted no more: they would stay while nodes move
    try:
        everywhere(comm, lambda: check_target(part.mesh, options.target))
        everywhere(comm, lambda: check_options(part.mesh, options, counts))
        before = totals_of(part.points, part.simplices, Ranks(part))
        ready = readied(piece, part, options, before, known)
        if ready.why:
            return smoothed_on_first(piece, options, comm, ready.why, began, given or known)
        return _shared(piece, part, smoother, options, ready, before, began, found, counts)
    finally:
        part.halo.free()


def _smoother(options: SmoothOptions) -> Smoother:
    if options.device != CPU:
        raise InputError("device='cuda' is for one process: with several ranks, leave device out")
    return options.smoother()


def _not_shared(counts: Mapping[str, int], smoother: Smoother, options: SmoothOptions) -> str:
    """Why this call cannot be shared out, whatever the coordinates; "" if it can."""
    if not smoother.shared_out:
        return f"{options.method_name} has steps that follow one another"
    if options.adapts:
        return "a metric is one of the whole mesh"
    held = BESIDE if counts.keys() & {*KINDS} else ()
    others = sorted(set(counts) - {*SHARED, *held})
    return f"cells of the kind {', '.join(others)} are not shared out" if others else ""


def _shared(
    piece: Piece, part: Part, smoother: Smoother, options: SmoothOptions, ready: Ready, before: Totals | None,
    began: float, found: Found | None, counts: Mapping[str, int],
) -> RankResult:  # fmt: skip
    at = places_in(part.around.nodes.ids, piece.ids)
    intent, done = ready.intent, ready.mended
    asked = part.comm.bcast(options.callback is not None)
    options = replace(options, callback=Answered(part.comm, options.callback) if asked else None)
    state = swept(part, meant(intent, piece, part), smoother, options, done, ready.inverted)
    if found is not None and isinstance(part.topology, Shell):
        before = found.before
    written = _written(piece, part, state, options, ready.inverted, before, found)
    points, moved, after, missed, greatest, judged, worst = written
    untangling = () if done is None else (done.note,)
    notes = [*intent.notes, *intent.of_walls[state.released :][:1], *untangling]
    where = None if part.rail is None else part.halo.spread(where_on(part.rail))[part.topology.places[at]]
    if found is not None:
        notes += found.note(points[at], moved[at], where, options, piece, part.comm)
    notes += remarks(part, counts, options) if found is None or found.remarks is None else found.remarks
    if intent.beside is not None and part.comm.allreduce(bool(moved.any()), mpi().LOR):
        notes += intent.beside.note(part.points, state.points)
    symbol = "η" if part.mesh.has_volumes else "1/q"
    notes += judged.note(before, after, symbol)
    notes += [] if options.target else judged.price(symbol)
    notes += large_angles(greatest, missed, options)
    return RankResult(
        points=points[at],
        moved=moved[at],
        before=before,
        after=after,
        sweeps=state.history[-1].index if state.history else 0,
        stop_reason=by_target(state.stop_reason, missed, swept=bool(state.history)),
        history=[*state.history],
        notes=notes,
        held=held(part, state.protection.base),
        nodes=int(part.comm.allreduce(int(part.moves.sum()))),
        cells=sum(part.around.sizes),
        gathered="",
        seconds=time.perf_counter() - began,
        messages=part.halo.messages,
        bytes=part.halo.bytes,
        interrupted=state.interruption is not None,
        missed=missed,
        judged=judged,
        untangling=untangling,
        mended=None if done is None else done.points[part.topology.places[at]],
        where=where,
        released=state.released,
        worst=worst,
    )


class _Written(NamedTuple):
    """The best mesh by global ids, that of the input if it is the better one as it is written. after: its figures;
    missed: how many cells miss the target, None without one; greatest: angle, where angles have a target; judged: by
    what it was compared with the input; worst: see RankResult.
    """

    points: Floats
    moved: NDArray[np.bool_]
    after: Totals | None
    missed: int | None
    greatest: float
    judged: Judged
    worst: tuple[Place, ...] = ()


def _written(
    piece: Piece, part: Part, state: State, options: SmoothOptions, inverted_before: int, before: Totals | None,
    found: Found | None,
) -> _Written:  # fmt: skip
    """See _Written. before: the figures of the input, and how many of its cells are inverted."""
    mesh, topology, target = part.mesh, part.topology, options.target
    points, moved = mesh.points.copy(), np.zeros(len(mesh.points), dtype=bool)
    plane = mesh.plane or (0, 1, 2)
    put_back(state.points, part.points, topology.memory, plane, *factors_of(mesh.exponent), points, moved)
    if found is not None and isinstance(topology, Shell):  # whose figures are added up in the order of the cells
        at = places_in(part.around.nodes.ids, piece.ids)
        better, figures = found.judged(points[at], piece, options, part.comm)
        best = points if better else mesh.points
        return _Written(best, moved & better, *figures)
    assert mesh.box is not None
    written = replace(mesh, points=points).in_frame_of(mesh)
    near = taken(planar_points(written) if mesh.plane else space_points(written), topology.memory)
    ranks, scored = Ranks(part), state.topology.scored
    after = totals_of(near, part.simplices, ranks)
    of_free = Judged(*(totals_of(places, scored, ranks) for places in (part.points, near)))
    inverted, missed, missed_before, greatest = 0 if after is None else after.inverted, None, None, [0.0, 0.0]
    final = None
    if target:
        first = state.before if isinstance(state.before, QualityReport) else measure(mesh, topology, part.points)
        last = measure(written, topology, near)
        missed, least = missing(part, last, options)
        missed_before, least_before = missing(part, first, options)
        now_near = Nearness.of(target, inverted, missed, least, of_free.after)
        better = now_near <= Nearness.of(target, inverted_before, missed_before, least_before, of_free.before)
        angles = [greatest_angle(report, options) for report in (first, last)]
        greatest = [float(part.comm.allreduce(angle, mpi().MAX)) for angle in angles]
        final = last if better else first
    else:
        merits = (merit_of(totals, options.best_by) for totals in (of_free.after, of_free.before))
        now, then = ((count, *merit) for count, merit in zip((inverted, inverted_before), merits, strict=True))
        better = now <= then
        if inverted if better else inverted_before:
            final = measure(written, topology, near) if better else measure(mesh, topology, part.points)
    worst = () if final is None else worst_of(part, final, options)
    if better:
        return _Written(points, moved, after, missed, greatest[1], of_free, worst)
    judged = of_free._replace(after=of_free.before)
    return _Written(mesh.points, np.zeros_like(moved), before, missed_before, greatest[0], judged, worst)
