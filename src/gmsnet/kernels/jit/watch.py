"""What compilation costs: Numba tells of each function that it compiles, not of those that it finds in its cache."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import Any

from numba.core import event

COMPILES = "numba:compile"


class Compilation(event.Listener):
    """How long functions have been compiled while this context was open. on_first: called before the first of them.

    Functions are compiled while their callers are, which must not be counted twice. Numba compiles in one thread at a
    time, so no lock is needed.
    """

    def __init__(self, on_first: Callable[[], None] | None = None) -> None:
        self.seconds: float = 0.0
        self._on_first, self._depth, self._began = on_first, 0, 0.0

    def __enter__(self) -> Compilation:
        event.register(COMPILES, self)
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        event.unregister(COMPILES, self)

    def on_start(self, _: Any) -> None:
        """A function begins to be compiled."""
        if self._on_first is not None:
            call, self._on_first = self._on_first, None
            call()
        if not self._depth:
            self._began = time.perf_counter()
        self._depth += 1

    def on_end(self, _: Any) -> None:
        """It is compiled."""
        self._depth -= 1
        if not self._depth:
            self.seconds += time.perf_counter() - self._began
