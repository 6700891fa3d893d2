"""What is being done, on standard error: a bar where that is a terminal; elsewhere one line if kernels are compiled."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from gmsnet.kernels.jit.watch import Compilation

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from gmsnet.run.sweep import Sweep

COMPILING = "compiling kernels, once; about 15 s ('gmsnet warm-up' does it ahead)"


class Progress:
    """What is being done, and how far the sweeps are. A context manager. compilation: what was compiled meanwhile.

    sweeps: at most so many are made. enabled: whether anything is said. bar: whether a bar is shown (default: where
    standard error is a terminal).
    """

    compilation: Compilation

    def __init__(self, sweeps: int, *, enabled: bool = True, bar: bool | None = None) -> None:
        self.compilation = Compilation(self._say_so if enabled else None)
        shown = sys.stderr.isatty() if bar is None else bar
        self._bar = _bar() if enabled and shown else None
        self._sweeps = sweeps

    def __enter__(self) -> Progress:
        if self._bar is not None:
            self._bar.start()
        self.compilation.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        self.compilation.__exit__(kind, value, at)
        if self._bar is not None:
            self._bar.stop()

    def _say_so(self) -> None:
        """That kernels are compiled: without a word, the first run would look as if it hung."""
        if self._bar is None:
            print(f"gmsnet: {COMPILING}", file=sys.stderr, flush=True)
        else:
            self.begin(COMPILING)

    def begin(self, text: str) -> None:
        """Say what begins now; of text of others, what a terminal may show."""
        self._update(description=text, total=None, score="", refresh=True)

    def sweep(self, sweep: Sweep) -> None:
        """The callback of ``smooth``: show the sweep and the mesh after it."""
        inverted = f", {sweep.inverted:,} inverted" if sweep.inverted else ""
        self._update(
            description=f"sweep {sweep.index} of at most {self._sweeps}",
            total=self._sweeps,
            completed=sweep.index,
            score=f"1/q mean {sweep.mean_shape:.4f}, min {sweep.min_shape:.4f}{inverted}",
        )

    def before(self, callback: Callable[[Sweep], bool | None] | None) -> Callable[[Sweep], bool | None]:
        """A callback that shows each sweep and then asks another callback, if there is one."""

        def look(sweep: Sweep) -> bool | None:
            self.sweep(sweep)
            return None if callback is None else callback(sweep)

        return look

    def _update(self, **changes: Any) -> None:
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], **changes)


def _bar() -> Bar:
    """A bar with one task. What it needs is imported here: most runs show none."""
    from rich import progress
    from rich.console import Console

    columns = (
        progress.SpinnerColumn(),
        progress.TextColumn("{task.description}", markup=False),
        progress.BarColumn(),
        progress.TextColumn("{task.fields[score]}", markup=False),
    )
    bar = progress.Progress(*columns, console=Console(stderr=True), transient=True)
    bar.add_task("", total=None, score="")
    return bar
