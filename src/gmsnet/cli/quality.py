"""``gmsnet quality``: how good the cells of a mesh are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gmsnet.errors import InputError

if TYPE_CHECKING:
    from gmsnet.measure.report import QualityReport
    from gmsnet.mesh.mesh import Mesh


def quality(
    context: typer.Context,
    input: Annotated[str, typer.Argument(metavar="IN", help="The mesh file; - reads the standard input.")],
    other: Annotated[str | None, typer.Argument(metavar="OTHER", help="A second one to compare with.")] = None,
    threshold: Annotated[
        float | None,
        typer.Option(help="Name the cells whose 1/q is below this; exit code 1 if there are any."),
    ] = None,
    format: Annotated[str | None, typer.Option(help="Format of IN, where its suffix does not tell it.")] = None,
    plot: Annotated[str | None, typer.Option(metavar="FILE", help="Draw the mesh (.png, .svg or .pdf).")] = None,
    report: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Write one HTML file that shows the mesh and its figures."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document instead of tables.")] = False,
) -> None:
    """Measure the triangles and quads, or the volumes, of a mesh: angles, 1/q or η, inverted, the worst.

    Hexahedra, wedges and pyramids count as inverted unless they are valid everywhere in them.

    Two meshes are measured side by side; how far nodes have moved is told as well where both have the same cells.
    """
    from gmsnet.cli.destination import check_picture, check_report, shown
    from gmsnet.mesh.display import amount

    if threshold is not None and not -1.0 <= threshold <= 1.0:
        raise InputError(f"--threshold is a value of 1/q and must lie between -1 and 1, got {threshold:g}")
    if plot is not None and other is not None:
        raise InputError("--plot draws one mesh: leave it out, or leave out the second mesh")
    if report is not None and other is not None:
        raise InputError("--report shows one mesh: leave it out, or leave out the second mesh")
    if plot is not None:
        check_picture(plot, input)
    if report is not None:
        check_report(report, input)
    if other is not None:
        from gmsnet.cli.comparison import compare

        raise typer.Exit(compare((input, other), threshold, format, json=json))

    from gmsnet.cli import output
    from gmsnet.cli import report as tables
    from gmsnet.cli.rank_files import measured_in_pieces
    from gmsnet.measure.overview import Overview

    found = None if plot or report else measured_in_pieces(input, format, threshold)
    mesh = None
    if found is None:
        mesh, measures = _measured(input, format, plot)
        found = Overview.of(mesh, measures, threshold)
    wanted = "volumes that can be measured" if found.volumes else "triangles and quads"
    if threshold is not None and found.others and not found.cells:
        raise InputError(
            f"{shown(input)}: a threshold is asked of {wanted}, and this mesh has none: "
            f"{found.others} cannot be measured so far"
        )
    if plot is not None and mesh is not None:
        from gmsnet.plot import plot_quality

        plot_quality(mesh, plot)
    few = found.below[0]
    document = {"input": input, "nodes": found.nodes, "planar": found.planar, **found.summary()}
    if threshold is not None:
        document |= {"threshold": threshold, "below_threshold": few}
    document |= {"worst": found.worst, "plot": plot, "report": report}
    if report is not None and mesh is not None:
        from gmsnet.cli.command import command_of
        from gmsnet.cli.quality_page import write_quality_page

        write_quality_page(report, input, mesh, measures, document, command_of(context))
    if json:
        output.print_json(document)
    else:
        console = output.console()
        console.print(f"{shown(input)}: {found.told}")
        if found.cells:
            console.print()
            console.print(tables.figures({"now": found}))
            console.print("\nworst cells (numbers from 0)")
            console.print(tables.worst_table(found.worst))
        else:
            console.print(f"there are no {wanted if found.volumes else 'triangles or quads to measure'}")
        if found.others:
            console.print(f"not measured: {found.others}")
        for remark in found.remarks:
            console.print(remark)
        if not (found.planar or found.volumes):
            console.print(
                "the mesh is a surface in space: its cells have no sign, and only those without area count as inverted"
            )
        if found.gathered and found.cells:
            console.print(f"ranks: the first one measured all {amount(found.nodes, 'node')}, for {found.gathered}")
        if plot is not None:
            console.print(f"picture: {plot}")
        if report is not None:
            console.print(f"report: {report}")
    if threshold is not None and few:
        typer.echo(f"gmsnet: below the threshold {threshold:g}: {found.below_in_words()}", err=True)
        raise typer.Exit(1)


def _measured(input: str, format: str | None, plot: str | None) -> tuple[Mesh, QualityReport]:
    from gmsnet import io
    from gmsnet.cli.destination import check_drawable, shown
    from gmsnet.run.api import quality as measure

    mesh = io.read(input, format)
    if plot is not None:
        check_drawable(mesh, input)
    try:
        return mesh, measure(mesh)
    except InputError as error:
        raise InputError(f"{shown(input)}: {error}") from error
