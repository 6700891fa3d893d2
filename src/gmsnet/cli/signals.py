"""Ctrl-C and SIGTERM: until when they end a command at once, and from when on what it has is written first."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any


class Interrupted(Exception):
    """A command was interrupted after it had written something; the message says what. Exit code 130."""


class Deferral:
    """A context manager. From ``begin`` to ``end`` (its own end at the latest) Ctrl-C and SIGTERM only set ``caught``.

    A second one raises KeyboardInterrupt at once. So does Ctrl-C before ``begin``, which sets ``caught``, too: LLVM
    calls Python where it loads kernels, and an exception there is lost. Signals that the caller ignores (``nohup``)
    stay ignored.
    """

    caught: bool

    def __init__(self) -> None:
        self.caught = self._begun = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Deferral:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._install(signal.SIGINT, self._handle_at_once)
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        self.end()

    def begin(self) -> None:
        """From now on there is something to lose; it may be said more than once."""
        if not self._begun:
            self._begun = True
            for number in (signal.SIGINT, signal.SIGTERM):
                self._install(number, self._handle)

    def end(self) -> None:
        """Signals mean again what they meant before."""
        self._begun = False
        while self._before:
            signal.signal(*self._before.popitem())

    def _install(self, number: signal.Signals, handler: Callable[[int, FrameType | None], None]) -> None:
        if threading.current_thread() is not threading.main_thread():
            return  # Python calls handlers in the main thread, and only there they can be set
        before = signal.getsignal(number)
        if before not in (signal.SIG_IGN, None):
            self._before.setdefault(number, before)
            signal.signal(number, handler)

    def _handle_at_once(self, number: int, frame: FrameType | None) -> None:
        self.caught = True
        raise KeyboardInterrupt

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.caught:
            raise KeyboardInterrupt
        self.caught = True
