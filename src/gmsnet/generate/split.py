"""New nodes in the middle of edges: each has four triangles around it, too few for angles near 60°."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.random import generator
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Ints = NDArray[np.int64]


def split_edges(mesh: Mesh, count: int, *, seed: int = 0) -> Mesh:
    """The mesh with ``count`` random edges split in their middles, and the two triangles at each of them cut in two.

    No split triangle has a node on a line cell or a neighbour that is split, too. The triangles must be the mesh's
    first cells; what belongs to cells and points as data is left out.

    Raises InputError if there are not so many such edges.
    """
    rng = generator(seed)
    block = mesh.cells[0]
    if block.kind != "triangle":
        raise InputError(f"only the edges of triangles can be split, got {block.kind!r} cells")
    triangles = block.nodes
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort(edges.T)
    twice = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    pairs = np.column_stack([owner[order[twice]], owner[order[twice + 1]]])
    shared = edges[order[twice]]

    taken = np.zeros(len(mesh.points), dtype=bool)
    for lines in mesh.cells:
        if lines.dimension == 1:
            taken[lines.nodes] = True
    chosen: list[int] = []
    for k in rng.permutation(len(pairs)).tolist():
        if len(chosen) == count:
            break
        if not taken[triangles[pairs[k]]].any():
            taken[triangles[pairs[k]]] = True
            chosen.append(k)
    if len(chosen) < count:
        raise InputError(f"only {len(chosen)} edges of this mesh can be split, not {count}")

    middle = len(mesh.points) + np.arange(count)
    ends, halves = np.repeat(shared[chosen], 2, axis=0), pairs[chosen].ravel()
    new = np.repeat(middle, 2)[:, None]
    first = np.where(triangles[halves] == ends[:, :1], new, triangles[halves])
    second = np.where(triangles[halves] == ends[:, 1:], new, triangles[halves])
    kept = triangles.copy()
    kept[halves] = first
    cells = (CellBlock("triangle", np.concatenate([kept, second]), np.append(block.regions, block.regions[halves])),)
    points = np.concatenate([mesh.points, mesh.points[shared[chosen]].mean(axis=1)])
    return Mesh(points, cells + mesh.cells[1:], mesh.region_names)
