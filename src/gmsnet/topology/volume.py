"""The connectivity of a mesh of tetrahedra, seen from its nodes.

A node is free where its cells are one closed ball: each facet at it belongs to two cells, which see it from two sides,
and with F cells there are F/2 + 2 nodes around it, as on a sphere of F triangles. At the boundary, where
nodes may slide, they are half a ball: with B facets of the boundary, (F + B)/2 + 1 nodes. Nodes are numbered as in the
plane: by ids at the doors, and by places in memory inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.space_blocks import LANES3, SpaceBlocks
from gmsnet.kernels.topology import balls, connectivity
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.executor import Result
from gmsnet.parallel.threads import side_by_side
from gmsnet.topology.bins import Counts, in_bins
from gmsnet.topology.connectivity import Connectivity
from gmsnet.topology.fans import Marks
from gmsnet.topology.held import AT_BOUNDARY, reasons_in_space, released, sorted_out
from gmsnet.topology.polygons import Ints
from gmsnet.topology.stars import Colouring, Stars, in_blocks
from gmsnet.topology.wound import Wound

Flags = NDArray[np.bool_]

MOST = 255  # nodes around a free node: they are numbered by one byte


@dataclass(frozen=True, eq=False)
class Volume(Connectivity):
    """See the module.

    cell: (T,) the index of each tetrahedron among all cells of the mesh; cells: (T, 4) their nodes in file order, and
    orientation: (T,) int8, −1 where the volume is to be taken with the other sign, for all of a part to be alike and
    mostly positive. held, free, memory, near_free: see Connectivity. near (T, 4), near_orientation: by places in
    memory; near_origin: the place in file order of each row of near. The cells at node v that is free, or was before
    others were held, are start[v] … start[v + 1] − 1 of local (M, 3), which nodes of its ring their spokes end in:
    ring_start (N + 1,), ring. sliding: reason → the ids of the nodes that would be held for it if they did not slide.
    """

    cell: NDArray[np.int64]
    cells: Ints
    orientation: NDArray[np.int8]
    near: Ints
    near_orientation: NDArray[np.int8]
    near_origin: Ints
    start: NDArray[np.int64]
    local: NDArray[np.uint8]
    ring_start: NDArray[np.int64]
    ring: Ints
    colouring: Colouring
    sliding: dict[str, NDArray[np.int64]]

    @classmethod
    def of(cls, mesh: Mesh, fixed: Flags | None = None) -> Volume:
        """The connectivity of a mesh; ``fixed`` (N,) bool holds further nodes ("fixed by the user").

        Raises InputError for a mesh that lies in a plane, and where memory does not suffice.
        """
        return cls.made(Wound.of(mesh, fixed))

    @classmethod
    def made(cls, wound: Wound, slides: Flags | None = None, threads: int = 1) -> Volume:
        """Of cells that are wound. slides: (N,) bool by id, nodes of the boundary that may move all the same, on it.

        threads: one or two.
        """
        rows, marks, position, nodes = wound.rows, wound.marks.copy(), wound.position, len(wound.marks)
        rim, slid = np.zeros(nodes, dtype=np.int64), dict[str, NDArray[np.int64]]()  # rim: facets there
        if slides is not None:
            near, slid = released(marks, slides[wound.memory], position, AT_BOUNDARY, reasons_in_space(MOST))
            rim[near] = np.bincount(wound.boundary.ravel(), minlength=nodes)[near]
        start, corners = _cells_at(rows, marks, threads)
        ring_start, padded, local = _rings(wound, start, corners, int(rim.sum()), threads)
        around = np.diff(ring_start)
        marks[(marks == 0) & (around == 0)] |= np.uint16(connectivity.HIGH_VALENCE)
        # The link of a node is a triangulated sphere, at the boundary a disk.
        ball = 2 * around == np.diff(start) + np.where(rim > 0, rim + 2, 4)
        marks[(marks == 0) & ~ball] |= np.uint16(connectivity.NOT_A_DISK)
        held, free, places = sorted_out(marks, position, reasons_in_space(MOST))
        of_cell = np.empty_like(wound.orientation)
        of_cell[wound.origin] = wound.orientation
        return cls(
            wound.cell, wound.cells, of_cell, rows, wound.orientation, wound.origin, start, local, ring_start,
            padded[: ring_start[-1]], Colouring(places, ring_start, padded), slid,
            held=held, free=free, memory=wound.memory, near_free=marks == 0,
        )  # fmt: skip

    @cached_property
    def near_colours(self) -> Ints:
        """(N,) by places in memory: colours, of which no two free nodes of one cell share one; −1 where held."""
        return np.where(self.near_free, self.colouring.colours, np.int32(-1))

    @property
    def near_ringed(self) -> Flags:
        """(N,) by places in memory: which nodes have a star, of a part those of the whole mesh."""
        return np.diff(self.start) > 0 if self.starred is None else self.starred

    def cells_of(self, rows: NDArray[np.intp]) -> NDArray[np.int64]:
        """The index among all cells of the mesh of the cell of each of some rows of ``near``."""
        found: NDArray[np.int64] = self.cell[self.near_origin[rows]]
        return found

    @property
    def near_start(self) -> NDArray[np.int64]:
        """(N + 1,) where the neighbours of each node that has a star begin in ``near_ring``."""
        return self.ring_start

    @property
    def near_ring(self) -> Ints:
        """See ``near_start``."""
        return self.ring

    def rows_at(self, chosen: Flags) -> Ints:
        """The rows of ``near`` of the cells that have a chosen node. chosen: (N,) by places in memory."""
        found: Ints = connectivity.touching(self.near, chosen)
        return found

    def restricted(self, active: Flags) -> Volume:
        """The same with the active nodes (N,) by places in memory alone free, and only the cells around them.

        For a while: ``held`` does not tell of the others, nor ``cells_of`` of which cells the rows are.
        """
        around = self.simplices.take(self.rows_at(active))
        inner = replace(
            self, near=around.rows, near_orientation=around.orientation,
            free=np.sort(self.memory[np.flatnonzero(active)]), near_free=active,
        )  # fmt: skip
        inner.__dict__["changeable"] = inner.simplices  # all of them
        return inner

    @cached_property
    def simplices(self) -> Tetrahedra:
        """All of them, in memory order."""
        return Tetrahedra(self.near, self.near_orientation)

    @cached_property
    def changeable(self) -> Tetrahedra:
        """Those that have a free node."""
        rows = self.rows_at(self.near_free)
        return self.simplices if len(rows) == len(self.near) else self.simplices.take(rows)

    @cached_property
    def scored(self) -> Tetrahedra:
        """Those by which meshes on the way are compared."""
        return self.changeable

    @cached_property
    def stars(self) -> Stars:
        """The stars of the free nodes in the order in which they are smoothed."""
        return self.stars_of(np.flatnonzero(self.near_free))

    def stars_beside(self, work: Callable[[], Result]) -> Result:
        """What a work returns, with ``stars`` made beside it on another thread."""
        nodes = np.flatnonzero(self.near_free)
        found, (stars, fill) = side_by_side(2, work, lambda: self._empty_stars(nodes))
        count = int(stars.first[-1])
        side_by_side(2, partial(fill, 0, count // 2), partial(fill, count // 2, count))
        self.__dict__["stars"] = stars
        return found

    def forget_stars(self) -> None:
        """Gives the memory of ``stars`` back; who asks for them again has them made again."""
        self.__dict__.pop("stars", None)

    def stars_of(self, nodes: NDArray[np.int64]) -> Stars:
        """The stars of some free nodes, by places in memory."""
        stars, fill = self._empty_stars(nodes)
        fill(0, int(stars.first[-1]))
        return stars

    def _empty_stars(self, nodes: NDArray[np.int64]) -> tuple[Stars, Callable[[int, int], None]]:
        """The same but for what is in their blocks, and what fills some of these."""
        order, first, of_colour = in_blocks(
            nodes, np.diff(self.start)[nodes], self.near_colours[nodes], self.colouring.fewest
        )
        most_rings = np.maximum.reduceat(np.diff(self.ring_start)[order], first[:-1]) if len(order) else first[:-1]
        most_cells = np.maximum.reduceat(np.diff(self.start)[order], first[:-1]) if len(order) else first[:-1]
        rings = np.concatenate([[0], np.cumsum(LANES3 * most_rings)]).astype(np.int64)
        spokes = np.concatenate([[0], np.cumsum(3 * LANES3 * most_cells)]).astype(np.int64)
        count = len(first) - 1
        made = SpaceBlocks(
            np.empty(count * LANES3, dtype=np.int32), np.empty(rings[-1], dtype=np.int32), rings[:-1],
            np.empty(count, dtype=np.int32), np.empty(spokes[-1], dtype=np.uint8), spokes[:-1],
            np.empty(count, dtype=np.int32), np.empty(count * LANES3, dtype=np.int32), np.empty(count, dtype=np.int32),
            int(most_rings.max(initial=0)), int(most_cells.max(initial=0)),
        )  # fmt: skip

        def fill(begin: int, end: int) -> None:
            balls.fill_blocks3(
                order, self.ring_start, self.ring, self.start, self.local, first, rings, spokes, begin, end, made
            )

        return Stars(made, of_colour.astype(np.int32)), fill


def _cells_at(rows: Ints, marks: Marks, threads: int) -> tuple[NDArray[np.int64], Ints]:
    """In CSR form the cells at each node without a mark: start (N + 1,), and corners, 4t + k of cell t at corner k."""
    corners = np.empty(4 * len(rows), dtype=np.int32)  # of what is left out no page is ever touched

    def count(first: int, last: int, counts: Counts) -> None:
        balls.count_stars(rows, first, last, marks, counts)

    def write(first: int, last: int, place: Counts) -> None:
        balls.list_stars(rows, first, last, marks, place, corners)

    start = in_bins(len(rows), len(marks), threads, count, write)
    return start, corners[: start[-1]]


def _rings(
    wound: Wound, start: NDArray[np.int64], corners: Ints, rim: int, threads: int
) -> tuple[NDArray[np.int64], Ints, NDArray[np.uint8]]:
    """The nodes around each node in CSR form, with WIDTH zeros behind them, and the spokes: see ``balls.rings``.

    rim: how many facets at nodes that slide are free.
    """
    nodes = len(start) - 1
    middle = int(np.searchsorted(start[:nodes], start[nodes] // 2)) if threads > 1 else 0
    ring_start, local = np.zeros(nodes + 1, dtype=np.int64), np.empty((len(corners), 3), dtype=np.uint8)

    def some(first: int, last: int) -> Ints:
        room = (3 * int(start[last] - start[first]) + rim) // 2 + last - first + connectivity.WIDTH
        ring = np.empty(room, dtype=np.int32)  # of what is left out no page is ever touched
        end = balls.rings(
            wound.rows, wound.orientation, start, corners, first, last, ring_start, ring, local, MOST
        )  # fmt: skip
        ring[end : end + connectivity.WIDTH] = 0
        return ring[: end + connectivity.WIDTH]

    one, other = side_by_side(threads, partial(some, 0, middle), partial(some, middle, nodes))
    one = one[: -connectivity.WIDTH]
    ring_start[middle:] += len(one)
    ring_start[nodes] = len(one) + len(other) - connectivity.WIDTH
    return ring_start, np.concatenate([one, other]) if middle else other, local
