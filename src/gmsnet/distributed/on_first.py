"""The whole mesh smoothed by the first rank, for what is not shared out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.agreement import raise_everywhere
from gmsnet.distributed.along import Along
from gmsnet.distributed.gathered import Whole, brought, gathered, scattered
from gmsnet.distributed.part import connected
from gmsnet.distributed.piece import Piece
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.wall_cells import WallCells
from gmsnet.errors import GmsnetError
from gmsnet.measure.worst import places_of, unmet
from gmsnet.mesh.display import amount
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods.banded import Kept
from gmsnet.preserve.protection import WALL, Protection, protected, wall_note
from gmsnet.run.api import smooth_with
from gmsnet.run.options import SmoothOptions
from gmsnet.run.smooth_result import SmoothResult
from gmsnet.run.stop import INTERRUPTED
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]


LOOKED_AT = "rank 0 has looked for layers and refined walls in the whole mesh, and needed memory for it: see preserve"


class Intent(NamedTuple):
    """What of the mesh is there on purpose. layers: (n,) of the piece, held. walls: of the piece, as of Protection.

    of_walls: what to say of the nodes near these, where they are held and where they move. beside: the cells at walls,
    where heights over these are to be compared.
    """

    layers: NDArray[np.bool_] | None = None
    walls: Kept | None = None
    of_walls: tuple[str, ...] = ()
    notes: Sequence[str] = ()
    beside: WallCells | None = None


def intent_of(
    piece: Piece, options: SmoothOptions, comm: Any, known: Whole | None, mended: Floats | None, along: Along | None, *,
    firm: bool,
) -> Intent:  # fmt: skip
    """What is there on purpose in a plane, told by the first rank of the whole mesh. known: see ``gathered``.

    mended: (n, 2) of the piece as ``near_points``, where no cell is inverted any more. firm: as of
    ``protected``.
    """
    whole, layers, kept, told = gathered(piece, comm, known), None, None, None
    now = None if mended is None else brought(whole, mended, piece, comm)
    if whole is not None:
        cells = np.arange(sum(len(block.nodes) for block in whole.mesh.cells))
        topology = connected(whole.mesh, whole.fixed, whole.ids, cells, along)
        assert isinstance(topology, Topology)
        near = near_points(whole.mesh, topology) if now is None else now[topology.memory]
        mesh = whole.mesh if now is None else whole.mesh.with_points(_written(whole.mesh, now))
        sure = firm or bool(options.target)
        found = protected(mesh, topology, options.preserved, options.fix_layers, near, firm=sure)
        layers = np.zeros(len(whole.ids), dtype=bool) if found.layers is None else found.layers
        kept = None if found.walls is None else np.column_stack(found.walls)
        told = _of_walls(found), [*found.notes, *[LOOKED_AT] * (known is None)]
    of_walls, notes = comm.bcast(told)
    layers = scattered(whole, layers, piece, comm)
    if not of_walls:
        return Intent(layers, notes=notes)
    return Intent(layers, Kept.of_columns(scattered(whole, kept, piece, comm).T), of_walls, notes)


def _of_walls(found: Protection) -> tuple[str, ...]:
    """As of Intent."""
    if found.walls is None:
        return ()
    count = len(found.topology.held.get(WALL, ()))
    return wall_note(found.walls, count, moved=False), wall_note(found.walls, count, moved=True)


def _written(mesh: Mesh, near: Floats) -> Floats:
    """The points (N, dim) of a mesh in a plane that ``planar_points`` (N, 2) are of."""
    points = mesh.points.copy()
    points[:, list(mesh.plane or ())] = np.ldexp(near, mesh.exponent)
    return points


def smoothed_on_first(
    piece: Piece, options: SmoothOptions, comm: Any, why: str, began: float, known: Whole | None
) -> RankResult:
    """All ranks call it. why: it is not shared out. known: see ``gathered``."""
    whole, wrong, result = gathered(piece, comm, known), "", None
    if whole is not None:
        try:
            result = _smoothed(whole, options)
            result = replace(result, notes=[*result.notes, _note(whole, why)])
        except GmsnetError as error:
            wrong = str(error)
    raise_everywhere(comm, wrong)
    figures: dict[str, Any] | None = None
    if whole is not None and result is not None:
        figures = _figures(whole, result, options)
    told = comm.bcast(figures)
    points = scattered(whole, None if result is None else result.points, piece, comm)
    moved = scattered(whole, None if result is None else result.moved, piece, comm)
    interruption = told.pop("interruption")
    seconds = time.perf_counter() - began
    return RankResult(points, moved, **told, gathered=why, seconds=seconds, interrupted=interruption, whole=result)


def _smoothed(whole: Whole, options: SmoothOptions) -> SmoothResult:
    try:
        return smooth_with(whole.mesh, options, whole.fixed)
    except KeyboardInterrupt as interruption:
        result: SmoothResult | None = getattr(interruption, "result", None)
        if result is None:
            raise
        return result


def _figures(whole: Whole, result: SmoothResult, options: SmoothOptions) -> dict[str, Any]:
    """What all ranks are told."""
    return {
        "before": result.before.totals,
        "after": result.after.totals,
        "judged": result.judged,
        "sweeps": result.sweeps,
        "stop_reason": result.stop_reason,
        "history": result.history,
        "notes": result.notes,
        "held": {reason: len(ids) for reason, ids in result.held.items()},
        "nodes": len(whole.ids),
        "cells": sum(len(block.nodes) for block in whole.mesh.cells),
        "missed": len(options.target.missed_in(result.after)) if options.target else None,
        "worst": places_of(result.after, unmet(result.after, options.target)),
        "interruption": result.stop_reason == INTERRUPTED,
    }


def _note(whole: Whole, why: str) -> str:
    return f"ranks: the first one smoothed all {amount(len(whole.ids), 'node')}, for {why}"
