"""The types of cells in XDMF files, and cells of other grids that mark those of a mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.io.cell_table import Kind, table_blocks
from gmsnet.io.xml_tree import Element
from gmsnet.mesh.cell_block import CellBlock

Ints = NDArray[np.int64]

TYPES = {  # lower case, without underscores → its number in a list of mixed types, and the kind of cell
    "polyvertex": (1, "vertex"), "polyline": (2, "line"), "polygon": (3, "polygon"), "triangle": (4, "triangle"),
    "quadrilateral": (5, "quad"), "tetrahedron": (6, "tetra"), "pyramid": (7, "pyramid"), "wedge": (8, "wedge"),
    "hexahedron": (9, "hexahedron"), "edge3": (34, "line3"), "quadrilateral9": (35, "quad9"),
    "triangle6": (36, "triangle6"), "quadrilateral8": (37, "quad8"), "tetrahedron10": (38, "tetra10"),
    "pyramid13": (39, "pyramid13"), "wedge15": (40, "wedge15"), "wedge18": (41, "wedge18"),
    "hexahedron20": (48, "hexahedron20"), "hexahedron27": (50, "hexahedron27"),
}  # fmt: skip
SHORT = {"tri": "triangle", "quad": "quadrilateral", "tet": "tetrahedron", "hex": "hexahedron", "pyr": "pyramid"}
MIXED = dict(TYPES.values())
COUNTED = (1, 2, 3)  # in a list of mixed types the number of their nodes follows these
TABLE = {code: Kind(kind) for code, kind in MIXED.items()}


def cell_word(topology: Element) -> str:
    """The type of the cells of a topology, as in TYPES."""
    word = topology.get("TopologyType", "Type").lower().replace("_", "")
    beginning = word.rstrip("0123456789")
    return SHORT.get(beginning, beginning) + word[len(beginning) :]


class Mark(NamedTuple):
    """Cells of another grid: type, number of nodes and number of each (n,); nodes of all one after another."""

    codes: Ints
    sizes: Ints
    nodes: Ints
    numbers: Ints


class Tags:
    """What other grids say of a mesh. lower: their cells of fewer dimensions; used: how many grids say something."""

    codes: Ints
    sizes: Ints
    nodes: Ints
    used: int

    def __init__(self, codes: Ints, sizes: Ints, nodes: Ints) -> None:
        self.codes, self.sizes, self.nodes = codes, sizes, nodes
        self.lower: list[CellBlock] = []
        self.used = 0

    def apply(self, mark: Mark, regions: Ints) -> Ints:
        """The regions of the mesh's cells once those that a grid lists have its numbers."""
        if not len(mark.codes) or _dimension(mark.codes) < _dimension(self.codes):
            self.lower += table_blocks(TABLE, mark.codes, mark.sizes, mark.nodes, mark.numbers, {})[0]
            self.used += 1
            return regions
        if len({*self.codes.tolist(), *mark.codes.tolist()}) != 1 or np.ptp(self.sizes):
            return regions  # cells of several types are not matched: the grid is named among what is not read
        width, count = int(self.sizes[0]), len(self.codes)
        rows = np.sort(np.concatenate([self.nodes, mark.nodes]).reshape(-1, width), axis=1)
        same = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
        place = np.full(len(rows), -1)
        place[same[:count]] = np.arange(count)
        found = place[same[count:]]
        if (found < 0).any():
            return regions
        self.used += 1
        out = regions.copy()
        out[found] = mark.numbers
        return out


def _dimension(codes: Ints) -> int:
    return max((CELLS[MIXED[code]].dimension for code in np.unique(codes).tolist()), default=0)
