"""One run over all ranks: sweeps where methods look at one star at a time, else the whole mesh on the first rank."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.agreement import everywhere
from gmsnet.distributed.executor import Ranks
from gmsnet.distributed.gathered import Whole
from gmsnet.distributed.ghosts import surrounded
from gmsnet.distributed.intent import may_be_meant
from gmsnet.distributed.on_first import Intent, intent_of, smoothed_on_first
from gmsnet.distributed.part import Part
from gmsnet.distributed.piece import Piece
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.stages import swept
from gmsnet.kernels.topology.connectivity import MISMATCHED, NON_ORIENTABLE, ZERO_AREA
from gmsnet.kernels.topology.write_back import put_back
from gmsnet.measure.report import measure
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.methods import Smoother
from gmsnet.methods.base import CELLS
from gmsnet.preserve.protection import LAYER
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import factors_of, rank_by
from gmsnet.run.sweep import Sweep
from gmsnet.topology.held import REASONS, reasons_in_space
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.ordering import planar_points, space_points, taken
from gmsnet.topology.solids import KINDS
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import MOST, Volume

Floats = NDArray[np.float64]
Callback = Callable[[Sweep], bool | None]

SHARED = (*CELLS, *KINDS, "line", "vertex")  # the kinds of cells that sweeps over ranks know

UNREAD = NON_ORIENTABLE, ZERO_AREA, MISMATCHED  # what is told of whole parts of a mesh, or of facets of far cells


def smoothed(piece: Piece, options: SmoothOptions, comm: Any, known: Whole | None = None) -> RankResult:
    """The mesh of all pieces smoothed; the same bits as a serial run gives. Called by all ranks alike.

    known: the whole mesh, if the first rank has it anyway.
    """
    began = time.perf_counter()
    smoother = everywhere(comm, options.smoother)
    around = surrounded(piece, comm)
    why = _not_shared(piece, smoother, options, comm)
    if why:
        return smoothed_on_first(piece, options, comm, why, began, known)
    part = Part.of(around, comm, piece.single)
    try:
        before = totals_of(part.points, part.simplices, Ranks(part))
        why, intent = _not_plain(part, before), Intent(None, False, [])
        if not why and options.preserved != "none" and may_be_meant(part):
            intent = intent_of(piece, options, comm, known)
            why = "the mesh is refined towards walls" if intent.walls else ""
        if why:
            return smoothed_on_first(piece, options, comm, why, began, known)
        return _shared(piece, part, smoother, options, intent, before, began)
    finally:
        part.halo.free()


def _not_shared(piece: Piece, smoother: Smoother, options: SmoothOptions, comm: Any) -> str:
    """Why this call cannot be shared out, whatever the coordinates; "" if it can."""
    if not smoother.shared_out:
        return f"{options.method_name} has steps that follow one another"
    if options.target:
        return "a target is reached patch after patch"
    if options.slides:
        return "curves to slide on are those of the whole mesh"
    if options.adapts:
        return "a metric is one of the whole mesh"
    kinds = {block.kind for block in piece.blocks if comm.allreduce(len(block.nodes))}
    others = sorted(kinds - set(SHARED))
    return f"cells of the kind {', '.join(others)} are not shared out" if others else ""


def _not_plain(part: Part, before: Totals | None) -> str:
    """Why the mesh cannot be shared out as it is; "" if it can."""
    topology, comm = part.topology, part.comm
    if isinstance(topology, Topology) and topology.plane is None:
        return "surfaces in space are not shared out"
    if before is None:
        return "no cell can be smoothed"
    reasons = reasons_in_space(MOST) if isinstance(topology, Volume) else REASONS
    orientation = topology.orientation if isinstance(topology, MixedVolume) else topology.near_orientation
    unread = any(reasons[mark] in topology.held for mark in UNREAD if mark in reasons)
    signs = np.array([np.count_nonzero(orientation > 0), np.count_nonzero(orientation < 0), unread])
    forth, back, unread = comm.allreduce(signs).tolist()
    if unread:
        return "parts of the mesh, or facets that do not match, have to be seen whole"
    if forth and back:
        return "cells are wound in both directions"
    if before.uncertain and comm.allreduce(measure(part.mesh, topology, part.points).inverted):
        return "inverted cells are mended one after the other"
    return ""


def _shared(
    piece: Piece, part: Part, smoother: Smoother, options: SmoothOptions, intent: Intent, before: Totals | None,
    began: float,
) -> RankResult:  # fmt: skip
    topology, ids = part.topology, part.around.nodes.ids
    at = np.searchsorted(ids, piece.ids)
    if intent.layers is not None:
        layers = np.zeros(len(ids), dtype=np.float64)
        layers[at] = intent.layers
        topology = topology.holding(part.halo.spread(layers[topology.memory])[topology.places] > 0.0, LAYER)
    topology, numbers = part.ready(topology)
    executor = Ranks(part, numbers)
    options = replace(options, callback=_answered(part.comm, options.callback))
    state = swept(part, topology, smoother, options, executor)
    points, moved, after = _written(part, state.points, options, before, executor)
    return RankResult(
        points=points[at],
        moved=moved[at],
        before=before,
        after=after,
        sweeps=state.history[-1].index if state.history else 0,
        stop_reason=state.stop_reason,
        history=[*state.history],
        notes=intent.notes,
        held=_held(part, topology),
        nodes=int(part.comm.allreduce(int(part.moves.sum()))),
        cells=sum(part.around.sizes),
        gathered="",
        seconds=time.perf_counter() - began,
        messages=part.halo.messages,
        bytes=part.halo.bytes,
        interrupted=state.interruption is not None,
    )


def _answered(comm: Any, callback: Callback | None) -> Callback | None:
    """A callback for all ranks: the first one asks its own and tells the others the answer. None if it has none."""
    if not comm.bcast(callback is not None):
        return None

    def ask(sweep: Sweep) -> bool | None:
        answer: Any = None
        if comm.rank == 0:
            try:
                answer = callback is not None and bool(callback(sweep))
            except KeyboardInterrupt:
                answer = KeyboardInterrupt
        answer = comm.bcast(answer)
        if answer is KeyboardInterrupt:
            raise KeyboardInterrupt
        return bool(answer)

    return ask


def _held(part: Part, topology: Topology | Volume) -> dict[str, int]:
    """Reason → how many nodes of the mesh, the first reason that applies to each."""
    own = part.around.nodes.owner == part.comm.rank
    mine = {reason: int(np.count_nonzero(own[ids])) for reason, ids in topology.held.items()}
    found: dict[str, int] = {}
    for each in part.comm.allgather(mine):
        for reason, number in each.items():
            found[reason] = found.get(reason, 0) + number
    return {reason: number for reason, number in found.items() if number}


class _Judged(NamedTuple):
    """As much of a QualityReport as ``rank_by`` looks at."""

    inverted: int
    totals: Totals | None


def _written(
    part: Part, best: Floats, options: SmoothOptions, before: Totals | None, executor: Ranks
) -> tuple[Floats, NDArray[np.bool_], Totals | None]:
    """The best mesh by global ids; that of the input if it is the better one as it is written."""
    mesh, topology = part.mesh, part.topology
    points, moved = mesh.points.copy(), np.zeros(len(mesh.points), dtype=bool)
    plane = mesh.plane or (0, 1, 2)
    put_back(best, part.points, topology.memory, plane, *factors_of(mesh.exponent), points, moved)
    assert mesh.box is not None
    written = replace(mesh, points=points).as_part(
        mesh.plane, (mesh.has_volumes, mesh.has_quads), mesh.exponent, mesh.box
    )
    near = taken(planar_points(written) if mesh.plane else space_points(written), topology.memory)
    after = totals_of(near, part.simplices, executor)
    rank, inverted = rank_by(options.best_by), 0 if after is None else after.inverted
    if rank(_Judged(inverted, after)) <= rank(_Judged(0, before)):
        return points, moved, after
    return mesh.points, np.zeros_like(moved), before
