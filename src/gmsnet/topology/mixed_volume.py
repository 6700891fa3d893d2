"""The connectivity of a mesh of hexahedra, wedges, pyramids and tetrahedra, seen from its nodes.

What is free and what is around a node is told as for tetrahedra (topology.volume). The cells around a node are one
closed ball where, of E edges, F facets and C cells there, E − F + C = 2, as on a sphere; at the boundary, where nodes
may slide, it is 1, as on a disk.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.guard3 import moved_elsewhere
from gmsnet.kernels.star.space_blocks import LANES3, Mixture, SpaceBlocks
from gmsnet.kernels.topology import connectivity
from gmsnet.kernels.topology import solid_stars as kernels
from gmsnet.kernels.topology.connectivity import WIDTH
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.held import AT_BOUNDARY, reasons_in_space, released, sorted_out
from gmsnet.topology.polygons import Ints
from gmsnet.topology.solids import KINDS, WoundSolids, roles, tables
from gmsnet.topology.stars import Colouring, Stars, in_blocks
from gmsnet.topology.volume import MOST, Flags, Volume
from gmsnet.topology.wound import Wound

# Stars stand beside those with as many cells of each kind: a digit of (4, 8), by kind and corner. An apex has its own.
PLACES = np.repeat(4096.0 ** np.arange(4)[:, None], 8, axis=1)
PLACES[KINDS.index("pyramid"), 4] = 4096.0**4


@dataclass(frozen=True, eq=False)
class MixedVolume(Volume):
    """A Volume of which ``cells`` is (T, 8), behind the corners of a cell the first one again.

    ``near`` are the corner simplices of the cells, all of them positive in a valid mesh, in ``all_simplices`` with what
    else belongs to them. core, edges: (N,) how many of the nodes around a node are in its simplices, and how many are
    joined to it by an edge: the first of its ring. role, owner: (M,) of the simplices at nodes (kernels.star.space).
    order: (N,) by which stars stand beside one another. inexact_cells: (I,) those that may be invalid though their
    corner simplices are positive; inexact_at, inexact: in CSR form those at each node. file_numbers: (T,) the kind of
    each cell in file order, a number in file_kinds. slack, gone: of the first, see kernels.star.space_blocks.Mixture;
    both are lent to one Field: lent has it.
    """

    all_simplices: Tetrahedra
    core: Ints
    edges: Ints
    role: NDArray[np.uint8]
    owner: Ints
    order: NDArray[np.int64]
    inexact_at: NDArray[np.int64]
    inexact: Ints
    inexact_cells: Ints
    file_numbers: NDArray[np.uint8]
    slack: NDArray[np.float64]
    gone: NDArray[np.float64]
    lent: list[object]
    file_kinds = KINDS

    @classmethod
    def mixed(cls, wound: WoundSolids, slides: Flags | None = None) -> MixedVolume:
        """Of cells that are wound. slides: see ``Volume.made``."""
        nodes, kind, count = wound.solids.nodes, wound.solids.kind, len(wound.marks)
        marks, position, texts = wound.marks.copy(), wound.position, reasons_in_space(MOST)
        rim, slid = np.zeros(count, dtype=np.int64), dict[str, NDArray[np.int64]]()
        if slides is not None:
            near, slid = released(marks, slides[wound.memory], position, AT_BOUNDARY, texts)
            rim[near] = wound.boundary_facets[near]
        start = np.zeros(count + 2, dtype=np.int64)
        cell, corner = np.empty((2, int(wound.corners.sum())), dtype=np.int32)
        found = int(kernels.list_solids(nodes, wound.corners, marks, start, cell, corner))
        cell, corner = cell[:found], corner[:found]
        ring_start, ring = np.empty(count + 1, dtype=np.int64), np.empty(7 * found + WIDTH, dtype=np.int32)
        edges, core = np.empty((2, count), dtype=np.int32)
        end = kernels.rings_of_solids(
            nodes, kind, tables(), start, cell, corner, ring_start, ring, edges, core, MOST
        )  # fmt: skip
        node = np.repeat(np.arange(count), np.diff(start[:-1]))
        number = np.diff(start[:-1])
        marks[(marks == 0) & (core == 0)] |= np.uint16(connectivity.HIGH_VALENCE)
        facets = np.bincount(node, tables().facets_at[kind[cell], corner], count).astype(np.int64)
        ball = 2 * (edges + number) == facets + np.where(rim > 0, rim + 2, 4)
        marks[(marks == 0) & ~ball] |= np.uint16(connectivity.NOT_A_DISK)
        held, free, places = sorted_out(marks, position, texts)
        own = np.empty(count + 1, dtype=np.int64)
        local = np.empty((8 * found, 3), dtype=np.uint8)
        role, owner = np.empty(8 * found, dtype=np.uint8), np.empty(8 * found, dtype=np.int32)
        numbers, _ = roles()
        total = kernels.stars_of_solids(
            nodes, kind, tables(), numbers, start, cell, corner, ring_start, ring, core, own, local, role, owner
        )  # fmt: skip
        order = np.bincount(node, PLACES[kind[cell], corner], count)
        chosen = tables().inexact[kind[cell]]
        inexact_cells = np.flatnonzero(tables().inexact[kind]).astype(np.int32)
        number = np.empty(len(kind), dtype=np.int32)
        number[inexact_cells] = np.arange(len(inexact_cells), dtype=np.int32)
        inexact = 8 * number[cell[chosen]] + corner[chosen]
        inexact_at = np.concatenate([[0], np.cumsum(np.bincount(node[chosen], minlength=count))])
        of_file = np.empty_like(wound.orientation)
        of_file[wound.origin] = wound.orientation
        kinds = np.empty_like(kind)
        kinds[wound.origin] = kind
        simplices = wound.simplices
        assert simplices.cells is not None
        ring = ring[: end + WIDTH]  # of what is left out no page was ever touched
        ring[end:] = 0
        return cls(
            wound.cell, wound.cells, of_file, simplices.rows, simplices.orientation, wound.origin[simplices.cells], own,
            local[:total], ring_start, ring[:end], Colouring(places, ring_start, ring), slid,
            simplices, core, edges, role[:total], owner[:total], order.astype(np.int64), inexact_at,
            inexact, inexact_cells, kinds, np.zeros(len(inexact_cells)), np.zeros(8 * len(inexact_cells)), [None],
            held=held, free=free, memory=wound.memory, near_free=marks == 0,
        )  # fmt: skip

    def lend_slack(self, field: object) -> None:
        """To a Field, whose points its guard alone moves from now on: what was known of others is forgotten."""
        if self.lent[0] is not field:
            self.slack[:] = self.gone[:] = 0.0
            self.lent[0] = field

    def forget_slack(self) -> None:
        """All nodes may be elsewhere."""
        self.lent[0] = None

    def moved_elsewhere(
        self, points: NDArray[np.float64], nodes: NDArray[np.integer[Any]], before: NDArray[np.float64]
    ) -> None:
        """Others than the guard have moved some nodes (k,), by places in memory, that were at ``before`` (k, 3)."""
        moved_elsewhere(points, nodes, before, self.inexact_at, self.inexact, self.slack, self.gone)

    def inside_out(self, chosen: Flags | None = None) -> NDArray[np.int64]:
        """How many cells of each of KINDS are read in the other order, of all or of those chosen (T,)."""
        turned = self.orientation < 0 if chosen is None else (self.orientation < 0) & chosen
        return np.bincount(self.file_numbers[turned], minlength=len(KINDS)).astype(np.int64)

    @property
    def simplices(self) -> Tetrahedra:
        """See Volume."""
        return self.all_simplices

    def rows_at(self, chosen: Flags) -> NDArray[np.int32]:
        """See Volume. Of a cell that has one, all corner simplices."""
        simplices = self.all_simplices
        assert simplices.solids is not None
        assert simplices.cells is not None
        cells: Flags = np.asarray(chosen[simplices.solids.nodes].any(axis=1))
        return np.flatnonzero(cells[simplices.cells]).astype(np.int32)

    @cached_property
    def changeable(self) -> Tetrahedra:
        """See Volume."""
        rows = self.rows_at(self.near_free)
        return self.simplices if len(rows) == len(self.near) else self.simplices.take(rows)

    def restricted(self, active: Flags) -> MixedVolume:
        """See Volume."""
        around = self.simplices.take(self.rows_at(active))
        inner = replace(
            self, near=around.rows, near_orientation=around.orientation, all_simplices=around,
            free=np.sort(self.memory[np.flatnonzero(active)]), near_free=active,
        )  # fmt: skip
        inner.__dict__["changeable"] = around
        return inner

    def _empty_stars(self, nodes: NDArray[np.int64]) -> tuple[Stars, Callable[[int, int], None]]:
        """See Volume."""
        order, first, of_colour = in_blocks(nodes, self.order[nodes], self.near_colours[nodes], self.colouring.fewest)
        count = len(first) - 1
        _, weights = roles()
        rows, around = np.empty((2, count), dtype=np.int32)
        kernels.count_rows(order, first, self.start, self.role, len(weights), self.core, rows, around)
        row_begin = np.concatenate([[0], np.cumsum(rows)]).astype(np.int64)
        ring_begin = np.concatenate([[0], np.cumsum(LANES3 * around)]).astype(np.int64)
        total = int(row_begin[-1])
        sigma = weights[:, :3].sum(axis=1, keepdims=True)
        solids = self.all_simplices.solids
        assert solids is not None
        mixture = Mixture(
            np.empty(total, dtype=np.uint8), np.hstack([weights, sigma, sigma / 3.0]).astype(np.float32), weights,
            np.empty(total, dtype=np.uint16), np.empty(total * LANES3, dtype=np.int32),
            np.empty(count * LANES3, dtype=np.int32), solids, self.inexact_at, self.inexact, self.slack, self.gone,
            self.inexact_cells,
        )  # fmt: skip
        made = SpaceBlocks(
            np.empty(count * LANES3, dtype=np.int32), np.empty(ring_begin[-1], dtype=np.int32), ring_begin[:-1],
            around, np.empty(3 * LANES3 * total, dtype=np.uint8), 3 * LANES3 * row_begin[:-1],
            rows, np.empty(count * LANES3, dtype=np.int32), np.empty(count, dtype=np.int32),
            int(around.max(initial=0)), int(rows.max(initial=0)), mixture,
        )  # fmt: skip

        def fill(begin: int, end: int) -> None:
            kernels.fill_mixed_blocks(
                order, self.ring_start, self.ring, self.core, self.edges, self.start, self.local, self.role, self.owner,
                len(weights), LANES3, first, begin, end, made,
            )  # fmt: skip

        return Stars(made, of_colour.astype(np.int32)), fill


def wound_of(mesh: Mesh, fixed: Flags | None = None, threads: int = 1) -> Wound | WoundSolids:
    """The cells of a mesh with volumes, read alike; ``fixed`` and errors: see ``Volume.of``. threads: one or two."""
    return WoundSolids.of(mesh, fixed) if mesh.has_solids else Wound.of(mesh, fixed, threads)


def volume_of(wound: Wound | WoundSolids, slides: Flags | None = None, threads: int = 1) -> Volume:
    """Their connectivity. slides, threads: see ``Volume.made``."""
    return Volume.made(wound, slides, threads) if isinstance(wound, Wound) else MixedVolume.mixed(wound, slides)
