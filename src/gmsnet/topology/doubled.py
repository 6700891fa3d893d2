"""Volumes that have all nodes of another one, as files have them that were merged or written twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.volume import Volume

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def doubled(mesh: Mesh, among: Flags) -> tuple[Ints, Ints]:
    """The numbers of volumes that have all nodes of an earlier one of their kind, and of the first such one each.

    among: (N,) cells with other nodes are not looked at.
    """
    found: dict[tuple[str, int], list[tuple[Ints, Ints]]] = {}
    before = 0
    for block in mesh.cells:
        if block.dimension == 3:
            rows = np.flatnonzero(among[block.nodes[:, 0]])
            for corner in block.nodes.T[1:]:  # few are left of most meshes
                rows = rows[among[corner[rows]]]
            found.setdefault((block.kind, block.nodes.shape[1]), []).append((before + rows, block.nodes[rows]))
        before += len(block.nodes)
    numbers = np.random.default_rng(0).integers(1 << 62, size=len(mesh.points))  # their sums tell cells apart
    later, earlier = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for parts in found.values():
        number, nodes = (np.concatenate(each) for each in zip(*parts, strict=True))
        _, first, which = np.unique(numbers[nodes].sum(axis=1), return_index=True, return_inverse=True)
        again = np.flatnonzero(first[which] != np.arange(len(which)))
        of = first[which[again]]
        same = (np.sort(nodes[again], axis=1) == np.sort(nodes[of], axis=1)).all(axis=1)
        later.append(number[again[same]])
        earlier.append(number[of[same]])
    return np.concatenate(later), np.concatenate(earlier)


def doubled_note(given: Mesh, topology: Volume) -> list[str]:
    """Says so where volumes have all nodes of another one: facets around them have more than two cells.

    Their nodes are held for that, or as those of the boundary and of interfaces.
    """
    still = np.ones(len(given.points), dtype=bool)
    still[topology.free] = False
    later, earlier = doubled(given, still)
    if not len(later):
        return []
    k = int(np.argmin(later))
    cells = "1 cell has" if len(later) == 1 else f"{len(later):,} cells have"
    return [
        f"doubled: {cells} all nodes of another one, and what is around is held; the first is cell {later[k]}, "
        f"with the nodes of cell {earlier[k]} (numbers from 0)"
    ]
