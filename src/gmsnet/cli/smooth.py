"""``gmsnet smooth``: a mesh file in, the same file with better elements out."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gmsnet.mesh.mesh import Mesh
    from gmsnet.run.result import SmoothResult


def _method_names() -> list[str]:
    from gmsnet.methods import METHODS

    return list(METHODS)


def _format_names() -> list[str]:
    from gmsnet.io import FORMATS

    return list(FORMATS)


def smooth(
    context: typer.Context,
    input: Annotated[str, typer.Argument(metavar="IN", help="The mesh file to smooth; - reads the standard input.")],
    output: Annotated[
        str | None, typer.Argument(metavar="OUT", help="The file to write; - writes the standard output.")
    ] = None,
    method: Annotated[
        str, typer.Option(help="The smoother; see 'gmsnet methods'.", autocompletion=_method_names)
    ] = "auto",
    variant: Annotated[str | None, typer.Option(help="A variant of the method; see 'gmsnet methods'.")] = None,
    objective: Annotated[str | None, typer.Option(help="What 'optimize' minimises; see 'gmsnet methods'.")] = None,
    max_sweeps: Annotated[
        int, typer.Option(min=0, help="Make at most so many sweeps (untangling comes before).")
    ] = 100,
    target_quality: Annotated[
        float | None,
        typer.Option(
            help="Smooth only around cells whose 1/q is below this, in (0, 1], until none is; exit code 1 if some stay."
        ),
    ] = None,
    target_angle: Annotated[
        float | None, typer.Option(help="The same for the minimum angle of a cell, in degrees, in (0, 60].")
    ] = None,
    target_dihedral: Annotated[
        float | None,
        typer.Option(help="The same for the minimum dihedral angle of tetrahedra, in degrees, in (0, 70.5]."),
    ] = None,
    guard: Annotated[
        str,
        typer.Option(
            help="What each sweep keeps: valid (no cell is inverted), worst (besides, the worst cell of the mesh does "
            "not get worse) or star (nor does the worst one around any node).",
            autocompletion=lambda: ["valid", "worst", "star"],
        ),
    ] = "worst",
    preserve: Annotated[
        str,
        typer.Option(
            help="shape: hold layers of stretched cells along walls; size: weigh areas of cells, too; metric: keep all "
            "stretch and sizes as a smooth metric; none.",
            autocompletion=lambda: ["shape", "size", "metric", "none"],
        ),
    ] = "shape",
    metric: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="Move nodes towards the metric in a Medit .sol or .solb: m11, m12, m22 a node."
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Move nodes towards the lengths of edges in such a file: one number a node."),
    ] = None,
    fix_layers: Annotated[
        bool, typer.Option("--fix-layers", help="Hold all cells that are stretched alike, whatever --preserve says.")
    ] = False,
    untangle: Annotated[
        bool, typer.Option("--untangle/--no-untangle", help="Mend inverted cells first, where there are any.")
    ] = True,
    best_by: Annotated[
        str, typer.Option(help="Which 1/q says which mesh is the best: shape, or aspect (Verdict's, as in the paper).")
    ] = "shape",
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
            help="Let nodes of boundaries, interfaces and markers move along their curves: all, or a marker's name. "
            "Repeatable.",
        ),
    ] = None,
    feature_angle: Annotated[
        float, typer.Option(help="With --slide: a curve ends where it turns by more degrees than this.")
    ] = 30.0,
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
    """Smooth a mesh: move its free nodes so that its cells become better, and change nothing else.

    Boundary, interfaces between regions and the nodes of markers stay where they are, and no cell that is valid
    becomes invalid. Inverted cells are untangled first. The worst cell never gets worse, and the result is never worse
    than the input. Exit code 1: a target is missed, or cells are inverted still.

    Formats are told by the suffix: .su2 .msh .vtk .vtu .mesh .node/.ele .stl .obj .off .ply; OUT of another format
    than IN is converted.

    Ctrl-C stops the smoothing; the best mesh so far is written. A second one ends at once and writes nothing.
    """
    from gmsnet.cli.destination import check_picture, check_report, destination_of, refuse_mixture

    destination = destination_of(input, output, in_place, output_format)
    refuse_mixture(destination, json)
    if plot is not None:
        check_picture(plot, input, destination)
    if report is not None:
        check_report(report, input, destination)

    # Heavy imports only now, when the command line is known to be in order.
    from gmsnet.cli.command import command_of
    from gmsnet.cli.file_work import Done, FileWork
    from gmsnet.cli.fix import fixed_nodes
    from gmsnet.cli.metric import values_at_nodes
    from gmsnet.cli.smooth_report import Outcome
    from gmsnet.run.api import smooth_with
    from gmsnet.run.options import SmoothOptions
    from gmsnet.run.set_up import check_mesh

    work = FileWork(
        input, format, destination, in_place=in_place, plot=plot, report=report, most_sweeps=max_sweeps, json=json,
        quiet=quiet, command=command_of(context),
    )  # fmt: skip
    options = SmoothOptions(  # before the file is read, which may be large
        method=method, variant=variant, objective=objective, max_sweeps=max_sweeps, threads=threads,
        target_quality=target_quality, target_angle=target_angle, target_dihedral=target_dihedral,
        preserve=preserve, fix_layers=fix_layers, untangle=untangle, guard=guard, seed=seed,
        callback=work.after_sweep, weights=weights, best_by=best_by,
        slide=True if slide and "all" in slide else slide or None, feature_angle=feature_angle,
        **values_at_nodes(metric, size),
    )  # fmt: skip

    def make(mesh: Mesh) -> Callable[[], SmoothResult]:
        return partial(smooth_with, mesh, options, fixed_nodes(mesh, fix) if fix else None)

    def told(done: Done) -> Outcome:
        return Outcome(done.mesh, done.result, done.compiled, input, done.written, done.lost, plot, report)

    work.carry_out(lambda mesh: check_mesh(mesh, options.target), make, told)
