"""``gmsnet gmsh``: Gmsh's window with a button that smooths."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from gmsnet.errors import InputError, MissingExtraError


def gmsh(
    input: Annotated[str, typer.Argument(metavar="FILE", help="A mesh or a geometry that Gmsh opens.")],
) -> None:
    """Open a file in Gmsh with a button "Smooth", which smooths the mesh that is shown.

    Save the mesh with Gmsh's own menu. Gmsh is not part of gmsnet: pip install gmsh.
    """
    if not os.path.isfile(input):
        raise InputError(f"{input}: there is no such file")
    try:
        import gmsh as library
    except ModuleNotFoundError as error:
        if error.name != "gmsh":
            raise  # it is there, but something that it needs is not
        raise MissingExtraError("Gmsh is not installed: pip install gmsh") from error

    from gmsnet.gmsh.window import run

    run(library, input)
