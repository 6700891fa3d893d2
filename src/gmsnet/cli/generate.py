"""gmsnet generate: test meshes in any format that is written."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

RINGS_BYTES = 1 << 28  # of a file of rings at most: some ten million nodes on the boundary


def generate(
    out: Annotated[str, typer.Argument(metavar="OUT", help="The file to write; its suffix tells the format.")],
    pattern: Annotated[
        str,
        typer.Option(
            help="random, structured (rows and columns, or a body-centred lattice), o-grid (layers around a body), "
            "c-grid (and along its wake), swept (a disc or --shape along a way), "
            "adapted (to a front inside), kershaw (zigzag), layered (prisms or tetrahedra on a wall) part (a cube "
            "of tetrahedra with two holes); surfaces, some of them volumes: sphere, torus, cylinder, cone, organic or "
            "bracket (an L with fillets and holes)."
        ),
    ] = "random",
    cells: Annotated[
        str | None,
        typer.Option(
            help="triangle, quad, mixed, tetra, hexahedron, wedge, pyramid or mixed-volume.",
            show_default="triangle; mixed if o-grid, tetra if layered or part, hexahedron if swept, quad if "
            "structured or kershaw",
        ),
    ] = None,
    shape: Annotated[
        str | None,
        typer.Option(help="square, circle, plate (a square with a round hole) or lshape.", show_default="square"),
    ] = None,
    rings: Annotated[
        Path | None,
        typer.Option(help="Instead of --shape: a JSON file [[[x, y], …], …], the outer ring first, then its holes."),
    ] = None,
    nodes: Annotated[
        int | None,
        typer.Option(
            help="Random nodes inside; of quads, grids, lattices and surfaces about so many.", show_default="1000"
        ),
    ] = None,
    size: Annotated[
        float, typer.Option(help="Side of the square around the shape; chord of the body; factor for --rings.")
    ] = 1.0,
    boundary: Annotated[
        str | None, typer.Option(help="Spacing of the nodes on the boundary: even or random.", show_default="even")
    ] = None,
    settle: Annotated[
        int | None, typer.Option(help="Of random: sweeps of Laplacian smoothing of the triangles.", show_default="0")
    ] = None,
    columns: Annotated[
        int | None,
        typer.Option(help="Columns of quads, cubes or the lattice, of the square inside an O-grid that is swept."),
    ] = None,
    rows: Annotated[int | None, typer.Option(help="Of structured and kershaw: rows of quads.")] = None,
    flatness: Annotated[
        float | None, typer.Option(help="Of kershaw: height of the flattest quads over the mean.", show_default="0.3")
    ] = None,
    share: Annotated[
        float | None, typer.Option(help="Of structured mixed: area of the patch of quads.", show_default="0.5")
    ] = None,
    interface: Annotated[
        bool, typer.Option("--interface", help="Of structured mixed: the patch is a region of its own.")
    ] = False,
    layers: Annotated[
        int | None, typer.Option(help="Of o-grid, c-grid, layered and swept: rows of cells.", show_default="20; 8")
    ] = None,
    aspect: Annotated[
        float | None,
        typer.Option(
            help="Of o-grid, c-grid: ratio of sides at the wall (1000), of layered (50). Of adapted: at its front (10)."
        ),
    ] = None,
    around: Annotated[
        int | None, typer.Option(help="Of o-grid and c-grid: nodes on the wall.", show_default="120")
    ] = None,
    body: Annotated[str | None, typer.Option(help="Of o-grid: airfoil or circle.", show_default="airfoil")] = None,
    twist: Annotated[
        float | None, typer.Option(help="Of swept: by how many degrees the section turns.", show_default="0")
    ] = None,
    bend: Annotated[
        float | None, typer.Option(help="Of swept: of how many degrees the way is an arc.", show_default="0")
    ] = None,
    seed: Annotated[int, typer.Option(help="The same seed makes the same mesh.")] = 0,
    jitter: Annotated[
        float,
        typer.Option(
            help="Then throw each inner node up to this many of its edge lengths away, on surfaces along them."
        ),
    ] = 0.0,
    jitter_edge: Annotated[
        str | None, typer.Option(help="With --jitter: the node's mean or shortest edge.", show_default="mean")
    ] = None,
    tangled: Annotated[bool, typer.Option("--tangled", help="With --jitter: let cells be inverted by it.")] = False,
    format: Annotated[str | None, typer.Option(help="The format, where the suffix does not tell it.")] = None,
) -> None:
    """Make a mesh for tests and write it to OUT: random Delaunay triangles or tetrahedra, or other cells by a pattern.

    Nodes are uniform in the shape; the boundary is held by markers (bottom, right, circle, hole, …).
    """
    import numpy as np

    from gmsnet.cli.patterns import chosen
    from gmsnet.errors import InputError
    from gmsnet.generate import Shaped, disturb, disturb_on
    from gmsnet.io import write
    from gmsnet.io.streams import is_standard_output

    for name, value in (("--tangled", tangled), ("--jitter-edge", jitter_edge)):
        if value and not jitter:
            raise InputError(f"{name} needs --jitter: how far may nodes be thrown?")
    if not (math.isfinite(jitter) and jitter >= 0):
        raise InputError(f"--jitter must be 0 or more, got {jitter}")
    options = {
        "shape": shape, "rings": rings, "nodes": nodes, "boundary": boundary, "settle": settle, "columns": columns,
        "rows": rows, "flatness": flatness, "share": share, "interface": interface or None, "layers": layers,
        "aspect": aspect, "around": around, "body": body, "twist": twist, "bend": bend,
    }  # fmt: skip
    given: dict[str, Any] = {name: value for name, value in options.items() if value is not None}
    kind, generator = chosen(pattern, cells, given)
    if rings is not None:
        given["rings"] = _read_rings(rings)
    made = generator.make(given, size, seed)
    mesh = made.mesh if isinstance(made, Shaped) else made
    border = [block for block in mesh.cells if block.dimension == (2 if mesh.has_volumes else 1)]
    if jitter and isinstance(made, Shaped):
        mesh = disturb_on(made, jitter, seed=seed, keep_valid=not tangled, edge=jitter_edge or "mean").mesh
    elif jitter:
        inner = np.ones(len(mesh.points), dtype=bool)
        inner[np.concatenate([block.nodes.ravel() for block in border])] = False
        mesh = disturb(mesh, inner, jitter, seed=seed, keep_valid=not tangled, edge=jitter_edge or "mean")
    aside = is_standard_output(out)  # where the mesh itself goes; a file is another one once it is replaced
    lost = write(mesh, out, format)
    domain = "cube" if mesh.has_volumes else "square"
    what = f"{pattern} {kind}" if pattern != "random" else str(rings or shape or domain)
    sort = f"{'marked' if interface else 'boundary'} {'faces' if mesh.has_volumes else 'edges'}"
    counts = ", ".join(f"{len(block.nodes):,} {block.kind}s" for block in mesh.cells[: len(mesh.cells) - len(border)])
    counts += f" and {sum(len(block.nodes) for block in border):,} {sort}" if border else ""
    typer.echo(
        f"{'standard output' if out == '-' else out}: {what} with {len(mesh.points):,} nodes, {counts} (seed {seed})",
        err=aside,
    )
    for loss in lost:
        typer.echo(f"not in the file: {loss}", err=aside)


def _read_rings(path: Path) -> list[Any]:
    """What stands in a JSON file of rings; ``random_mesh`` checks the rings themselves."""
    from gmsnet.errors import InputError
    from gmsnet.io.contents import small

    try:
        given = json.loads(small(str(path), RINGS_BYTES, "rings").decode("utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: no JSON: {error}") from error
    if not isinstance(given, list):
        raise InputError(f"{path}: must hold a list of rings, [[[x, y], …], …]")
    return given
