"""Stages one after the other, each carried out or interrupted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State


class Stage(Protocol):
    """Makes a mesh better in one respect; returns the state as it is where there is nothing to do.

    A stage that is interrupted either returns what it has, with the interruption, or lets KeyboardInterrupt out.
    """

    def __call__(self, state: State, options: SmoothOptions, executor: Executor) -> State:
        """The state after it."""
        ...


def carry_out_all(state: State, options: SmoothOptions, executor: Executor, stages: Sequence[Stage]) -> State:
    """The state after all stages, or after the one that was interrupted."""
    for stage in stages:
        try:
            with interruptible():
                state = stage(state, options, executor)
        except KeyboardInterrupt as interruption:  # a stage that has nothing of its own to keep
            state = state.interrupted(interruption)
        if state.interruption is not None:
            break
    return state
