"""``gmsnet smooth``: a mesh file in, the same file with better elements out."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated

import typer

from gmsnet.errors import InputError

if TYPE_CHECKING:
    from gmsnet.cli.target import Target
    from gmsnet.mesh import Mesh


def _method_names() -> list[str]:
    from gmsnet.methods import METHODS

    return list(METHODS)


def _format_names() -> list[str]:
    from gmsnet.io import FORMATS

    return list(FORMATS)


def smooth(
    input: Annotated[str, typer.Argument(metavar="IN", help="The mesh file to smooth; - reads the standard input.")],
    output: Annotated[
        str | None, typer.Argument(metavar="OUT", help="The file to write; - writes the standard output.")
    ] = None,
    method: Annotated[
        str, typer.Option(help="The smoother; see 'gmsnet methods'.", autocompletion=_method_names)
    ] = "gmsnet",
    max_sweeps: Annotated[int, typer.Option(min=0, help="Visit each node at most this often.")] = 100,
    target_quality: Annotated[
        float | None,
        typer.Option(
            help="Stop once the least 1/q of a cell is at least this, in (0, 1]; exit code 1 if it is not met."
        ),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT",
            help="Hold these nodes too: a marker's name, node ids from 0 (3,7,12), or @FILE with ids. Repeatable.",
        ),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(min=1, help="Use at most so many processors (default: all). Same result for any number."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="For methods that draw random numbers.")] = 0,
    weights: Annotated[
        str | None, typer.Option(metavar="FILE", help="Weights of your own, as 'gmsnet train' writes them.")
    ] = None,
    format: Annotated[
        str | None, typer.Option(help="Format of IN, where its suffix does not tell it.", autocompletion=_format_names)
    ] = None,
    output_format: Annotated[
        str | None, typer.Option(help="Format of OUT, where its suffix does not tell it.", autocompletion=_format_names)
    ] = None,
    in_place: Annotated[bool, typer.Option("--in-place", help="Write the result to IN; give no OUT.")] = False,
    plot: Annotated[
        str | None, typer.Option(metavar="FILE", help="Draw the mesh before and after (.png, .svg or .pdf).")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document instead of tables.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Smooth a mesh: move its free nodes so that its triangles become better, and change nothing else.

    Boundary, interfaces between regions and the nodes of markers stay where they are, and no cell that is valid
    becomes invalid. The result is never worse than the input. Formats are told by the suffix: .su2 .msh .vtk .vtu .mesh
    .node/.ele .stl .obj .off .ply; OUT of another format than IN is converted.

    Ctrl-C stops the smoothing; the best mesh so far is written.
    """
    from gmsnet.cli.target import STREAM, shown, target_of

    if json and output == STREAM:
        raise InputError("--json and OUT - both want the standard output: write the mesh to a file")
    target = target_of(input, output, in_place, output_format)
    if plot is not None:
        _check_picture(plot, input, target)

    # Heavy imports only now, when the command line is known to be in order.
    from gmsnet import io
    from gmsnet.cli.fix import fixed_nodes
    from gmsnet.cli.progress import Progress
    from gmsnet.cli.smooth_report import Outcome
    from gmsnet.engine import refuse_unless_planar
    from gmsnet.engine import smooth as run
    from gmsnet.methods import method_named

    method_named(method)
    with Progress(max_sweeps, enabled=not quiet) as progress:
        progress.stage(f"reading {shown(input)}")
        mesh = io.read(input, format)
        try:
            refuse_unless_planar(mesh)
        except InputError as error:
            raise InputError(f"{shown(input)}: {error}") from error
        fixed = fixed_nodes(mesh, fix or [])
        _check_conversion(mesh, target)
        progress.stage("preparing (the first run compiles: up to half a minute)")
        result = run(
            mesh,
            method,
            max_sweeps=max_sweeps,
            threads=threads,
            target_quality=target_quality,
            fixed=fixed,
            seed=seed,
            weights=weights,
            callback=progress.sweep,
        )
        lost: list[str] = []
        unchanged = in_place and not result.moved.any()  # then there is nothing to write
        if not unchanged:
            progress.stage(f"writing {target.path}")
            lost = io.write(result.mesh, target.path, target.format)
        if plot is not None:
            from gmsnet.plot import plot_smoothing

            progress.stage(f"drawing {plot}")
            plot_smoothing(mesh, result.mesh, plot)

    outcome = Outcome(input, None if unchanged else target.path, method, mesh, result, target_quality, lost, plot)
    if json:
        outcome.print_json()
    elif not quiet:
        outcome.print(aside=target.path == STREAM)
    if not outcome.target_met:
        typer.echo(f"gmsnet: target not met: {outcome.shortfall()}", err=True)
        raise typer.Exit(1)


def _check_picture(plot: str, source: str, target: Target) -> None:
    from gmsnet.cli.target import check_writable
    from gmsnet.plot import check_target

    check_target(plot)
    if any(os.path.realpath(plot) == os.path.realpath(path) for path in (source, target.path)):
        raise InputError(f"{plot}: the picture would overwrite the mesh: give it another name")
    check_writable(plot)


def _check_conversion(mesh: Mesh, target: Target) -> None:
    """Raise now what writing would raise after the work: the format of the output cannot hold the mesh."""
    from gmsnet.io import FORMATS

    if target.format is not None and mesh.source is not None and target.format != mesh.source.format:
        try:
            FORMATS[target.format].load().write(mesh)
        except InputError as error:
            raise InputError(f"{target.path}: {error}") from error
