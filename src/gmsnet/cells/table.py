"""The table of all kinds of cells that are known. A name that is not in it is never taken for another kind."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from gmsnet.cells import hexahedron, line, polygon, pyramid, quadrilateral, tetrahedron, triangle, wedge
from gmsnet.cells.kind import CellKind

__all__ = ["CELLS", "CellKind", "face_name", "nodes_of"]

CELLS: Mapping[str, CellKind] = MappingProxyType({
    kind.name: kind
    for family in (line, triangle, quadrilateral, polygon, tetrahedron, hexahedron, wedge, pyramid, )
    for kind in family.KINDS
})  # fmt: skip
_FACES = {kind.corners: kind.name for kind in CELLS.values() if kind.dimension == 2 and kind.order == 1}


def nodes_of(name: str) -> int:
    """How many nodes each cell of a kind has. KeyError for an unknown kind and for one whose cells differ in it."""
    count = CELLS[name].nodes
    if count is None:
        raise KeyError(name)
    return count


def face_name(corners: int) -> str:
    """The name of a face with straight edges and so many corners."""
    return _FACES.get(corners, "polygon")
