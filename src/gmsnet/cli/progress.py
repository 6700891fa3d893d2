"""A progress bar on standard error, where that is a terminal; elsewhere nothing at all."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TYPE_CHECKING

from rich import progress as parts
from rich.console import Console

from gmsnet.cli.visible import visible

if TYPE_CHECKING:
    from gmsnet.run.sweep import Sweep


class Progress:
    """What is being done, and how far the sweeps are. A context manager."""

    def __init__(self, sweeps: int, *, enabled: bool) -> None:
        columns = (
            parts.SpinnerColumn(),
            parts.TextColumn("{task.description}", markup=False),
            parts.BarColumn(),
            parts.TextColumn("{task.fields[score]}", markup=False),
        )
        shown = enabled and sys.stderr.isatty()
        self._bar = parts.Progress(*columns, console=Console(stderr=True), transient=True, disable=not shown)
        self._task = self._bar.add_task("", total=None, score="")
        self._sweeps = sweeps

    def __enter__(self) -> Progress:
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        self._bar.stop()

    def begin(self, text: str) -> None:
        """Say what begins now."""
        self._bar.update(self._task, description=visible(text), total=None, score="")

    def sweep(self, sweep: Sweep) -> None:
        """The callback of ``smooth``: show the sweep and the mesh after it."""
        inverted = f", {sweep.inverted:,} inverted" if sweep.inverted else ""
        self._bar.update(
            self._task,
            description=f"sweep {sweep.index} of at most {self._sweeps}",
            total=self._sweeps,
            completed=sweep.index,
            score=f"1/q mean {sweep.mean_shape:.4f}, min {sweep.min_shape:.4f}{inverted}",
        )
