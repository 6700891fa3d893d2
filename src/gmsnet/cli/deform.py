"""``gmsnet deform``: a mesh file in, the same file with its boundary moved out."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from gmsnet.errors import InputError
from gmsnet.run.sweep import MOST_SWEEPS

if TYPE_CHECKING:
    from gmsnet.mesh.mesh import Mesh
    from gmsnet.run.deform_result import DeformResult


def deform(
    context: typer.Context,
    input: Annotated[str, typer.Argument(metavar="IN", help="The mesh file; - reads the standard input.")],
    output: Annotated[
        str | None, typer.Argument(metavar="OUT", help="The file to write; - writes the standard output.")
    ] = None,
    move: Annotated[
        list[str] | None,
        typer.Option(metavar="MARKER DX DY [DZ]", help="Move the nodes of a marker by a vector. Repeatable."),
    ] = None,
    rotate: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MARKER DEGREES CX CY [CZ AX AY AZ]",
            help="Turn the nodes of a marker counter-clockwise about a centre, in space about an axis through it that "
            "points at the viewer, before they are moved. Repeatable.",
        ),
    ] = None,
    displacement: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Lines 'node dx dy', nodes counted from 0; or a line 'x y' for each node of the mesh, its new place. "
            "Of volumes each has one number more.",
        ),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT",
            help="Hold these nodes too: a marker's name, node ids from 0 (3,7,12), or @FILE with ids. Repeatable.",
        ),
    ] = None,
    slide: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT",
            help="Let nodes of boundaries that are not moved follow along them: all, or a marker's name. Repeatable.",
        ),
    ] = None,
    feature_angle: Annotated[
        float, typer.Option(help="With --slide: a curve ends where it turns by more degrees than this.")
    ] = 30.0,
    preserve: Annotated[
        str,
        typer.Option(
            help="shape: carry layers of stretched cells along with their walls; none; in a plane also size: weigh "
            "areas, too.",
            autocompletion=lambda: ["shape", "size", "none"],
        ),
    ] = "shape",
    fix_layers: Annotated[
        bool, typer.Option("--fix-layers", help="Carry along all cells that are stretched alike as they are.")
    ] = False,
    guard: Annotated[
        str,
        typer.Option(
            help="What sweeps keep, as for 'gmsnet smooth'.", autocompletion=lambda: ["valid", "worst", "star"]
        ),
    ] = "worst",
    max_sweeps: Annotated[
        int, typer.Option(min=0, help="Make at most so many sweeps where shapes suffered.")
    ] = MOST_SWEEPS,
    threads: Annotated[
        int | None,
        typer.Option(min=1, help="Use at most so many processors (default: all). Same result for any number."),
    ] = None,
    format: Annotated[str | None, typer.Option(help="Format of IN, where its suffix does not tell it.")] = None,
    output_format: Annotated[str | None, typer.Option(help="Format of OUT, where its suffix does not tell it.")] = None,
    in_place: Annotated[bool, typer.Option("--in-place", help="Write the result to IN; give no OUT.")] = False,
    plot: Annotated[
        str | None, typer.Option(metavar="FILE", help="Draw the mesh before and after (.png, .svg or .pdf).")
    ] = None,
    report: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Write one HTML file that shows the mesh before and after, its figures, what is held and why.",
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document instead of tables.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Move boundaries of a mesh: their nodes go to new places, the inside follows, and nothing else changes.

    Layers of stretched cells and cells near refined walls are carried along as they are; where other cells suffer, the
    mesh is smoothed. No cell becomes inverted. Where the boundary cannot be moved all of the way, the mesh of the last
    valid step is written, and the exit code is 1.

    Ctrl-C ends the work; the last valid mesh is written if there is one. A second one ends at once and writes nothing.
    """
    from gmsnet.cli.destination import check_picture, check_report, destination_of, refuse_mixture
    from gmsnet.cli.moves import split

    destination = destination_of(input, output, in_place, output_format, format)
    refuse_mixture(destination, json)
    if plot is not None:
        check_picture(plot, input, destination)
    if report is not None:
        check_report(report, input, destination)
    if not (move or rotate or displacement):
        raise InputError("there is nothing to move: give --move, --rotate or --displacement")
    given = {"--move": move or [], "--rotate": rotate or []}
    moves = {option: [split(option, each) for each in values] for option, values in given.items()}

    # Heavy imports only now, when the command line is known to be in order.
    from gmsnet.cli.command import command_of
    from gmsnet.cli.deform_report import MovedOutcome
    from gmsnet.cli.file_work import Done, FileWork
    from gmsnet.cli.fix import fixed_nodes
    from gmsnet.cli.moves import prescribed
    from gmsnet.run.deform import check_deformable, deform_with
    from gmsnet.run.options import SmoothOptions

    work = FileWork(
        input, format, destination, in_place=in_place, plot=plot, report=report, most_sweeps=max_sweeps, json=json,
        quiet=quiet, command=command_of(context),
    )  # fmt: skip
    options = SmoothOptions(
        max_sweeps=max_sweeps, threads=threads, preserve=preserve, fix_layers=fix_layers, guard=guard,
        callback=work.after_sweep, slide=slide or None,
        feature_angle=feature_angle,
    )  # fmt: skip

    def make(mesh: Mesh) -> Callable[[], DeformResult]:
        places = prescribed(mesh, moves, displacement)
        return partial(deform_with, mesh, options, places, fixed_nodes(mesh, fix) if fix else None)

    def told(done: Done) -> MovedOutcome:
        return MovedOutcome(done.mesh, done.result, done.compiled, input, done.written, done.lost, plot, report)

    raise typer.Exit(work.carry_out(check_deformable, make, told))
