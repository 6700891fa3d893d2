"""What is being done, on standard error: a bar where that is a terminal; elsewhere one line if kernels are compiled."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TYPE_CHECKING

from rich import progress as parts
from rich.console import Console

from gmsnet.cli.visible import visible
from gmsnet.kernels.jit.watch import Compilation

if TYPE_CHECKING:
    from gmsnet.run.sweep import Sweep


COMPILING = "compiling kernels, once; about 15 s"


class Progress:
    """What is being done, and how far the sweeps are. A context manager. compilation: what was compiled meanwhile."""

    def __init__(self, sweeps: int, *, enabled: bool) -> None:
        columns = (
            parts.SpinnerColumn(),
            parts.TextColumn("{task.description}", markup=False),
            parts.BarColumn(),
            parts.TextColumn("{task.fields[score]}", markup=False),
        )
        shown = enabled and sys.stderr.isatty()
        self.compilation = Compilation(self._say_so if enabled else None)
        self._bar = parts.Progress(*columns, console=Console(stderr=True), transient=True, disable=not shown)
        self._task = self._bar.add_task("", total=None, score="")
        self._sweeps = sweeps

    def __enter__(self) -> Progress:
        self._bar.start()
        self.compilation.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        self.compilation.__exit__(kind, value, at)
        self._bar.stop()

    def _say_so(self) -> None:
        """That kernels are compiled: without a word, the first run would look as if it hung."""
        if self._bar.disable:
            print(f"gmsnet: {COMPILING}", file=sys.stderr, flush=True)
        else:
            self.begin(COMPILING)

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
