"""Under mpiexec the first rank is the command line, and the others take part in what it smooths."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from gmsnet.cli.failure import BAD_INPUT, BUG, DONE, print_failure
from gmsnet.errors import GmsnetError

if TYPE_CHECKING:
    from gmsnet.run.smooth_result import SmoothResult

# How launchers tell a process which of how many it is: Open MPI, MPICH and Intel MPI.
TOLD = (("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"), ("PMI_RANK", "PMI_SIZE"))


def rank_of(environment: Mapping[str, str] = os.environ) -> tuple[int, int]:
    """Which rank this process is, and of how many; the first of one where no launcher says so."""
    for rank, size in TOLD:
        if environment.get(rank, "").isdigit() and environment.get(size, "").isdigit():
            return int(environment[rank]), int(environment[size])
    return 0, 1


def on_all_ranks(run: Callable[[], int]) -> int:
    """Runs the command line on the first rank while the others follow it; returns the exit code of this rank."""
    rank, size = rank_of()
    if size == 1:
        return run()
    try:
        from gmsnet.distributed.first import follow, left_others, release
        from gmsnet.distributed.library import mpi

        world = mpi().COMM_WORLD
    except GmsnetError as error:
        return print_failure(error) if rank == 0 else BAD_INPUT
    if rank:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # of Ctrl-C they hear from the first one
        try:
            follow(world)
        except Exception as error:
            _end_all(world, print_failure(error))
        return DONE
    code = run()
    if code == BUG or left_others():
        _end_all(world, code)
    release(world)
    return code


def smooth_function() -> Callable[..., SmoothResult]:
    """What smooths a mesh, with options and fixed nodes: ``smooth_with``, or the same by all ranks."""
    if rank_of()[1] == 1:
        from gmsnet.run.api import smooth_with

        return smooth_with
    from gmsnet.distributed.first import smooth_from_first

    return smooth_from_first


def _end_all(world: object, code: int) -> None:
    """The other ranks wait for what will not come: they end, too."""
    sys.stdout.flush()
    sys.stderr.flush()
    world.Abort(code)  # type: ignore[attr-defined]
