"""A file in pieces, smoothed where it is: each rank reads and writes its own pieces, and none has the whole mesh."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from gmsnet.distributed.file_pieces import FilePieces, read_pieces
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.smoothing import smoothed
from gmsnet.distributed.together import replace_together
from gmsnet.io.packed import is_packed, packed
from gmsnet.io.stamps import Stamps
from gmsnet.run.options import SmoothOptions


@dataclass(frozen=True)
class FileTask:
    """What all ranks do. source, target: paths of files in pieces. format: of both."""

    source: str
    target: str
    format: str
    options: SmoothOptions


def smooth_file(task: FileTask, comm: Any) -> RankResult:
    """All ranks call it. The files have the bytes that a serial run writes. Raises InputError, on all ranks alike;
    then nothing is written."""
    pieces = read_pieces(task.source, task.format, comm)
    found = smoothed(pieces.piece, task.options, comm)
    moved = bool(comm.allreduce(int((found.points != pieces.piece.points).any())))
    if moved or os.path.abspath(task.source) != os.path.abspath(task.target):
        _write(task, pieces, found, moved, comm)
    return found


def _write(task: FileTask, pieces: FilePieces, found: RankResult, moved: bool, comm: Any) -> None:
    known = {path: stamp for each in comm.allgather(pieces.stamps.known) for path, stamp in each.items()}
    targets = pieces.layout.targets(task.target, known)
    files: dict[str, Any] = {
        targets[key]: file for key, file in pieces.spliced(found.points, moved).items() if key in targets
    }
    if comm.rank == 0:
        files |= pieces.layout.renamed(task.target, targets)
    files = {path: packed(file) if is_packed(path) else file for path, file in files.items()}
    replace_together(comm, task.target, files, list(targets.values()), Stamps(known.items()))
