"""A generated mesh as a ``Mesh``: faces of the region "domain", and lines by the marker of their side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def marked(
    points: Floats, faces: Mapping[str, Ints], segments: Ints, side: Ints, markers: Sequence[str], *, scale: float = 1.0
) -> Mesh:
    """The mesh of some faces and of the segments (B × 2) that bound them.

    faces: kind of cell → nodes. side: (B,) which side each segment is part of. markers: of each side; sides may share
    one. scale: factor for the coordinates (N × 2).
    """
    names = list(dict.fromkeys(markers))
    number = np.array([names.index(name) + 1 for name in markers], dtype=np.int64)
    region_names = {(1, k): name for k, name in enumerate(names, start=1)} | {(2, 1): "domain"}
    cells = [CellBlock(kind, nodes, np.ones(len(nodes), dtype=np.int64)) for kind, nodes in faces.items()]
    cells.append(CellBlock("line", segments, number[side]))
    return Mesh(points * scale, tuple(cells), region_names)
