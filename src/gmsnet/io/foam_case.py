"""The folder of an OpenFOAM mesh: where it is in a case, and which of its files are compressed."""

from __future__ import annotations

import os

MESH = os.path.join("constant", "polyMesh")
MAIN = "points"
GZ = ".gz"


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
