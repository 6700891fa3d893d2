"""Ghost cells of VTK's files: copies of cells of other pieces, which other files hold as their own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.document import Parsed
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock

TYPES, LEVELS = "vtkGhostType", "vtkGhostLevels"  # the latter until VTK 7
DUPLICATE = 1  # the bit of a cell that another piece owns
GHOST_CELLS = "ghost cells"  # the region of vertices that hold their nodes
BITS = {TYPES: DUPLICATE, LEVELS: ~0}  # of which one tells that a cell is a copy


def ghosts(parsed: Parsed) -> list[NDArray[np.bool_]]:
    """For each block, which of its cells (n,) are copies of cells of another piece."""
    found = []
    for k, block in enumerate(parsed.cells):
        marks = np.zeros(len(block.nodes), dtype=bool)
        for name, bits in BITS.items():
            values = parsed.cell_data[name][k] if name in parsed.cell_data else marks
            if values.ndim == 1 and values.dtype.kind in "iu":
                marks = marks | marked(values, bits)
        found.append(marks)
    return found


def marked(values: NDArray[Any], bits: int) -> NDArray[np.bool_]:
    """Which whole numbers have any of some bits."""
    found: NDArray[np.bool_] = (values.astype(np.int64) & bits) != 0
    return found


def held(parsed: Parsed) -> Parsed:
    """The same file with the nodes of its ghost cells held: a piece by itself must not move what others move, too."""
    nodes = [block.nodes[marks].ravel() for block, marks in zip(parsed.cells, ghosts(parsed), strict=True)]
    return with_vertices(parsed, sorted_unique(np.concatenate(nodes)), GHOST_CELLS)


def with_vertices(parsed: Parsed, nodes: NDArray[np.int64], name: str) -> Parsed:
    """The same file with a vertex at each of these nodes (n,), which holds it, in a region of this name."""
    if not len(nodes):
        return parsed
    region = 1 + max((int(block.regions.max(initial=0)) for block in parsed.cells if block.dimension == 0), default=0)
    block = CellBlock("vertex", nodes[:, None], np.full(len(nodes), region))
    data = {
        key: (*arrays, np.zeros((len(nodes), *arrays[0].shape[1:]), dtype=arrays[0].dtype))
        for key, arrays in parsed.cell_data.items()
    }
    names = {**parsed.region_names, (0, region): name}
    return replace(parsed, cells=[*parsed.cells, block], cell_data=data, region_names=names)
