"""A mesh in files, smoothed where it is: each rank reads and writes its own part, and none has the whole mesh."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from gmsnet.distributed.file_pieces import read_pieces
from gmsnet.distributed.file_ranges import PLANNED, read_ranges
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.smoothing import smoothed
from gmsnet.run.options import SmoothOptions


@dataclass(frozen=True)
class FileTask:
    """What all ranks do. source, target: paths. format: of both."""

    source: str
    target: str
    format: str
    options: SmoothOptions


def smooth_file(task: FileTask, comm: Any) -> RankResult:
    """All ranks call it. The files have the bytes that a serial run writes. Raises InputError, on all ranks alike;
    then nothing is written."""
    read = read_ranges if task.format in PLANNED else read_pieces
    given = read(task.source, task.format, comm)
    found = smoothed(given.piece, task.options, comm)
    moved = bool(comm.allreduce(int((found.points != given.piece.points).any())))
    if moved or os.path.abspath(task.source) != os.path.abspath(task.target):
        given.write(task.target, found.points, comm)
    return found
