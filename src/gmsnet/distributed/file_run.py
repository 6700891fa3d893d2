"""A file in pieces, smoothed where it is: each rank reads and writes its own pieces, and none has the whole mesh."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from gmsnet.distributed.file_pieces import KINDS, FilePieces, read_pieces
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.smoothing import smoothed
from gmsnet.distributed.together import replace_together
from gmsnet.errors import InputError
from gmsnet.io import vtk_links
from gmsnet.io.formats import BY_SUFFIX
from gmsnet.io.packed import is_packed, packed, split_name
from gmsnet.io.stamps import Stamps
from gmsnet.run.options import SmoothOptions


@dataclass(frozen=True)
class FileTask:
    """What all ranks do. source, target: paths of files in pieces. format: of both."""

    source: str
    target: str
    format: str
    options: SmoothOptions


def in_pieces(source: str, target: str) -> str:
    """The format of two files that ranks read and write piece by piece; "" where they are of others."""
    first, second = (BY_SUFFIX.get(split_name(path)[1].lower(), "") for path in (source, target))
    return first if first == second and first in KINDS else ""


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
    stamps = pieces.stamps
    known = {path: stamp for each in comm.allgather(stamps.known) for path, stamp in each.items()}
    in_place = os.path.abspath(task.target) in known
    names = vtk_links.placed(task.target, {path: path for path in pieces.links}, in_place)
    paths = {key: os.path.join(os.path.dirname(task.target), path) for key, path in names.items()}
    lost = [path for path in paths.values() if os.path.abspath(path) in known and not in_place]
    if lost:
        raise InputError(f"{lost[0]}: holds the numbers of the mesh that was read: name another output")
    files: dict[str, Any] = {paths[key]: file for key, file in pieces.spliced(found.points, moved).items()}
    if comm.rank == 0:
        files[task.target] = [vtk_links.relinked(bytes(pieces.index[1]), names)]
    files = {path: packed(file) if is_packed(path) else file for path, file in files.items()}
    replace_together(comm, task.target, files, list(paths.values()), Stamps(known.items()))
