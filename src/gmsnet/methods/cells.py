"""Which methods move the nodes of which cells."""

from __future__ import annotations

from gmsnet.errors import InputError
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import METHODS, method_named


def check_cells(mesh: Mesh, name: str, objective: str | None = None) -> None:
    """InputError if the mesh has quads and the method, with this objective, moves triangles alone.

    Such a mesh it does not smooth at all: nodes of triangles alone would be moved as if there were no quads.
    """
    method = method_named(name)
    count = sum(len(block.nodes) for block in mesh.cells if block.kind == "quad")
    if not count or method.moves("quad", objective):
        return
    quads = "1 quad" if count == 1 else f"{count:,} quads"
    others = ", ".join(each.name for each in METHODS.values() if each.moves("quad") and each is not method)
    able = ", ".join(each for each in method.objectives if method.moves("quad", each))
    if able:
        raise InputError(
            f"the objective {objective} of {name} moves triangles alone, and this mesh has {quads}: "
            f"choose one of its objectives {able}, or another method: {others}"
        )
    raise InputError(f"{name} moves triangles alone, and this mesh has {quads}: choose {others}")
