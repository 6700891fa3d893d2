"""What the command line does under mpiexec: meshes that the first rank has, or files, smoothed or measured by all."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.along import put_on
from gmsnet.distributed.file_run import FileTask, QualityTask, measure_file, smooth_file
from gmsnet.distributed.gathered import Whole
from gmsnet.distributed.library import mpi
from gmsnet.distributed.partition import partition
from gmsnet.distributed.piece import pieces_of
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.smoothing import smoothed
from gmsnet.errors import GmsnetError
from gmsnet.measure.overview import Overview
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.selection import fixed_mask
from gmsnet.parallel.threads import serial
from gmsnet.run.call import ended
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import result_of, write_back
from gmsnet.run.set_up import first_state
from gmsnet.run.smooth_result import SmoothResult
from gmsnet.run.state import State
from gmsnet.run.untangle_stage import protect_untangled
from gmsnet.topology.ordering import near_points, taken

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]


def follow(comm: Any = None) -> None:
    """What all but the first rank do: they take part in what it smooths, until it says that this is all."""
    comm = mpi().COMM_WORLD if comm is None else comm
    while (options := comm.bcast(None)) is not None:
        if isinstance(options, FileTask | QualityTask):
            with contextlib.suppress(GmsnetError):
                smooth_file(options, comm) if isinstance(options, FileTask) else measure_file(options, comm)
            continue
        piece = comm.scatter(None)
        with contextlib.suppress(GmsnetError):  # the first rank raises it, too, and says it
            found = smoothed(piece, options, comm)
            if found.gathered == "" or found.interrupted:
                comm.gather((found.points, found.mended, found.where))


class _Together(contextlib.AbstractContextManager["_Together"]):
    """Work of all ranks, on the first one. broken: it has left the others in the middle of it, who wait for it."""

    broken = False

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        self.broken = kind is not None and not issubclass(kind, GmsnetError)  # of which all ranks know


_TOGETHER = _Together()


def left_others() -> bool:
    """Whether the first rank has left the others in the middle of their work, by Ctrl-C or a bug."""
    return _TOGETHER.broken


def release(comm: Any = None) -> None:
    """The first rank has nothing more to be smoothed."""
    (mpi().COMM_WORLD if comm is None else comm).bcast(None)


def smooth_from_first(mesh: Mesh, options: SmoothOptions, fixed: Any = None, comm: Any = None) -> SmoothResult:
    """``gmsnet.smooth`` of a mesh that the first rank has, while the others ``follow``. Errors: see there."""
    began, comm = time.perf_counter(), mpi().COMM_WORLD if comm is None else comm
    chosen = fixed_mask(mesh, fixed)
    pieces = pieces_of(mesh, chosen, partition(mesh, comm.size), comm.size)
    with _TOGETHER:
        comm.bcast(replace(options, callback=None))
        whole = Whole(mesh, np.arange(len(mesh.points)), chosen)
        found = smoothed(comm.scatter(pieces), options, comm, whole)
        if found.whole is not None and not found.interrupted:
            return found.whole
        points, mended, where = zip(*comm.gather((found.points, found.mended, found.where)), strict=True)
    together = partial(_put_together, [piece.ids for piece in pieces], len(mesh.points))
    found = replace(found, mended=together(mended), where=together(where))
    done = partial(_as_a_state, mesh, together(points, mesh.points), found, fixed, options)
    return ended(done, lambda state: result_of(state, options, began))


def smooth_file_from_first(task: FileTask, comm: Any = None) -> RankResult:
    """``smooth_file`` while the others ``follow``. Errors: see there."""
    comm = mpi().COMM_WORLD if comm is None else comm
    with _TOGETHER:
        comm.bcast(replace(task, options=replace(task.options, callback=None), chosen=None))
        return smooth_file(task, comm)


def measure_file_from_first(task: QualityTask, comm: Any = None) -> Overview:
    """``measure_file`` while the others ``follow``. Errors: see there."""
    comm = mpi().COMM_WORLD if comm is None else comm
    with _TOGETHER:
        comm.bcast(task)
        return measure_file(task, comm)


def _put_together(ids: Sequence[Ids], nodes: int, values: Sequence[Any], others: Floats | None = None) -> Any:
    """Values at the nodes of pieces as those of the mesh, (N, …) by ids; None if there are none.

    ids: (n,) of each piece. others: (N, …) of nodes without cells, which are in no piece; else they have 0.
    """
    if values[0] is None:
        return None
    found = np.zeros((nodes, *values[0].shape[1:])) if others is None else others.copy()
    for places, each in zip(ids, values, strict=True):
        found[places] = each
    return found


def _as_a_state(mesh: Mesh, points: Floats, found: RankResult, fixed: Any, options: SmoothOptions) -> State:
    """The end of a serial run that came to the same points (N, dim). found: with what is by node by ids of the mesh."""
    state = first_state(mesh, fixed, options.smoother(), options, serial)
    if found.where is not None and state.constraint is not None:
        put_on(state.constraint, found.where[state.topology.memory])
    if found.mended is not None:
        state = replace(state, points=taken(found.mended, state.topology.memory), untangling=found.untangling)
        state = protect_untangled(state, options, serial)
    near = near_points(mesh.with_points(points).in_frame_of(mesh), state.topology)
    interruption = KeyboardInterrupt() if found.interrupted else None
    state = replace(
        state, points=near, totals=None, history=tuple(found.history), untangling=found.untangling,
        released=found.released,
    )  # fmt: skip
    return write_back(state.ended(found.stop_reason, interruption), options, serial)
