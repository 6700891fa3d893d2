"""Hexahedra, wedges, pyramids and tetrahedra of a mesh in memory order, read so that all of a part are alike."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.jacobian import form_of
from gmsnet.cells.table import CELLS
from gmsnet.kernels.simplex.mean_ratio3 import WEIGHTS3, Solids, Tetrahedra
from gmsnet.kernels.topology import connectivity
from gmsnet.kernels.topology import solids as kernels
from gmsnet.kernels.topology.facets import ALONE, NON_MANIFOLD, OPPOSITE
from gmsnet.kernels.topology.solids import FACETS, NONE, Tables
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import SOLIDS, Mesh
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.topology.fans import Marks
from gmsnet.topology.ordering import memory_order, space_points
from gmsnet.topology.polygons import Ints
from gmsnet.topology.solid_winding import wound
from gmsnet.topology.wound import OF_OTHER_CELLS, mark_of, refuse_flat

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

KINDS = ("tetra", *SOLIDS)  # by the numbers of kernels.simplex.mean_ratio3
# The corners of a cell that is read inside out, in an order in which it is not.
MIRRORED = np.array([
    (0, 2, 1, 3, 4, 5, 6, 7), (4, 5, 6, 7, 0, 1, 2, 3), (3, 4, 5, 0, 1, 2, 6, 7), (0, 3, 2, 1, 4, 5, 6, 7),
])  # fmt: skip
CORNERS = np.array([CELLS[name].corners for name in KINDS])
SIMPLICES = np.array([len(CELLS[name].simplices) for name in KINDS])
BITS = connectivity.BOUNDARY, connectivity.INTERFACE, connectivity.NON_MANIFOLD, connectivity.MISMATCHED
ELSEWHERE = NON_MANIFOLD  # as twin of a facet: it has none here, and is none of the boundary
BYTES_PER_CELL = 2_000  # that the set-up takes at most, of a hexahedron


@cache
def tables() -> Tables:
    """What kernels know of the kinds."""
    kinds = [CELLS[name] for name in KINDS]
    facets, simplices, around, at_corner = (
        np.full(shape, NONE, dtype=np.int32) for shape in ((4, FACETS, 4), (4, 8, 4), (3, 4, 8, 4), (4, 8, 8))
    )
    facets_at = np.zeros((4, 8), dtype=np.int32)
    for number, kind in enumerate(kinds):
        for k, facet in enumerate(kind.facets):
            facets[number, k, : len(facet)] = facet
            facets_at[number, list(facet)] += 1
        for k, simplex in enumerate(kind.simplices):
            simplices[number, k] = simplex
        for corner in range(kind.corners or 0):
            vertices = [4 * s + simplex.index(corner) for s, simplex in enumerate(kind.simplices) if corner in simplex]
            at_corner[number, corner, : len(vertices)] = vertices
            joined = [j if i == corner else i for i, j in kind.edges if corner in (i, j)]
            together = {node for simplex in kind.simplices if corner in simplex for node in simplex}
            others = sorted(together - {corner, *joined})
            rest = sorted(set(range(kind.corners or 0)) - together)
            for turn, found in enumerate((joined, others, rest)):
                around[turn, number, corner, : len(found)] = found
    inexact = np.array([not kind.exact for kind in kinds])
    return Tables(facets, around, simplices, at_corner, inexact, facets_at)


@cache
def roles() -> tuple[Ints, Floats]:
    """(K, 4) the role of each vertex of a corner simplex, by the kind; and (R, 6) the weights of each role.

    The weights are those seen from the vertex, its spokes in the order of ``OPPOSITE``.
    """
    found: dict[tuple[float, ...], int] = {}
    number = np.empty((4, 4), dtype=np.int32)
    for kind in range(4):
        of = np.zeros((4, 4))
        for weight, (i, j) in zip(WEIGHTS3[kind], ((0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (3, 1)), strict=True):
            of[i, j] = of[j, i] = weight
        for vertex in range(4):
            a, b, c = OPPOSITE[vertex]
            seen = (of[vertex, a], of[vertex, b], of[vertex, c], of[a, b], of[b, c], of[c, a])
            number[kind, vertex] = found.setdefault(tuple(float(each) for each in seen), len(found))
    return number, np.array(list(found))


@dataclass(frozen=True, eq=False)
class WoundSolids:
    """Cells that are read alike.

    cell: (T,) the index of each among all cells of the mesh, and cells: (T, 8) their nodes, behind the corners the
    first one again, in file order. By places in memory: solids; corners (T,) how many; orientation (T,) int8, −1 for
    what the file has inside out; region (T,), or none (0,) where all are the same; origin: the place in file order
    of each.
    twin: (6T,) the facet across each. marks, memory, position: as of Wound.
    """

    cell: NDArray[np.int64]
    cells: Ints
    solids: Solids
    corners: Ints
    orientation: NDArray[np.int8]
    region: NDArray[np.int64]
    origin: Ints
    twin: Ints
    marks: Marks
    memory: Ints
    position: Ints

    @classmethod
    def of(cls, mesh: Mesh, fixed: Flags | None = None) -> WoundSolids:
        """Of a mesh; ``fixed`` and errors: see ``Volume.of``."""
        refuse_flat(mesh)
        cells, kind, cell, region, marks_by_id = _cells(mesh, fixed)
        nodes = len(mesh.points)
        refuse_unless_free(len(cells) * BYTES_PER_CELL, f"the connectivity of {len(cells):,} cells")
        points = space_points(mesh)
        memory, position = memory_order(points, mesh.box)
        place = position[cells]
        origin = np.argsort(place.min(axis=1), kind="stable").astype(np.int32) if len(place) else np.empty(0, np.int32)
        near, kind = place[origin], kind[origin]
        region = region[origin] if len(region) else region
        marks = marks_by_id[memory]
        used = np.zeros(nodes, dtype=bool)
        used[near] = True
        twin = np.empty(FACETS * len(near), dtype=np.int32)
        kernels.match_solids(near, kind, tables(), nodes, twin)
        orientation = wound(points[memory], near, kind, tables(), twin, marks)
        corners, inside_out = CORNERS[kind].astype(np.int32), orientation < 0
        if inside_out.any():
            near[inside_out] = np.take_along_axis(near[inside_out], MIRRORED[kind[inside_out]], axis=1)
            near = np.where(np.arange(8) < corners[:, None], near, near[:, :1])
            kernels.match_solids(near, kind, tables(), nodes, twin)
        kernels.mark_solids(near, kind, tables(), twin, region, _halved(near, kind, twin), *BITS, marks)
        marks[~used & (marks & OF_OTHER_CELLS == 0)] |= np.uint16(connectivity.UNUSED)
        solids = Solids(near, kind, form_of("hexahedron"), form_of("wedge"))
        return cls(cell, cells, solids, corners, orientation, region, origin, twin, marks, memory, position)

    def bounded_at(self, nodes: Flags) -> WoundSolids:
        """The same as a part of more cells, which has all of those at the nodes (N,) by id of their boundary."""
        near = nodes[self.memory]
        number = np.flatnonzero(self.twin == ALONE)
        corners = tables().facets[self.solids.kind[number // FACETS], number % FACETS]
        inside = ~(near[self.solids.nodes[(number // FACETS)[:, None], corners]] & (corners != NONE)).any(axis=1)
        twin = self.twin.copy()
        twin[number[inside]] = ELSEWHERE
        within = np.where(near, np.uint16(0), np.uint16(connectivity.BOUNDARY))
        return replace(self, twin=twin, marks=self.marks & ~within)

    @cached_property
    def boundary_cell(self) -> NDArray[np.int64]:
        """(F,) the cell of each triangle of ``boundary``."""
        return self._outside[0]

    @cached_property
    def boundary(self) -> Ints:
        """(F, 3) the facets of one cell alone, counter-clockwise as seen from outside.

        Those of four nodes are ``halved``: their first halves, then the second ones, stand behind all others.
        """
        return self._outside[1]

    @property
    def boundary_halves(self) -> int:
        """How many of these are halves."""
        return self._outside[2]

    @cached_property
    def _outside(self) -> tuple[NDArray[np.int64], Ints, int]:
        number = np.flatnonzero(self.twin == ALONE)
        corners = tables().facets[self.solids.kind[number // FACETS], number % FACETS]
        real, four = corners[:, 0] != NONE, corners[:, 3] != NONE
        nodes = self.solids.nodes[(number // FACETS)[:, None], np.maximum(corners, 0)]
        three = real & ~four
        halves = self.position[halved(self.memory[nodes[four]])]
        cell = np.concatenate([number[three], number[four], number[four]]) // FACETS
        return cell, np.concatenate([nodes[three, :3], halves[0::2], halves[1::2]]).astype(np.int32), len(halves)

    @cached_property
    def boundary_facets(self) -> NDArray[np.int64]:
        """(N,) how many facets of the boundary are at each node."""
        number = np.flatnonzero(self.twin == ALONE)
        corners = tables().facets[self.solids.kind[number // FACETS], number % FACETS]
        found: NDArray[np.int64] = np.bincount(
            self.solids.nodes[(number // FACETS)[:, None], corners][corners != NONE], minlength=len(self.marks)
        )
        return found

    @cached_property
    def simplices(self) -> Tetrahedra:
        """The corner simplices, cell by cell."""
        kind = self.solids.kind
        count = int(SIMPLICES[kind].sum())
        rows, owner = np.empty((count, 4), dtype=np.int32), np.empty(count, dtype=np.int32)
        kernels.list_simplices(self.solids.nodes, kind, tables(), rows, owner)
        return Tetrahedra(rows, np.ones(len(rows), dtype=np.int8), kind[owner], owner, self.solids)


def halved(quads: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
    """(2F, 3) the triangles on both sides of the diagonal from the lowest node of each quadrilateral (F, 4)."""
    turn = (np.argmin(quads, axis=1)[:, None] + np.arange(4)) % 4
    a, b, c, d = np.take_along_axis(quads, turn, axis=1).astype(np.int64).T
    return np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1).reshape(-1, 3)


def _cells(
    mesh: Mesh, fixed: Flags | None
) -> tuple[Ints, NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64], Marks]:
    """The cells (T, 8) by ids, their kinds, indices and regions, none (0,) where all are the same; marks (N,) by ids.

    Cells that name a node twice are none of them: their nodes are held, as those of kinds that are not smoothed.
    """
    marks = np.zeros(len(mesh.points), dtype=np.uint16)
    parts, before = list[tuple[Ints, NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]](), 0
    for block in mesh.cells:
        if block.kind in KINDS:
            whole = ~repeats_a_node(block)
            marks[block.nodes[~whole]] |= np.uint16(connectivity.UNSUPPORTED_CELL)
            nodes = block.nodes[whole].astype(np.int32)
            wide = np.concatenate([nodes, np.repeat(nodes[:, :1], 8 - nodes.shape[1], axis=1)], axis=1)
            number = np.full(len(nodes), KINDS.index(block.kind), dtype=np.uint8)
            parts.append((wide, number, before + np.flatnonzero(whole), block.regions[whole]))
        else:
            marks[block.nodes] |= np.uint16(mark_of(block))
        before += len(block.nodes)
    if fixed is not None:
        marks[fixed] |= np.uint16(connectivity.CHOSEN)
    cells, kind, cell, region = (np.concatenate(each) for each in zip(*parts, strict=True))
    same = not len(region) or bool((region == region[0]).all())
    return cells, kind, cell, np.empty(0, dtype=np.int64) if same else region, marks


def repeats_a_node(block: CellBlock) -> Flags:
    """(C,) which cells name a node twice."""
    ordered = np.sort(block.nodes, axis=1)
    found: Flags = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    return found


def _halved(near: Ints, kind: NDArray[np.uint8], twin: Ints) -> Flags:
    """(6T,) the facets that lie against others of other nodes: a quadrilateral and the two triangles that halve it."""
    found = np.zeros(len(twin), dtype=bool)
    number = np.flatnonzero(twin == ALONE)
    corners = tables().facets[kind[number // FACETS], number % FACETS]
    real = corners[:, 0] != NONE
    number, corners = number[real], corners[real]
    nodes = near[(number // FACETS)[:, None], np.maximum(corners, 0)]
    four = corners[:, 3] != NONE
    if not four.any() or four.all():
        return found
    quads, triangles = np.flatnonzero(four), np.flatnonzero(~four)
    halves = np.concatenate([nodes[quads][:, list(half)] for half in ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))])
    keys = np.sort(np.concatenate([halves, nodes[triangles, :3]]), axis=1)
    _, which = np.unique(keys, axis=0, return_inverse=True)
    which = which.reshape(-1)
    half, other = which[: len(halves)].reshape(4, -1), which[len(halves) :]
    there = np.isin(half, other)
    split = (there[0] & there[1]) | (there[2] & there[3])
    found[number[quads[split]]] = True
    found[number[triangles[np.isin(other, half[:, split])]]] = True
    return found
