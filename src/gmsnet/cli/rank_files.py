"""Under mpiexec: a file in pieces, of which each rank reads its own, and writes it, or measures it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import typer

from gmsnet.cli import output as printed
from gmsnet.cli.file_work import FileWork
from gmsnet.cli.fix import chosen, names_markers
from gmsnet.cli.ranks import rank_of
from gmsnet.constraints.options import ALL
from gmsnet.mesh.display import visible
from gmsnet.parallel.interrupts import interruptible

if TYPE_CHECKING:
    from gmsnet.measure.overview import Overview
    from gmsnet.run.options import SmoothOptions


def shared_format(
    source: str, target: str, read_as: str | None, write_as: str | None, fix: Sequence[str], slide: Sequence[str]
) -> str:
    """The format of files that several ranks read and write part by part; "" where one process does it.

    read_as, write_as: the formats that are asked for. fix, slide: see ``smooth``.
    """
    if rank_of()[1] == 1:
        return ""
    from gmsnet.distributed import layouts

    named = names_markers(fix) or not {*slide} <= {ALL}
    return layouts.shared_format(source, target, read_as, write_as, named=named)


def measured_in_pieces(source: str, read_as: str | None, threshold: float | None) -> Overview | None:
    """What all ranks know of a file that they read part by part; None where one process measures it."""
    format = shared_format(source, source, read_as, read_as, (), ())
    if not format:
        return None
    from gmsnet.distributed.file_run import QualityTask
    from gmsnet.distributed.first import measure_file_from_first

    return measure_file_from_first(QualityTask(source, format, threshold))


def smooth_in_pieces(work: FileWork, options: SmoothOptions, format: str, fix: Sequence[str]) -> int:
    """Smooths the file, prints the figures of all ranks, and returns the exit code: 1 where cells are inverted
    or miss the target."""
    from gmsnet.distributed.file_run import FileTask
    from gmsnet.distributed.first import smooth_file_from_first

    target = None if work.destination is None or work.dry_run else work.destination.path
    task = FileTask(work.input, target, format, options, partial(chosen, fix) if fix else None)
    with interruptible(), work.progress, work.interruption:
        work.progress.begin(visible(f"{work.number}smoothing {work.input}"))
        found = smooth_file_from_first(task)
        work.interruption.end()
    if work.json:
        named = {"input": work.input, "output": target, "method": options.method_name}
        printed.print_json({**named, **found.summary(), "notes": found.notes}, line=bool(work.number))
    elif not work.quiet:
        written = "not written" if target is None else f"mesh written to {target}"
        lines = [f"{work.input}: {'; '.join(found.lines())}; {written}"]
        for line in lines if work.number else [*repr(found).splitlines(), written]:
            typer.echo(visible(f"{work.number}{line}"))
    faults = found.faults(options.target)
    for fault in faults:
        typer.echo(f"gmsnet: {visible(f'{work.number}{fault}')}", err=True)
    for line in found.named():
        typer.echo(f"  {line}", err=True)
    return 1 if faults else 0
