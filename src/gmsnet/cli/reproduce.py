"""gmsnet reproduce: the paper's tables and figures by one command."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gmsnet.cli.signals import Deferral, Interrupted

if TYPE_CHECKING:
    from gmsnet.paper.units import UnitsDone


def _what() -> list[str]:
    from gmsnet.paper.plan import WHAT

    return list(WHAT)


def reproduce(
    what: Annotated[
        str, typer.Argument(metavar="WHAT", help="table1, table2, table3, figures or all.", autocompletion=_what)
    ] = "all",
    runs: Annotated[int | None, typer.Option(help="Seeds of each case.  [default: 10; 2 with --quick]")] = None,
    sweeps: Annotated[
        int | None, typer.Option(help="Visit each node at most this often.  [default: 100; 20 with --quick]")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the first run and the first training.")] = 0,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("gmsnet-reproduction"),
    quick: Annotated[
        bool, typer.Option("--quick", help="In three minutes: few runs, short trainings; to see that it works.")
    ] = False,
) -> None:
    """Make the paper's tables and figures anew, beside the figures that it prints.

    Writes reproduction.html (one page with everything), reproduction.json, the tables as CSV and the figures as PNG.
    What is done is kept in --out: the same command goes on where it was stopped.
    """
    from gmsnet.paper.plan import Plan
    from gmsnet.paper.reproduce import prepare
    from gmsnet.paper.reproduce import reproduce as run

    work = prepare(what, Plan.of(runs, sweeps, seed, quick=quick), out)
    if 0 < work.there < work.total:
        typer.echo(f"{out}: {work.there:,} of {work.total:,} parts are there already; going on", err=True)
    elif work.there:
        typer.echo(f"{out}: everything is there already; writing the page", err=True)
    try:
        with Deferral() as deferral, _bar(work.total) as on_unit:
            deferral.begin()
            written = run(work, on_unit, lambda: deferral.caught)
    except KeyboardInterrupt:
        written = None
    if written is None:
        raise Interrupted(f"interrupted; {out} keeps what is done: the same command goes on with it")
    for path in written:
        typer.echo(f"wrote {path}")


@contextmanager
def _bar(total: int) -> Iterator[Callable[[UnitsDone], None]]:
    """A progress bar on standard error, if that is a terminal."""
    from rich import progress as columns
    from rich.console import Console

    console = Console(stderr=True)
    shown = (
        columns.TextColumn("{task.description}", markup=False),
        columns.BarColumn(),
        columns.MofNCompleteColumn(),
        columns.TimeElapsedColumn(),
    )
    with columns.Progress(*shown, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("starting", total=total)
        yield lambda units: bar.update(task, description=units.batch, completed=units.done)
