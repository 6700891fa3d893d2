"""The cells that a page draws: those of one kind together, as triangles of their corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.mesh.mesh import Mesh

Ints = NDArray[np.int64]
Facet = tuple[int, ...]

MOST_FACETS = 8  # of a cell: facet k of cell c has the number 8c + k


@dataclass(frozen=True, eq=False)
class Group:
    """Cells of one kind. kind: its name. facets: corners of each, of faces the one facet that they are.

    edges: pairs of corners. nodes: (C, corners) ids. number: (C,) of each among all cells of the mesh, in file order.
    """

    kind: str
    facets: tuple[Facet, ...]
    edges: tuple[Facet, ...]
    nodes: Ints
    number: Ints

    def taken(self, chosen: NDArray[np.bool_]) -> Group:
        """Some of the cells."""
        return replace(self, nodes=self.nodes[chosen], number=self.number[chosen])


def groups_of(mesh: Mesh) -> tuple[list[Group], str]:
    """The cells of the highest dimension that a mesh has, and what cannot be drawn, in words."""
    dimension, first = 3 if mesh.has_volumes else 2, 0
    found: dict[tuple[str, int], list[tuple[Ints, Ints]]] = {}
    left_out: dict[str, int] = {}
    for block in mesh.cells:
        number = np.arange(first, first + len(block.nodes))
        first += len(block.nodes)
        if block.dimension not in (dimension, None) or not len(block.nodes):
            continue
        if block.dimension is None or (dimension == 3 and CELLS[block.kind].corners is None):
            left_out[block.kind] = left_out.get(block.kind, 0) + len(block.nodes)
            continue
        found.setdefault((block.kind, block.corners), []).append((block.nodes[:, : block.corners], number))
    groups = [
        Group(kind, *_table(kind, corners), *(np.concatenate(each) for each in zip(*parts, strict=True)))
        for (kind, corners), parts in found.items()
    ]
    words = ", ".join(f"{count:,} {kind}" for kind, count in left_out.items())
    return groups, words


def _table(kind: str, corners: int) -> tuple[tuple[Facet, ...], tuple[Facet, ...]]:
    """The facets and edges of cells of a kind, of their corners alone."""
    known = CELLS[kind]
    if known.dimension == 2:
        ring = tuple(range(corners))
        return (ring,), tuple((k, (k + 1) % corners) for k in ring)
    facets = tuple(tuple(node for node in facet if node < corners) for facet in known.facets)
    return facets, tuple((edge[0], edge[1]) for edge in known.edges)


def shell_of(groups: Sequence[Group], nodes: int) -> NDArray[np.uint32]:
    """(B,) the numbers of the facets of one cell alone; cells are counted group by group. nodes: of the mesh."""
    ends, codes = [], []
    first = 0
    for group in groups:
        cells = np.arange(first, first + len(group.nodes), dtype=np.uint32)
        first += len(group.nodes)
        for k, facet in enumerate(group.facets):
            # Three nodes tell a facet; of four the three least.
            ends.append(np.sort(group.nodes[:, facet], axis=1)[:, :3])
            codes.append(cells * np.uint32(MOST_FACETS) + np.uint32(k))
    every, code = np.concatenate(ends), np.concatenate(codes)
    order, new = _sorted(every, nodes)
    alone = new & np.append(new[1:], True)
    found: NDArray[np.uint32] = np.sort(code[order[alone]])
    return found


def _sorted(rows: Ints, nodes: int) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """An order in which equal rows (R, 3) stand together, and whether each, in that order, is not as the one before."""
    if nodes <= 1 << 21:  # three of them fit into 63 bits
        key = (rows[:, 0] * nodes + rows[:, 1]) * nodes + rows[:, 2]
        order: NDArray[Any] = np.argsort(key)
        same = key[order][1:] == key[order][:-1]
    else:
        order = np.lexsort((rows[:, 2], rows[:, 0] * nodes + rows[:, 1]))
        same = (rows[order][1:] == rows[order][:-1]).all(axis=1)
    return order, np.append(True, ~same)
