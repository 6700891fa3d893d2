"""A mesh in files, smoothed or measured where it is: each rank reads and writes its part, and none has the whole."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from gmsnet.distributed.chosen import Chosen, holding
from gmsnet.distributed.file_pieces import read_pieces
from gmsnet.distributed.file_ranges import read_ranges
from gmsnet.distributed.planned import PLANNED
from gmsnet.distributed.quality import measured
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.smoothing import smoothed
from gmsnet.errors import InputError
from gmsnet.measure.overview import Overview
from gmsnet.run.options import SmoothOptions

Value = TypeVar("Value")


@dataclass(frozen=True)
class FileTask:
    """What all ranks do. source, target: paths, None where nothing is written. format: of both. chosen: nodes that are
    to be held, besides; the first rank tells."""

    source: str
    target: str | None
    format: str
    options: SmoothOptions
    chosen: Chosen | None = None


@dataclass(frozen=True)
class QualityTask:
    """A mesh in files that all ranks measure. source: a path, of this format. threshold: see ``measured``."""

    source: str
    format: str
    threshold: float | None = None


def measure_file(task: QualityTask, comm: Any) -> Overview:
    """All ranks call it. Raises InputError, on all ranks alike."""
    given = _read(task, comm)
    return _named(task.source, lambda: measured(given.piece, comm, task.threshold))


def _named(source: str, make: Callable[[], Value]) -> Value:
    """What is made of the mesh in a file, which an error names."""
    try:
        return make()
    except InputError as error:
        raise InputError(f"{source}: {error}") from error


def _read(task: FileTask | QualityTask, comm: Any) -> Any:
    read = read_ranges if task.format in PLANNED else read_pieces
    return read(task.source, task.format, comm)


def smooth_file(task: FileTask, comm: Any) -> RankResult:
    """All ranks call it. The files have the bytes that a serial run writes. Raises InputError, on all ranks alike;
    then nothing is written."""
    given = _read(task, comm)
    piece = holding(given.piece, task.chosen, comm)
    found = _named(task.source, lambda: smoothed(piece, task.options, comm))
    if task.target is not None:
        moved = bool(comm.allreduce(int((found.points != given.piece.points).any())))
        if moved or os.path.abspath(task.source) != os.path.abspath(task.target):
            given.write(task.target, found.points, comm)
    return found
