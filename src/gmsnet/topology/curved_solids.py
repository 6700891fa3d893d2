"""Second-order volume cells of a mesh: which nodes follow which corners, and which lie on facets of one cell alone."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.jacobian import form_of
from gmsnet.cells.table import CELLS
from gmsnet.kernels.curved.stars3 import NO_FOLLOWER, WIDEST3, CurvedSolids, remember_followers
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.solids import KINDS, MIRRORED

CURVED = ("tetra10", "hexahedron20", "hexahedron27", "wedge15", "wedge18")  # whose nodes move
STRAIGHT = {name: next(kind for kind in KINDS if CELLS[kind].corners == CELLS[name].corners) for name in CURVED}
CORNERS3 = tuple(CELLS[name].corners or 0 for name in CURVED)
NONE = -1

Ints = NDArray[np.int32]
Flags = NDArray[np.bool_]


def has_curved(mesh: Mesh) -> bool:
    """Has the mesh second-order volumes whose nodes move?"""
    return any(block.kind in CURVED and len(block.nodes) for block in mesh.cells)


def straight(mesh: Mesh) -> Mesh:
    """The mesh with straight cells instead of these, numbered alike."""
    cells = (
        CellBlock(STRAIGHT[block.kind], block.nodes[:, : block.corners], block.regions)
        if block.kind in STRAIGHT
        else block
        for block in mesh.cells
    )
    return Mesh(mesh.points, tuple(cells), single=mesh.single)


@cache
def frames(name: str) -> tuple[tuple[int, tuple[int, ...]], ...]:
    """Of each node that is no corner: its place in the cell, and the corners around it, in order."""
    kind = CELLS[name]
    found = [(edge[2], edge[:2]) for edge in kind.edges]
    found += [(facet[-1], facet[:4]) for facet in kind.facets if len(facet) == 9]
    if kind.nodes == WIDEST3:
        found.append((26, tuple(range(8))))
    return tuple(found)


@cache
def mirrored(name: str) -> tuple[int, ...]:
    """The nodes of a cell that is inside out, in an order in which it is not."""
    kind = CELLS[name]
    corner = MIRRORED[KINDS.index(STRAIGHT[name])][: kind.corners].tolist()
    at = {frozenset(around): node for node, around in frames(name)}
    order = [*corner, *[0] * ((kind.nodes or 0) - len(corner))]
    for node, around in frames(name):
        order[node] = at[frozenset(corner[k] for k in around)]
    return tuple(order)


def table_of(mesh: Mesh) -> tuple[Ints, NDArray[np.int8], NDArray[np.int64], Flags]:
    """(C, 27) the nodes of these cells, −1 past the last; their kinds, numbers of CURVED; their indices among all.

    And (N,) the nodes of cells of the first order and of others, faces and lines among them.
    """
    parts, others, before = [], np.zeros(len(mesh.points), dtype=bool), 0
    for block in mesh.cells:
        if block.kind in CURVED:
            rows = np.full((len(block.nodes), WIDEST3), NONE, dtype=np.int32)
            rows[:, : block.nodes.shape[1]] = block.nodes
            kind = np.full(len(rows), CURVED.index(block.kind), dtype=np.int8)
            parts.append((rows, kind, before + np.arange(len(rows))))
        else:
            others[block.nodes] = True
        before += len(block.nodes)
    cells, kinds, number = (np.concatenate(each) for each in zip(*parts, strict=True))
    return cells, kinds, number, others


def _there(kinds: NDArray[np.int8]) -> list[tuple[str, NDArray[np.int64]]]:
    """The kinds that there are, and which cells."""
    found = ((name, np.flatnonzero(kinds == kind)) for kind, name in enumerate(CURVED))
    return [(name, rows) for name, rows in found if len(rows)]


def of_positive_sense(cells: Ints, kinds: NDArray[np.int8], inside_out: Flags) -> Ints:
    """The table with the cells that are inside out read in the other order."""
    made = cells.copy()
    for kind, name in enumerate(CURVED):
        rows = np.flatnonzero(inside_out & (kinds == kind))
        order = list(mirrored(name))
        made[rows[:, None], np.arange(len(order))] = cells[rows][:, order]
    return made


def on_rim(cells: Ints, kinds: NDArray[np.int8], regions: NDArray[np.int64], count: int) -> Flags:
    """(count,) the nodes of facets that are not between two cells of one region, which agree on all its nodes."""
    there, facets, regions_of = _there(kinds), [], []
    width = max(len(facet) for name, _ in there for facet in CELLS[name].facets)
    for name, rows in there:
        for facet in CELLS[name].facets:
            wide = np.full((len(rows), width), count, dtype=np.int32)
            wide[:, : len(facet)] = cells[rows[:, None], facet]
            facets.append(np.sort(wide, axis=1))
            regions_of.append(regions[rows])
    nodes, region = np.concatenate(facets), np.concatenate(regions_of)
    key = nodes[:, 0] * np.int64(count + 1) + nodes[:, 1]  # two nodes tell most facets apart, the third the rest
    order = np.lexsort((nodes[:, 3], nodes[:, 2], key))
    nodes, region = nodes[order], region[order]
    same = (nodes[1:] == nodes[:-1]).all(axis=1)
    after, before = np.append(same, False), np.append(False, same)
    alike = np.append(region[1:] == region[:-1], True)
    first = after & ~before & ~np.append(after[1:], False) & alike
    inner = first | np.append(False, first[:-1])
    found = np.zeros(count + 1, dtype=bool)
    found[nodes[~inner]] = True
    return found[:-1]


def at_odds(cells: Ints, kinds: NDArray[np.int8], count: int) -> Flags:
    """(count,) the nodes of cells that name one twice, and those that are not everywhere between the same corners."""
    there = _there(kinds)
    width = max(len(around) for name, _ in there for _, around in frames(name))
    found, first = np.zeros(count, dtype=bool), np.full((count, width), NONE, dtype=np.int32)
    known = np.zeros(count, dtype=bool)
    for name, chosen in there:
        rows = cells[chosen, : CELLS[name].nodes]
        ordered = np.sort(rows, axis=1)
        found[rows[(ordered[:, 1:] == ordered[:, :-1]).any(axis=1)]] = True
        corners = CELLS[name].corners or 0
        places = [*((k, (k,)) for k in range(corners)), *frames(name)]
        for node, around in places:
            wide = np.full((len(rows), width), NONE, dtype=np.int32)
            wide[:, : len(around)] = np.sort(rows[:, around], axis=1)
            nodes = rows[:, node]
            new = ~known[nodes]
            first[nodes[new]] = wide[new]
            known[nodes] = True
            found[nodes[(first[nodes] != wide).any(axis=1)]] = True
    return found


@cache
def _simplices() -> Ints:
    """(K, 8, 4) the corner simplices of the kinds."""
    table = np.full((len(CURVED), 8, 4), NONE, dtype=np.int32)
    for kind, name in enumerate(CURVED):
        for k, simplex in enumerate(CELLS[name].simplices):
            table[kind, k] = simplex
    return table


def curved_solids(points: NDArray[np.float64], cells: Ints, kinds: NDArray[np.int8], held: Flags) -> CurvedSolids:
    """The cells with the offsets that ``points`` (N, 3 or more) have. cells: of positive sense, see ``table_of``.

    held: (N,) nodes that stay whatever moves.
    """
    count = len(points)
    used = cells >= 0
    cell_start, cell_of = _by_node(cells[used], np.nonzero(used)[0], count)
    nodes, frame = [np.empty(0, dtype=np.int32)], [np.empty((0, 8), dtype=np.int32)]
    for kind, name in enumerate(CURVED):
        rows = cells[kinds == kind]
        for node, around in frames(name) if len(rows) else ():
            wide = np.full((len(rows), 8), NONE, dtype=np.int32)
            wide[:, : len(around)] = rows[:, list(around)]
            nodes.append(rows[:, node])
            frame.append(wide)
    every, around_all = np.concatenate(nodes), np.concatenate(frame)
    number = np.full(count, NO_FOLLOWER, dtype=np.int32)
    number[every[::-1]] = np.arange(len(every) - 1, -1, -1, dtype=np.int32)  # the first place of each
    chosen = number[every] == np.arange(len(every))
    follower, around_of = every[chosen], np.ascontiguousarray(around_all[chosen])
    number[follower] = np.arange(len(follower), dtype=np.int32)
    corner = around_of >= 0
    start, follower_of = _by_node(around_of[corner], np.nonzero(corner)[0], count)
    made = CurvedSolids(
        np.ascontiguousarray(cells, dtype=np.int32), np.ascontiguousarray(kinds, dtype=np.int8),
        tuple(form_of(name) for name in CURVED), np.array(CORNERS3), _simplices(),
        np.array([KINDS.index(STRAIGHT[name]) for name in CURVED]), cell_start, cell_of, start, follower_of,
        np.ascontiguousarray(follower), around_of, ~held[follower], number, np.zeros((len(follower), 6)),
    )  # fmt: skip
    return remembered(points, made)


def remembered(points: NDArray[np.float64], linked: CurvedSolids) -> CurvedSolids:
    """The same cells with the offsets that ``points`` have."""
    made = linked._replace(kept=np.zeros_like(linked.kept))
    remember_followers(points, made, np.arange(len(made.follower)))
    return made


def _by_node(nodes: Ints, items: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], Ints]:
    """CSR: for each node the items that stand beside it, in ascending order."""
    from scipy.sparse import csr_array  # it takes a tenth of a second to import

    rows = csr_array((np.ones(len(nodes), dtype=bool), nodes, np.arange(len(nodes) + 1)), shape=(len(nodes), count))
    columns = rows.tocsc()
    return columns.indptr.astype(np.int64), items[columns.indices].astype(np.int32)
