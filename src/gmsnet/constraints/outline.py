"""The edges of a planar mesh that curves are made of: boundary, interface and line edges, and what tells them apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import chains, winding
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.polygons import Faces, Ints, Offsets, offset_type

Flags = NDArray[np.bool_]
Longs = NDArray[np.int64]

INSIDE, BOUNDARY, INTERFACE, NON_MANIFOLD = range(4)  # what an edge is; INSIDE: between faces of one region, or of none


@dataclass(frozen=True, eq=False)
class Outline:
    """The edges that curves are made of.

    edges: (E, 2) node ids, the smaller first, in ascending order. label: (E,), equal for two edges of the same kind
    (boundary, interface, …), between the same regions, with the same marks. names: label → the names of the marks.
    still: (N,) bool, nodes at which curves end wherever they lie: of vertex cells, of cells and line cells of second
    order, of edges of more than two faces, of line cells that are no edge of a face, and nodes whose faces do not make
    one fan, open or closed.
    """

    edges: Longs
    label: Longs
    names: tuple[tuple[str, ...], ...]
    still: Flags


def outline_of(mesh: Mesh, bounded_at: Flags | None = None) -> Outline:
    """The outline of a mesh; linear in its faces. bounded_at: see ``sides``."""
    faces, nodes = Faces.of(mesh), len(mesh.points)
    twin, head = twins(faces, nodes), heads(faces)
    halves, kinds, regions = sides(faces, twin, bounded_at)
    side_keys = edge_keys(faces.corner[halves], head[halves], nodes)
    lines, marks, still = line_cells(mesh)
    line_keys = edge_keys(lines[:, 0], lines[:, 1], nodes)
    on_lines = _half_edges_on(sorted_unique(line_keys), faces, head, nodes)
    still |= _still(mesh, faces, twin, np.union1d(halves, on_lines))
    still[lines[~np.isin(line_keys, edge_keys(faces.corner[on_lines], head[on_lines], nodes))]] = True

    keys, first = np.unique(np.concatenate([side_keys, line_keys]), return_index=True)
    about = np.zeros((len(keys), 3), dtype=np.int64)  # kind, and the two regions
    of_side = first < len(side_keys)
    about[of_side] = np.column_stack([kinds, regions])[first[of_side]]
    rows, names = mark_sets(mesh, np.searchsorted(keys, line_keys), marks, len(keys))
    table, label = np.unique(np.column_stack([about, rows]), axis=0, return_inverse=True)
    return Outline(
        edges=np.column_stack([keys // max(nodes, 1), keys % max(nodes, 1)]),
        label=label.reshape(-1),
        names=tuple(names[row] for row in table[:, 3].tolist()),
        still=still,
    )


def edge_keys(one: NDArray[np.integer], other: NDArray[np.integer], nodes: int) -> Longs:
    """One number per edge, whichever way it is read."""
    keys: Longs = np.minimum(one, other).astype(np.int64) * nodes + np.maximum(one, other)
    return keys


def twins(faces: Faces, nodes: int) -> Offsets:
    """The twin of each half-edge (kernels.topology.winding)."""
    kind = offset_type(len(faces.corner))
    twin, by_low = np.empty(len(faces.corner), dtype=kind), np.empty(len(faces.corner), dtype=kind)
    start = np.zeros(nodes + 2, dtype=kind)
    winding.match(faces.first, faces.corner, len(faces), start, by_low, np.empty_like(faces.corner), twin)
    return twin


def heads(faces: Faces) -> Ints:
    """(H,) the node that each half-edge goes to."""
    head = np.roll(faces.corner, -1)
    if len(head):
        first = np.arange(0, len(head), 3) if faces.first is None else faces.first[:-1]
        head[np.append(first[1:], len(head)) - 1] = faces.corner[first]
    return head


def sides(faces: Faces, twin: Offsets, bounded_at: Flags | None = None) -> tuple[Longs, Longs, Longs]:
    """Half-edges of boundary, interface and non-manifold edges, the kind of each, and its two regions (S, 2).

    bounded_at: (N,) bool, nodes with all their faces, where others are cut off: no side has another one.
    """
    if len(faces.region):
        face = np.arange(len(twin)) // 3 if faces.face is None else faces.face
        region = faces.region[face]
        differs = (twin >= 0) & (region != region[np.maximum(twin, 0)])
    else:
        region, differs = np.zeros(len(twin), dtype=np.int64), np.zeros(len(twin), dtype=bool)
    halves = np.flatnonzero(differs | (twin < 0))
    if bounded_at is not None:
        halves = halves[bounded_at[faces.corner[halves]] & bounded_at[heads(faces)[halves]]]
    other = twin[halves]
    kinds = np.select([other == winding.ALONE, other >= 0], [BOUNDARY, INTERFACE], NON_MANIFOLD)
    one, two = region[halves], region[np.where(other >= 0, other, halves)]
    regions = np.column_stack([np.minimum(one, two), np.maximum(one, two)])
    regions[kinds == NON_MANIFOLD] = 0  # no curve goes through their ends
    return halves, kinds, regions


def line_cells(mesh: Mesh) -> tuple[Longs, Longs, Flags]:
    """The ends of line cells (L, 2), their marks (L,), and the nodes that line and vertex cells keep still (N,)."""
    still = np.zeros(len(mesh.points), dtype=bool)
    ends, marks = [np.zeros((0, 2), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for block in mesh.cells:
        if block.dimension == 0 or (block.dimension == 1 and block.nodes.shape[1] != 2):
            still[block.nodes] = True
        if block.dimension == 1:
            ends.append(block.nodes[:, :2])
            marks.append(block.regions)
    lines, numbers = np.concatenate(ends), np.concatenate(marks)
    proper = lines[:, 0] != lines[:, 1]
    still[lines[~proper]] = True
    return lines[proper], numbers[proper], still


def _half_edges_on(keys: Longs, faces: Faces, head: Ints, nodes: int) -> Longs:
    """The half-edges on the edges with these keys (ascending)."""
    if not len(keys):
        return np.zeros(0, dtype=np.int64)
    ends = np.zeros(nodes, dtype=bool)
    ends[keys // nodes] = True  # few: only where the smaller end is one of them is the key asked for
    near = np.flatnonzero(ends[np.minimum(faces.corner, head)])
    return near[np.isin(edge_keys(faces.corner[near], head[near], nodes), keys)]


def _still(mesh: Mesh, faces: Faces, twin: Offsets, halves: Longs) -> Flags:
    """The nodes that faces keep still, among the ends of these half-edges."""
    still = np.zeros(len(mesh.points), dtype=bool)
    at = np.bincount(faces.corner, minlength=len(still)).astype(np.int32)
    sizes = np.full(len(still), -1, dtype=np.int32)
    chains.fan_sizes(faces.first, faces.corner, faces.face, twin, halves, at, sizes)
    still[(sizes >= 0) & (sizes != at)] = True
    chains.repeated_corners(faces.first, faces.corner, len(faces), still)
    crowded = np.flatnonzero(twin == winding.NON_MANIFOLD)
    still[faces.corner[crowded]] = still[heads(faces)[crowded]] = True
    for block in mesh.cells:
        if block.dimension in (None, 3) or (block.dimension == 2 and block.nodes.shape[1] > block.corners):
            still[block.nodes] = True
    return still


def mark_sets(
    mesh: Mesh, owner: Longs, marks: Longs, owners: int, dimension: int = 1
) -> tuple[Longs, list[tuple[str, ...]]]:
    """The set of marks of each edge, or facet, as a number (E,), 0 where it has none; and the names behind each number.

    owner: (L,) to which of so many owners a cell of this dimension belongs that has one of the marks (L,).
    """
    rows = np.zeros(owners, dtype=np.int64)
    names: list[tuple[str, ...]] = [()]
    if not len(owner):
        return rows, names
    pairs = np.unique(np.column_stack([owner, marks]), axis=0)
    marked, first, count = np.unique(pairs[:, 0], return_index=True, return_counts=True)
    for size in np.unique(count).tolist():
        here = count == size
        table, which = np.unique(pairs[first[here][:, None] + np.arange(size), 1], axis=0, return_inverse=True)
        rows[marked[here]] = len(names) + which.reshape(-1)
        names += [tuple(mesh.region_names.get((dimension, mark), str(mark)) for mark in row) for row in table.tolist()]
    return rows, names
