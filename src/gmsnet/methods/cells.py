"""Which methods move the nodes of which cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NoReturn

from gmsnet.cells.jacobian import has_form
from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import METHODS, method_named
from gmsnet.methods.base import TRIANGLES, Method

NAMES = {
    "quad": ("quad", "quads"), "tetra": ("tetrahedron", "tetrahedra"), "hexahedron": ("hexahedron", "hexahedra"),
    "wedge": ("wedge", "wedges"), "pyramid": ("pyramid", "pyramids"),
}  # fmt: skip


def check_cells(
    mesh: Mesh, name: str, choice: str | None = None, counts: Mapping[str, int] | None = None
) -> None:  # fmt: skip
    """InputError if the mesh has quads or tetrahedra and the method, with this objective or variant, leaves them.

    Such a mesh it does not smooth at all: nodes of triangles alone would be moved as if there were no quads.

    counts: kind → how many cells, where the mesh is but a part.
    """
    if counts is None:
        counts = counts_of(mesh)
    method = method_named(name)
    choice = choice or method.default
    if mesh.plane is None and not mesh.has_volumes and not method.moves_surfaces(choice):
        others = ", ".join(each.name for each in METHODS.values() if each.surfaces)
        raise InputError(
            f"{name}{f' ({choice})' if method.surfaces else ''} is not for surfaces in space: choose {others}"
        )
    for kind in ("tetra", "hexahedron", "wedge", "pyramid") if mesh.has_volumes else ("quad",):
        count = sum(many for each, many in counts.items() if _alike(each, kind))
        if count and not method.moves(kind, choice):
            _refuse(method, choice, kind, count)


def counts_of(mesh: Mesh) -> dict[str, int]:
    """Kind → how many cells."""
    found: dict[str, int] = {}
    for block in mesh.cells:
        found[block.kind] = found.get(block.kind, 0) + len(block.nodes)
    return found


def _alike(kind: str, straight: str) -> bool:
    """Is this that kind, or, of volumes, that of the second order whose corners move as its corners do?"""
    if kind not in CELLS:
        return False
    own, other = CELLS[kind], CELLS[straight]
    curved = own.dimension == other.dimension == 3 and own.corners == other.corners and has_form(kind)
    return kind == straight or curved


def _refuse(method: Method, choice: str, kind: str, count: int) -> NoReturn:
    """InputError that says what else to choose."""
    name = method.name
    one, many = NAMES[kind]
    moves = "moves triangles alone" if method.cells == TRIANGLES or kind == "quad" else "moves cells in a plane alone"
    cells = f"1 {one}" if count == 1 else f"{count:,} {many}"
    others = ", ".join(each.name for each in METHODS.values() if each.moves(kind) and each is not method)
    what = "objective" if choice in method.objectives else "variant"
    able = ", ".join(each for each in getattr(method, f"{what}s") if method.moves(kind, each))
    if able and kind in method.cells:
        raise InputError(
            f"the {what} {choice} of {name} {moves}, and this mesh has {cells}: "
            f"choose one of its {what}s {able}, or another method: {others}"
        )
    raise InputError(f"{name} {moves}, and this mesh has {cells}: choose {others}")
