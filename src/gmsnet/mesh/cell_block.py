"""Cells of one type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.mesh.arrays import whole_numbers

DIMENSION = {  # of the cell types that are known by name (meshio's names); all others count as volumes
    "vertex": 0,
    **dict.fromkeys(("line", "line3", "line4"), 1),
    **dict.fromkeys(("triangle", "triangle6", "triangle7", "triangle10"), 2),
    **dict.fromkeys(("quad", "quad8", "quad9", "polygon"), 2),
}
CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "triangle10": 3, "quad": 4, "quad8": 4, "quad9": 4}
NODES = {"vertex": 1, "line": 2, "line3": 3, "line4": 4, "triangle": 3, "triangle6": 6, "triangle7": 7,
         "triangle10": 10, "quad": 4, "quad8": 8, "quad9": 9, "tetra": 4, "tetra10": 10, "hexahedron": 8,
         "hexahedron20": 20, "wedge": 6, "pyramid": 5}  # fmt: skip


@dataclass(frozen=True, eq=False)
class CellBlock:
    """Cells of one type.

    kind: meshio's name of the type ("triangle", "line", "vertex", "quad", "triangle6", …; "polygon" for five nodes
    or more). nodes: (cells × nodes per cell), indices into the points. regions: (cells,) the region of each cell;
    for lines and vertices this is the marker that they belong to. Both may be given as any array or list of whole
    numbers; they are kept as read-only arrays that share no memory with anything writable.

    Raises InputError for numbers that are not whole, masked values and arrays of the wrong shape.
    """

    kind: str
    nodes: NDArray[np.int64]
    regions: NDArray[np.int64]

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str):
            raise InputError(f'the type of cells must be a name such as "triangle", got {self.kind!r}')
        nodes = whole_numbers(self.nodes, f"the nodes of {self.kind!r} cells")
        regions = whole_numbers(self.regions, f"the regions of {self.kind!r} cells", bools=True)
        if nodes.ndim != 2:
            raise InputError(f"cells of type {self.kind!r} must be an array (cells × nodes), got shape {nodes.shape}")
        if nodes.shape[1] != NODES.get(self.kind, nodes.shape[1]):
            raise InputError(f"a cell of type {self.kind!r} has {NODES[self.kind]} nodes, got {nodes.shape[1]}")
        if regions.shape != (len(nodes),):
            raise InputError(f"{len(nodes)} {self.kind} cells need one region each, got shape {regions.shape}")
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "regions", regions)

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle, which knows nothing of arrays that are read-only: the block is made, and checked, anew."""
        return CellBlock, (self.kind, self.nodes, self.regions)

    @property
    def dimension(self) -> int:
        """0 for vertices, 1 for lines, 2 for faces, 3 for volumes."""
        return DIMENSION.get(self.kind, 3)
