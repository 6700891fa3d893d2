"""``gmsnet smooth``: a mesh file in, the same file with better elements out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from gmsnet.run.sweep import MOST_SWEEPS

if TYPE_CHECKING:
    from gmsnet.cli.destination import Destination
    from gmsnet.mesh.mesh import Mesh
    from gmsnet.run.smooth_result import SmoothResult


def _method_names() -> list[str]:
    from gmsnet.methods import METHODS

    return list(METHODS)


def _format_names() -> list[str]:
    from gmsnet.io import FORMATS

    return list(FORMATS)


def smooth(
    context: typer.Context,
    input: Annotated[str, typer.Argument(metavar="IN", help="The mesh file to smooth; - reads the standard input.")],
    others: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="OUT", help="The file to write; - writes the standard output. With --out-dir: further inputs."
        ),
    ] = None,
    method: Annotated[
        str, typer.Option(help="The smoother; see 'gmsnet methods'.", autocompletion=_method_names)
    ] = "auto",
    variant: Annotated[str | None, typer.Option(help="A variant of the method; see 'gmsnet methods'.")] = None,
    objective: Annotated[str | None, typer.Option(help="What 'optimize' minimises; see 'gmsnet methods'.")] = None,
    max_sweeps: Annotated[
        int, typer.Option(min=0, help="Make at most so many sweeps (untangling comes before).")
    ] = MOST_SWEEPS,
    target_quality: Annotated[
        float | None,
        typer.Option(
            help="Smooth only around cells whose 1/q is below this, in (0, 1], until none is; exit code 1 if some stay."
        ),
    ] = None,
    target_angle: Annotated[
        float | None,
        typer.Option(
            help="The same for the minimum angle of a cell, in degrees, in (0, 60], of quads alone in (0, 89]."
        ),
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
            help="shape: hold layers of stretched cells along walls; none; in a plane also size: weigh areas of cells, "
            "too, or metric: keep all stretch and sizes as a smooth metric.",
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
            help="Let nodes of boundaries, interfaces and markers move along their curves, and boundary nodes of "
            "volumes on their surface: all, or a marker's name. Repeatable.",
        ),
    ] = None,
    feature_angle: Annotated[
        float,
        typer.Option(
            help="With --slide: curves end, and edges of surfaces are sharp, where they turn by so many degrees."
        ),
    ] = 30.0,
    surface_tolerance: Annotated[
        float | None,
        typer.Option(
            metavar="X",
            help="How far nodes of surfaces may go from the input's facets, over the length of their edges.",
            show_default="0.05",
        ),
    ] = None,
    hausdorff: Annotated[
        float | None,
        typer.Option(
            metavar="X",
            help="How far facets of surfaces, or of boundaries that slide, may go from the input's, over the diagonal.",
            show_default="0.02, volumes 0.01",
        ),
    ] = None,
    free_needles: Annotated[
        bool,
        typer.Option(help="Edges of surfaces that look sharp only because a facet is thin are no features."),
    ] = False,
    update_normals: Annotated[
        bool, typer.Option(help="Of surfaces: compute normals that the file keeps anew where nodes have moved.")
    ] = False,
    join_regions: Annotated[
        bool,
        typer.Option(
            "--join-regions", help="Regions mean nothing: nodes of interfaces between them may move, but for markers."
        ),
    ] = False,
    threads: Annotated[
        int | None,
        typer.Option(min=1, help="Use at most so many processors (default: all). Same result for any number."),
    ] = None,
    device: Annotated[
        str,
        typer.Option(
            help="cpu, or cuda: a GPU of NVIDIA does the sweeps that it can. Same result.",
            autocompletion=lambda: ["cpu", "cuda"],
        ),
    ] = "cpu",
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
    out_dir: Annotated[
        str | None,
        typer.Option(
            metavar="FOLDER",
            help="Smooth all that is named, files, folders and patterns, and write each by its name to this folder.",
        ),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Do everything but write; OUT may be left out.")] = False,
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

    With --out-dir a line tells of each file, with --json a document. A file that fails does not stop the others, and
    the exit code is that of the worst.

    Formats are told by the suffix: .su2 .msh .vtk .vtu .mesh .node/.ele .stl .obj .off .ply; OUT of another format
    than IN is converted.

    Ctrl-C stops the smoothing; the best mesh so far is written. A second one ends at once and writes nothing.
    """
    from gmsnet.cli.destination import check_picture, check_report, destination_of, refuse_mixture
    from gmsnet.cli.several import Job, carry_out_each, jobs_of, only_output

    single = {"--in-place": in_place, "--plot": plot is not None, "--report": report is not None}
    output = only_output(others or [], out_dir, [option for option, given in single.items() if given])
    whole = None if out_dir is not None or (dry_run and output is None and not in_place) else destination_of(
        input, output, in_place, output_format, format
    )  # fmt: skip
    if whole is not None:
        refuse_mixture(whole, json)
    if plot is not None:
        check_picture(plot, input, whole)
    if report is not None:
        check_report(report, input, whole)

    # Heavy imports only now, when the command line is known to be in order.
    from gmsnet.cli import output as printed
    from gmsnet.cli.command import command_of
    from gmsnet.cli.file_work import Done, FileWork
    from gmsnet.cli.fix import fixed_nodes
    from gmsnet.cli.metric import values_at_nodes
    from gmsnet.cli.rank_files import shared_format, smooth_in_pieces
    from gmsnet.cli.ranks import smooth_function
    from gmsnet.cli.smooth_report import Outcome
    from gmsnet.run.options import SmoothOptions
    from gmsnet.run.set_up import check_mesh

    asked = SmoothOptions(  # before the file is read, which may be large
        method=method, variant=variant, objective=objective, max_sweeps=max_sweeps, threads=threads,
        target_quality=target_quality, target_angle=target_angle, target_dihedral=target_dihedral,
        preserve=preserve, fix_layers=fix_layers, untangle=untangle, guard=guard, seed=seed, weights=weights,
        best_by=best_by,
        slide=slide or None, feature_angle=feature_angle,
        surface_tolerance=surface_tolerance, hausdorff=hausdorff, free_needles=free_needles,
        update_normals=update_normals, join_regions=join_regions, device=device, **values_at_nodes(metric, size),
    )  # fmt: skip

    held, whole_on_first = fix or [], any((plot, report, metric, size, update_normals))

    def one(job: Job, destination: Destination | None) -> tuple[int, bool]:
        work = FileWork(
            job.source, format, destination, in_place=in_place, plot=plot, report=report, most_sweeps=max_sweeps,
            json=json, quiet=quiet, command=command_of(context), number=job.number, dry_run=dry_run,
        )  # fmt: skip
        options = replace(asked, callback=work.after_sweep)
        target = job.source if destination is None else destination.path
        kind = "" if whole_on_first else shared_format(job.source, target, format, output_format, held, slide or [])
        if kind:
            return smooth_in_pieces(work, options, kind, held), work.interruption.caught

        def make(mesh: Mesh) -> Callable[[], SmoothResult]:
            return partial(smooth_function(), mesh, options, fixed_nodes(mesh, held) if held else None)

        def told(done: Done) -> Outcome:
            return Outcome(done.mesh, done.result, done.compiled, job.source, done.written, done.lost, plot, report)

        code = work.carry_out(lambda mesh: check_mesh(mesh, options.target), make, told)
        return code, work.interruption.caught

    if out_dir is None:
        raise typer.Exit(one(Job(input, output or "", ""), whole)[0])

    def into_folder(job: Job) -> tuple[int, bool]:
        return one(job, None if dry_run else destination_of(job.source, job.output, False, output_format, format))

    def fail(job: Job, text: str) -> None:
        if json:
            printed.print_json({"input": job.source, "error": text}, line=True)

    jobs = jobs_of([input, *(others or [])], out_dir, output_format, dry_run=dry_run, read_as=format)
    carry_out_each(jobs, into_folder, fail, quiet=quiet or json)
