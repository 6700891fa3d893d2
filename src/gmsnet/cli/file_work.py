"""A mesh file in, the same file with other coordinates out: what ``smooth`` and ``deform`` have in common."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import typer

from gmsnet.cli.destination import Destination, check_drawable, shown
from gmsnet.cli.signals import Deferral, Interrupted
from gmsnet.errors import GmsnetError, InputError
from gmsnet.mesh.display import visible
from gmsnet.parallel.interrupts import interruptible

if TYPE_CHECKING:
    from gmsnet.cli.smooth_report import Outcome
    from gmsnet.mesh.mesh import Mesh
    from gmsnet.run.progress import Progress
    from gmsnet.run.smooth_result import SmoothResult
    from gmsnet.run.sweep import Sweep


class Done(NamedTuple):
    """What was done. written: the file, None where there was no need to write. lost: by conversion. compiled: seconds
    of it that went into compilation."""

    mesh: Mesh
    result: SmoothResult
    written: str | None
    lost: list[str]
    compiled: float


class FileWork:
    """One run on a file. input: its path, format: its format where the suffix does not tell. plot, report: of a
    picture and of a page. command: as it was given.

    destination: None where there is none. dry_run: nothing is written. number: of one of several files, of which a line
    each is printed. aside: what is to be said besides.
    """

    input: str
    format: str | None
    destination: Destination | None
    in_place: bool
    aside: str
    plot: str | None
    report: str | None
    command: str
    json: bool
    quiet: bool
    number: str
    dry_run: bool
    progress: Progress
    interruption: Deferral

    def __init__(
        self, input: str, format: str | None, destination: Destination | None, *, in_place: bool, plot: str | None,
        report: str | None, most_sweeps: int, json: bool, quiet: bool, command: str, number: str = "",
        dry_run: bool = False,
    ) -> None:  # fmt: skip
        from gmsnet.run.progress import Progress

        self.input, self.format, self.destination, self.in_place, self.plot = input, format, destination, in_place, plot
        self.report, self.command, self.json, self.quiet = report, command, json, quiet
        self.number, self.dry_run = number, dry_run
        self.progress, self.interruption = Progress(most_sweeps, enabled=not quiet), Deferral()
        self.written: str | None = None
        self.aside = ""

    def after_sweep(self, sweep: Sweep) -> None:
        """The callback of a run."""
        self.interruption.begin()  # from now on there is something to lose
        self.progress.sweep(sweep)
        if self.interruption.caught:
            raise KeyboardInterrupt

    def carry_out(
        self, check: Callable[[Mesh], None], make: Callable[[Mesh], Callable[[], SmoothResult]],
        told: Callable[[Done], Outcome],
    ) -> int:  # fmt: skip
        """Reads, works, writes, and prints the outcome; returns the exit code, 1 where the outcome has faults.

        check: of the mesh that was read; the path is put before its InputError. make: what is to be done with it, once
        the rest of the command line is checked.
        """
        try:
            with interruptible(), self.progress, self.interruption:
                outcome = told(self._work(check, make))
                if self.report is not None:
                    self.progress.begin(visible(f"writing {self.report}"))
                    with _mesh_is_there(self.written, "report"):
                        outcome.write_report(self.report, self.command)
            self._tell(outcome)
        except KeyboardInterrupt:
            if self.written is None:
                raise
            raise Interrupted(f"interrupted; the mesh is written to {self.written}") from None
        if self.aside:
            typer.echo(visible(f"gmsnet: {self.number}{self.aside}"), err=True)
        faults = outcome.faults()
        for fault in faults:
            typer.echo(f"gmsnet: {visible(f'{self.number}{fault}')}", err=True)
        return 1 if faults else 0

    def _tell(self, outcome: Outcome) -> None:
        if self.json:
            outcome.print_json(line=bool(self.number))
        elif self.number and not self.quiet:
            outcome.print_line(self.number)
        elif not self.quiet:
            outcome.print(aside=self.destination is not None and self.destination.aside)

    def _work(self, check: Callable[[Mesh], None], make: Callable[[Mesh], Callable[[], SmoothResult]]) -> Done:
        from gmsnet import io
        from gmsnet.io.split_files import other_points

        self.progress.begin(visible(f"{self.number}reading {shown(self.input)}"))
        mesh = io.read(self.input, self.format)
        try:
            check(mesh)
        except InputError as error:
            raise InputError(f"{shown(self.input)}: {error}") from error
        if self.plot is not None:
            check_drawable(mesh, self.input)
        destination = self.destination
        if destination is not None and self.in_place and mesh.source is not None:
            destination = replace(destination, format=mesh.source.format)
        work = make(mesh)
        if self.interruption.caught:
            raise KeyboardInterrupt  # it was lost where it was raised
        if destination is not None:
            _check_conversion(mesh, destination)
        self.progress.begin("preparing")
        compiled = self.progress.compilation.seconds
        try:
            result = work()
        except KeyboardInterrupt as interrupted:
            result = _best_so_far(interrupted)
        compiled = self.progress.compilation.seconds - compiled
        self.interruption.begin()
        lost: list[str] = []
        if destination is not None and not self.dry_run and (not self.in_place or result.moved.any()):
            self.progress.begin(visible(f"writing {destination.path}"))
            lost = io.write(result.mesh, destination.path, destination.format)
            self.written = destination.path
            if others := other_points(destination.path, destination.format):
                self.aside = (
                    f"{others}, …: the points of the processors stay as they are; --format decomposed moves these"
                )
        self.interruption.end()
        if self.plot is not None:
            self.progress.begin(visible(f"drawing {self.plot}"))
            with _mesh_is_there(self.written, "picture"):
                _draw(mesh, result.mesh, self.plot)
        return Done(mesh, result, self.written, lost, compiled)


def _best_so_far(interrupted: KeyboardInterrupt) -> SmoothResult:
    """What an interrupted run has made; raises the interruption again where that is nothing."""
    result: SmoothResult | None = getattr(interrupted, "result", None)
    if result is None or not (result.history or result.moved.any()):
        raise interrupted
    return result


def _check_conversion(mesh: Mesh, destination: Destination) -> None:
    """Raise now what writing would raise after the work: the format of the output cannot hold the mesh."""
    from gmsnet.io.output import output_format

    entry = output_format(mesh, destination.path, destination.format)
    if mesh.source is not None and entry.key != mesh.source.format:
        try:
            entry.load().write(mesh)
        except InputError as error:
            raise InputError(f"{destination.path}: {error}") from error


def _draw(before: Mesh, after: Mesh, plot: str) -> None:
    from gmsnet.plot import plot_smoothing

    plot_smoothing(before, after, plot)


@contextlib.contextmanager
def _mesh_is_there(written: str | None, what: str) -> Iterator[None]:
    """Where what follows the mesh fails, the error says that the mesh is written."""
    try:
        yield
    except Exception as error:
        kind = InputError if isinstance(error, (GmsnetError, OSError, MemoryError)) else RuntimeError
        done = "the mesh is left as it is" if written is None else f"mesh written to {written}"
        raise kind(f"{done}; the {what} failed: {str(error) or type(error).__name__}") from error
