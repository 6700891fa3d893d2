"""Ctrl-C during compiled code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interruptible() -> Iterator[None]:
    """A context, or a decorator of functions, that an interruption leaves as the KeyboardInterrupt that it is.

    Numba calls Python where a kernel returns an array. If Ctrl-C comes just then, the kernel returns it all the same,
    with the interruption pending, and Python makes a SystemError of that, whose cause is the KeyboardInterrupt.
    """
    try:
        yield
    except SystemError as error:
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise error.__cause__ from None
        raise
