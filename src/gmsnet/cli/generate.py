"""gmsnet generate: random test meshes in any format that is written."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

RINGS_BYTES = 1 << 28  # of a file of rings at most: some ten million nodes on the boundary


def generate(
    out: Annotated[str, typer.Argument(metavar="OUT", help="The file to write; its suffix tells the format.")],
    shape: Annotated[
        str, typer.Option(help="square, circle, plate (a square with a round hole) or lshape.")
    ] = "square",
    rings: Annotated[
        Path | None,
        typer.Option(help="Instead of --shape: a JSON file [[[x, y], …], …], the outer ring first, then its holes."),
    ] = None,
    nodes: Annotated[int, typer.Option(help="Random nodes inside.")] = 1000,
    size: Annotated[float, typer.Option(help="Side of the square around the shape; factor for --rings.")] = 1.0,
    boundary: Annotated[str, typer.Option(help="Spacing of the nodes on the boundary: even or random.")] = "even",
    seed: Annotated[int, typer.Option(help="The same seed makes the same mesh.")] = 0,
    jitter: Annotated[
        float, typer.Option(help="Then throw each inner node up to this many of its mean edge lengths away.")
    ] = 0.0,
    tangled: Annotated[bool, typer.Option("--tangled", help="With --jitter: let cells be inverted by it.")] = False,
    format: Annotated[str | None, typer.Option(help="The format, where the suffix does not tell it.")] = None,
) -> None:
    """Make a random Delaunay mesh, with bad elements on purpose, and write it to OUT.

    Nodes are uniform in the shape; the boundary is held by markers (bottom, right, circle, hole, …).
    """
    import numpy as np

    from gmsnet.errors import InputError
    from gmsnet.generate import disturb, random_mesh
    from gmsnet.io import write
    from gmsnet.io.streams import is_standard_output

    if tangled and not jitter:
        raise InputError("--tangled needs --jitter: how far may nodes be thrown?")
    if not (math.isfinite(jitter) and jitter >= 0):
        raise InputError(f"--jitter must be 0 or more, got {jitter}")
    outline = shape if rings is None else _read_rings(rings)
    mesh = random_mesh(nodes, outline, size=size, boundary=boundary, seed=seed)
    triangles, lines = mesh.cells
    if jitter:
        inner = np.ones(len(mesh.points), dtype=bool)
        inner[lines.nodes] = False
        mesh = disturb(mesh, inner, jitter, seed=seed, keep_valid=not tangled)
    aside = is_standard_output(out)  # where the mesh itself goes; a file is another one once it is replaced
    lost = write(mesh, out, format)
    typer.echo(
        f"{'standard output' if out == '-' else out}: {shape if rings is None else rings} "
        f"with {len(mesh.points):,} nodes, {len(triangles.nodes):,} triangles and {len(lines.nodes):,} boundary edges "
        f"(seed {seed})",
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
