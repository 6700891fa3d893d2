"""How a call ends, interrupted or not."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from gmsnet.run.state import State

Result = TypeVar("Result")


def ended(work: Callable[[], State], told: Callable[[State], Result]) -> Result:
    """What ``told`` makes of the state after all work.

    A KeyboardInterrupt reaches the caller with that as its attribute ``result``; None if there is none yet, or a second
    one came before it was formed.
    """
    result = None
    try:
        state = work()
        try:
            result = told(state)
        except KeyboardInterrupt as interruption:
            state = state.interrupted(interruption)
            result = told(state)
        if state.interruption is not None:
            raise state.interruption
    except KeyboardInterrupt as interruption:
        interruption.result = result  # type: ignore[attr-defined]
        raise
    return result
