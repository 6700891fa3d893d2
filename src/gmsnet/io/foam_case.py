"""The folder of an OpenFOAM mesh: where it is in a case, and which of its files are compressed."""

from __future__ import annotations

import os

from gmsnet.errors import InputError

MESH = os.path.join("constant", "polyMesh")
MAIN = "points"
GZ = ".gz"
OPENFOAM = "openfoam"  # the format whose meshes are folders


def mesh_folder(path: str) -> str | None:
    """The folder that holds the mesh of a case, or None where a path leads to none.

    path: of the case, of its mesh's folder, of the file of points there, or of the ``.foam`` file of ParaView.
    """
    folder, name = os.path.split(path)
    if name in (MAIN, MAIN + GZ):
        return folder or os.curdir
    if name.lower().endswith(".foam"):
        path = folder or os.curdir
    if not os.path.isdir(path):
        return None
    inner = os.path.join(path, MESH)
    if os.path.isdir(inner):
        return inner
    own = os.path.basename(os.path.abspath(path)) == "polyMesh" or any(
        os.path.isfile(os.path.join(path, MAIN + gz)) for gz in ("", GZ)
    )
    return path if own else None


def file_in(folder: str, name: str, gz: bool = False) -> str:
    """The path of a file of the mesh: plain if it is there, else compressed if that is; else as ``gz`` says."""
    plain = os.path.join(folder, name)
    if os.path.exists(plain):
        return plain
    return plain + GZ if gz or os.path.exists(plain + GZ) else plain


def case_of(name: str, format: str | None) -> str | None:
    """The folder of an OpenFOAM mesh that a path leads to; None where it is none, or another format is asked for.

    Raises InputError where this format is asked for and there is no such folder.
    """
    asked = isinstance(format, str) and format.lower() == OPENFOAM
    folder = mesh_folder(name) if format is None or asked else None
    if folder is None and asked:
        raise InputError(f"{name}: there is no mesh of an OpenFOAM case: give the folder that holds constant/polyMesh")
    return folder
