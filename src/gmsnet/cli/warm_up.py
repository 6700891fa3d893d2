"""``gmsnet warm-up``: compile ahead of the first run."""

from __future__ import annotations

from typing import Annotated

import typer


def _kinds() -> list[str]:
    from gmsnet.run.warm_up import KINDS

    return list(KINDS)


def warm_up(
    cells: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND",
            help="Compile for these: triangle, quad (with triangles or not), tetra, second-order. Default: all.",
            autocompletion=_kinds,
        ),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Compile the kernels ahead, so that no later run has to: minutes, once.

    They are kept in the folder that GMSNET_CACHE names, else beside the package or in the user's cache folder.
    """
    from gmsnet.cli import output
    from gmsnet.mesh.display import plain
    from gmsnet.run.warm_up import warm_up as compile_ahead

    for kind, seconds in compile_ahead(cells):
        if not quiet:
            done = f"compiled in {plain(seconds)} s" if seconds else "nothing to compile"
            output.console().print(f"{kind}: {done}")
