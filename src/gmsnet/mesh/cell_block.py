"""Cells of one type."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS, CellKind
from gmsnet.errors import InputError
from gmsnet.mesh.arrays import whole_numbers
from gmsnet.mesh.display import amount


def cells_in_words(cells: Iterable[CellBlock]) -> list[str]:
    """How many cells there are of each kind, as "12 quad cells"."""
    counts: dict[str, int] = {}
    for block in cells:
        counts[block.kind] = counts.get(block.kind, 0) + len(block.nodes)
    return counted_in_words(counts)


def counted_in_words(counts: Mapping[str, int]) -> list[str]:
    """The same. counts: kind → cells."""
    return [amount(count, f"{kind} cell") for kind, count in counts.items()]


@dataclass(frozen=True, eq=False)
class CellBlock:
    """Cells of one type.

    kind: meshio's name of the type ("triangle", "line", "vertex", "quad", "triangle6", …; "polygon" for five nodes
    or more). Nodes of cells whose kind is not in ``CELLS`` are held. nodes: (cells × nodes per cell), indices into the
    points. regions: (cells,) the region of each cell; for lines and vertices this is the marker that they belong to.
    Both may be given as any array or list of whole numbers; they are kept as read-only arrays that share no memory
    with anything writable.

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
        known = CELLS.get(self.kind)
        if known is not None and nodes.shape[1] != (known.nodes or nodes.shape[1]):
            raise InputError(f"a cell of type {self.kind!r} has {known.nodes} nodes, got {nodes.shape[1]}")
        if regions.shape != (len(nodes),):
            raise InputError(f"{len(nodes)} {self.kind} cells need one region each, got shape {regions.shape}")
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "regions", regions)

    def __repr__(self) -> str:
        """One line: of what kind, how many, and the numbers of their regions."""
        low, high = (self.regions.min(), self.regions.max()) if len(self.regions) else (0, 0)
        regions = f"region {low}" if low == high else f"regions {low} to {high}"
        return f"<CellBlock: {amount(len(self.nodes), f'{self.kind} cell')}, {regions}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle, which knows nothing of arrays that are read-only: the block is made, and checked, anew."""
        return CellBlock, (self.kind, self.nodes, self.regions)

    def in_one_region(self) -> CellBlock:
        """The same cells, all of region 0."""
        return CellBlock(self.kind, self.nodes, np.zeros(len(self.nodes), dtype=np.int64))

    @property
    def cell(self) -> CellKind:
        """What is known of each of the cells. InputError for a kind that is not known."""
        if self.kind not in CELLS:
            raise InputError(f"cells of type {self.kind!r} are not known: known are {', '.join(CELLS)}")
        return CELLS[self.kind]

    @property
    def dimension(self) -> int | None:
        """0 for vertices, 1 for lines, 2 for faces, 3 for volumes; None for a kind that is not known."""
        return self.cell.dimension if self.kind in CELLS else None

    @property
    def corners(self) -> int:
        """How many corners each cell has; they are its first nodes. InputError for a kind that is not known."""
        return self.cell.corners or int(self.nodes.shape[1])

    @property
    def triangular(self) -> bool:
        """Whether the cells are faces with three corners."""
        return self.dimension == 2 and self.corners == 3
