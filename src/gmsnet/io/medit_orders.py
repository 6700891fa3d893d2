"""In which order Medit lists the nodes of cells of second order: its own, or the one that the file tells.

A file may say by ``HexahedraQ2Ordering`` and its like where each node of a cell lies: in halves of the ideal cell along
its axes, or of its corners' weights where these are a simplex.

Gmsh writes quadrilaterals and hexahedra of second order under the keywords of the first, in its own order (4.15).
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.io.gmsh_sections import KINDS

_SQUARE = ((0, 0), (2, 0), (2, 2), (0, 2))
_CORNERS: dict[str, tuple[tuple[int, ...], ...]] = {
    "EdgesP2": ((0,), (2,)),
    "TrianglesP2": tuple(tuple(2 * (k == n) for k in range(3)) for n in range(3)),
    "TetrahedraP2": tuple(tuple(2 * (k == n) for k in range(4)) for n in range(4)),
    "QuadrilateralsQ2": _SQUARE,
    "HexahedraQ2": tuple((*xy, z) for z, xy in product((0, 2), _SQUARE)),
    "PrismsP2": tuple((*(2 * (k == n) for k in range(3)), z) for z, n in product((0, 2), range(3))),
    "PyramidsP2": (*((*xy, 0) for xy in _SQUARE), (0, 0, 2)),
}
ORDERINGS = {f"{key}Ordering": key for key in _CORNERS}

# The place in Medit's list of each of Mesh's nodes. It has the middle of a hexahedron's face at the bottom first, then
# that at the top, then those around.
_OWN = {"HexahedraQ2": (*range(20), 25, 23, 22, 24, 20, 21, 26)}

# What may stand under a keyword of the first order, and the place in Gmsh's list of each of Mesh's nodes.
WIDER = {"Quadrilaterals": ("quad8", "quad9"), "Hexahedra": ("hexahedron20", "hexahedron27")}
BY_GMSH = {row.name: np.array(row.order) for row in KINDS.values() if row.order is not None}


def lattice(key: str, kind: str) -> NDArray[np.int64]:
    """Where each of Mesh's nodes of a kind lies, in halves."""
    cell, corners = CELLS[kind], np.array(_CORNERS[key])
    assert cell.nodes is not None
    found = np.empty((cell.nodes, corners.shape[1]), dtype=np.int64)
    found[-1] = 1  # the middle of the cell, where the kind has one
    found[: len(corners)] = corners
    for first, last, middle in cell.edges if cell.dimension > 1 else ((0, 1, 2),):
        found[middle] = (corners[first] + corners[last]) // 2
    for facet in cell.facets if cell.dimension == 3 else ():
        if len(facet) == 9:
            found[facet[8]] = corners[list(facet[:4])].sum(axis=0) // 4
    return found


def order_of(key: str, kind: str, told: NDArray[np.int64] | None) -> NDArray[np.int64] | None:
    """The place in the file's list of each of Mesh's nodes; None where it is the same. ``told``: what the file says.

    Raises ValueError where the file does not name each node once.
    """
    if told is None:
        own = _OWN.get(key)
        return None if own is None else np.array(own)
    ours = lattice(key, kind)
    if not np.array_equal(np.unique(told, axis=0), np.unique(ours, axis=0)) or len(told) != len(ours):
        raise ValueError(key)
    order: NDArray[np.int64] = (told[None, :] == ours[:, None]).all(axis=2).argmax(axis=1)
    return order


def as_written(key: str, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """The nodes of cells as Medit lists them where the file says nothing."""
    own = _OWN.get(key)
    return nodes if own is None else nodes[:, np.argsort(own)]
