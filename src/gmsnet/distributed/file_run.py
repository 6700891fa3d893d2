"""A mesh in files, smoothed where it is: each rank reads and writes its own part, and none has the whole mesh."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from gmsnet.distributed.chosen import Chosen, holding
from gmsnet.distributed.file_pieces import read_pieces
from gmsnet.distributed.file_ranges import read_ranges
from gmsnet.distributed.planned import PLANNED
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.smoothing import smoothed
from gmsnet.run.options import SmoothOptions


@dataclass(frozen=True)
class FileTask:
    """What all ranks do. source, target: paths, None where nothing is written. format: of both. chosen: nodes that are
    to be held, besides; the first rank tells."""

    source: str
    target: str | None
    format: str
    options: SmoothOptions
    chosen: Chosen | None = None


def smooth_file(task: FileTask, comm: Any) -> RankResult:
    """All ranks call it. The files have the bytes that a serial run writes. Raises InputError, on all ranks alike;
    then nothing is written."""
    read = read_ranges if task.format in PLANNED else read_pieces
    given = read(task.source, task.format, comm)
    found = smoothed(holding(given.piece, task.chosen, comm), task.options, comm)
    if task.target is not None:
        moved = bool(comm.allreduce(int((found.points != given.piece.points).any())))
        if moved or os.path.abspath(task.source) != os.path.abspath(task.target):
            given.write(task.target, found.points, comm)
    return found
