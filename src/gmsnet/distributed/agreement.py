"""What all ranks must say alike."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from gmsnet.errors import GmsnetError, InputError

Value = TypeVar("Value")


def agreed(comm: Any, value: Value, what: str) -> Value:
    """The value, if all ranks give the same. Raises InputError, on all ranks, if not."""
    given = comm.allgather(value)
    for rank, other in enumerate(given):
        if other != given[0]:
            raise InputError(f"{what} must be the same on all ranks: rank 0 has {given[0]!r}, rank {rank} {other!r}")
    return value


def raise_everywhere(comm: Any, wrong: str) -> None:
    """InputError on all ranks, with what the first of them has found; "" is nothing."""
    found = [each for each in comm.allgather(wrong) if each]
    if found:
        raise InputError(found[0])


def everywhere(comm: Any, make: Callable[[], Value]) -> Value:
    """What each rank makes for itself. Where one cannot, all raise what the first of these says, as an InputError.

    Errors of other kinds, as of an option that there is not, leave their own rank as they are.
    """
    try:
        made = make()
    except GmsnetError as error:
        raise_everywhere(comm, str(error))
        raise
    except Exception as error:
        comm.allgather(f"{type(error).__name__}: {error}")  # what raise_everywhere is waiting for
        raise
    raise_everywhere(comm, "")
    return made
