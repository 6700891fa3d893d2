"""What follows from a mesh's connectivity: winding, boundary, interfaces, which nodes are held and why, the patches.

Built once per connectivity. Coordinates enter in two places only: which of the two sides of a part is up (its larger
area is the positive one), and the memory order of nodes and triangles. On that no ring and no colour depends, but what
looks at some of the cells, or adds over all of them, takes them in that order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.kernels.star import pattern as kernels_stars
from gmsnet.kernels.topology import connectivity, links, patch
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.executor import Result
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.parallel.threads import side_by_side
from gmsnet.topology.connectivity import Connectivity
from gmsnet.topology.fans import closed_fans
from gmsnet.topology.held import MOST_NEIGHBOURS, known_marks, released, sorted_out
from gmsnet.topology.links import Links, taken_from
from gmsnet.topology.ordering import memory_order, planar_points, space_points, taken
from gmsnet.topology.polygons import Faces, Offsets, check_size
from gmsnet.topology.stars import Colouring, Flags, Ints, Stars

PER_NODE, PER_CORNER = 90, 22  # bytes that the set-up takes at most, measured; 222 a node where all are triangles


@dataclass(frozen=True, eq=False)
class Topology(Connectivity):
    """The connectivity of a mesh, seen from its nodes.

    plane: the two axes of a planar mesh, else None. triangles: (T, 3) corner nodes of all cells with three corners, in
    file order (six-node triangles by their corners); cell: (T,) the index of each among all cells of the mesh;
    orientation: (T,) int8, −1 where it has to be read backwards for all of its part to be wound alike with positive
    area. held, free, memory, near_free: see Connectivity. In memory order, by places in memory: near (T, 3) and
    near_orientation (T,), the triangles; rings, each from its smallest id on, and their CSR start (N + 1).
    colouring: of all nodes that were free at first, in the order of the ids, so that colours follow from the
    connectivity alone. face_cell: (F,) the index among all cells of the mesh of each face in file order; near_origin:
    the place there of each triangle of ``near``, of each face if not all cells are triangles (``cells_of``).
    sliding: reason → the ids of the nodes that would be held for it if they did not slide.
    """

    plane: tuple[int, int] | None
    triangles: Ints
    cell: NDArray[np.int64]
    orientation: NDArray[np.int8]
    near: Ints
    near_orientation: NDArray[np.int8]
    near_start: Offsets
    near_ring: Ints
    colouring: Colouring
    near_shapes: NDArray[np.uint8] | None = None
    near_cells: Ints | None = None
    near_pattern: Ints | None = None
    patterns: kernels_stars.Patterns | None = None
    quads: Ints = field(default_factory=lambda: np.empty((0, 4), dtype=np.int32))
    quad_cell: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    quad_orientation: NDArray[np.int8] = field(default_factory=lambda: np.empty(0, dtype=np.int8))
    face_cell: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    near_origin: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    sliding: dict[str, NDArray[np.int64]] = field(default_factory=dict)

    @classmethod
    def of(
        cls, mesh: Mesh, fixed: Flags | None = None, threads: int = 1, sliding: Flags | None = None, *,
        linked: bool = False,
    ) -> Topology:  # fmt: skip
        """The topology of a mesh; ``fixed`` (N,) bool holds further nodes ("fixed by the user").

        sliding: (N,) bool, nodes of boundaries, interfaces and line cells that may move all the same, along curves.
        linked: some do in the mesh that this is a part of, whose stars are told by links. threads: one or two.

        Raises InputError for more nodes or faces than int32 can number, and where memory does not suffice.
        """
        return cls.and_points(mesh, fixed, threads, sliding, linked=linked)[0]

    @classmethod
    def and_points(
        cls, mesh: Mesh, fixed: Flags | None = None, threads: int = 1, sliding: Flags | None = None, *,
        linked: bool = False,
    ) -> tuple[Topology, NDArray[np.float64]]:  # fmt: skip
        """The same, and the mesh's ``near_points``, which were needed for it."""
        nodes, corners = len(mesh.points), check_size(mesh)
        refuse_unless_free(nodes * PER_NODE + corners * PER_CORNER, f"the connectivity of {nodes:,} nodes")
        planar = planar_points(mesh) if mesh.plane else space_points(mesh)
        (memory, position), written = side_by_side(
            threads, partial(memory_order, planar, mesh.box), partial(Faces.of, mesh)
        )
        faces, planar = side_by_side(threads, partial(written.renumbered, position), partial(taken, planar, memory))
        marks = known_marks(mesh, fixed, position)
        points = None if mesh.plane is None else planar
        near_orientation, start, ring = closed_fans(faces, points, marks, memory, MOST_NEIGHBOURS)
        near_sliding, slid = np.zeros(nodes, dtype=bool), dict[str, NDArray[np.int64]]()
        if sliding is not None:
            near_sliding, slid = released(marks, sliding[memory], position)
        held, free, places = sorted_out(marks, position)
        (three, triangles), (whole, near) = written.with_corners(3), faces.with_corners(3)
        orientation = near_orientation
        if (orientation != orientation[:1]).any():
            orientation = np.empty_like(near_orientation)
            orientation[faces.origin] = near_orientation
        topology = cls(
            plane=mesh.plane,
            triangles=triangles,
            cell=written.cell[three],
            orientation=orientation[three],
            held=held,
            free=free,
            memory=memory,
            near=near,
            near_orientation=near_orientation[whole],
            near_start=start,
            near_ring=ring[: start[-1]],
            near_free=marks == 0,
            colouring=Colouring(places, start, ring),
            face_cell=written.cell,
            near_origin=faces.origin[whole],
            sliding=slid,
        )
        if linked or near_sliding.any() or mesh.has_quads:
            topology = topology.linked(Links.of(faces, near_orientation, start, topology.near_ring, near_sliding))
            four, quads = written.with_corners(4)
            topology = replace(
                topology, quads=quads, quad_cell=written.cell[four], quad_orientation=orientation[four],
                near_origin=faces.origin,
            )  # fmt: skip
        return topology, planar

    def linked(self, given: Links) -> Topology:
        """The same, its stars and cells given by links instead of fans."""
        stars, simplices = given
        simplices = simplices or self.simplices
        return replace(
            self,
            near=simplices.rows,
            near_orientation=simplices.orientation,
            near_shapes=simplices.shapes,
            near_cells=simplices.cells,
            near_start=stars.start,
            near_ring=stars.around[: stars.start[-1]],
            near_pattern=stars.pattern,
            patterns=stars.patterns,
            colouring=Colouring(self.colouring.places, stars.start, stars.around),
        )

    def rows_at(self, chosen: Flags) -> Ints:
        """The rows of ``near`` with a chosen node: of cells that have one, enough to name all nodes. chosen: (N,)."""
        found: Ints = connectivity.touching(self.near, chosen)
        return found

    def restricted(self, active: Flags) -> Topology:
        """The same with the active nodes (N,) by places in memory alone free, and only the triangles around them.

        For a while: ``held`` does not tell of the others, nor ``cells_of`` of which cells the rows are.
        """
        nodes = np.flatnonzero(active)
        if self.patterns is None:
            near = patch.triangles_around(nodes, active, self.near_start, self.near_ring)
            around = Simplices(near, np.ones(len(near), dtype=np.int8))
        else:
            around = self.simplices.take(self.rows_at(active))
        inner = replace(
            self, near=around.rows, near_orientation=around.orientation, near_shapes=around.shapes,
            near_cells=around.cells, free=np.sort(self.memory[nodes]), near_free=active,
        )  # fmt: skip
        inner.__dict__["changeable"] = inner.simplices  # all of them
        return inner

    @cached_property
    def stars(self) -> Stars:
        """The patches in the order in which they are smoothed."""
        return self.in_blocks()

    def stars_beside(self, work: Callable[[], Result]) -> Result:
        """What a work returns, with ``stars`` made beside it on another thread."""
        return side_by_side(2, work, lambda: self.stars)[0]

    def in_blocks(self) -> Stars:
        """The same, made anew."""
        colours, fewest = self.near_colours, self.colouring.fewest
        return Stars.in_plane(np.flatnonzero(self.near_free).astype(np.int32), self.links, colours, fewest)

    @cached_property
    def patches(self) -> tuple[Offsets, Ints]:
        """The rings of the free nodes by node ids: start (F + 1) and ring, row i of node free[i].

        Counter-clockwise, each from its smallest id on.
        """
        place = self.places[self.free]
        degree = np.diff(self.near_start)[place]
        start = np.zeros(len(place) + 1, dtype=self.near_start.dtype)
        np.cumsum(degree, out=start[1:])
        within = np.arange(start[-1]) - np.repeat(start[:-1], degree)
        return start, self.memory[self.near_ring[np.repeat(self.near_start[place], degree) + within]]

    @cached_property
    def near_colours(self) -> Ints:
        """(N,) by places in memory: colours, of which no two free nodes of one cell share one; −1 where held."""
        colours = self.colouring.colours
        if len(self.free) == len(self.colouring.places):
            return colours
        return np.where(self.near_free, colours, np.int32(-1))

    @cached_property
    def near_ringed(self) -> Flags:
        """(N,) by places in memory: which nodes have a ring: the free ones, and those held since (``holding``).

        Of a part those of the whole mesh.
        """
        return np.diff(self.near_start) > 0 if self.starred is None else self.starred

    def with_rings_of_free_nodes(self) -> Topology:
        """The same, in which a node has a ring only if it is free."""
        free = self.near_free
        if (self.near_ringed == free).all():
            return self
        degree = np.diff(self.near_start)
        start = np.zeros_like(self.near_start)
        np.cumsum(np.where(free, degree, 0), out=start[1:])
        pattern = None if self.near_pattern is None else np.where(free, self.near_pattern, 0)  # 0: of no cells
        ring = self.near_ring[np.repeat(free, degree)]
        return replace(self, near_start=start, near_ring=ring, near_pattern=pattern, starred=None)

    def orientation_of(self, cells: NDArray[np.int64]) -> NDArray[np.int8]:
        """How faces with three or four corners are read, by their indices among all cells of the mesh: ±1."""
        known = np.concatenate([self.cell, self.quad_cell])
        order = np.argsort(known)
        orientation = np.concatenate([self.orientation, self.quad_orientation])[order]
        found: NDArray[np.int8] = orientation[np.searchsorted(known[order], cells)]
        return found

    @cached_property
    def simplices(self) -> Simplices:
        """The corner simplices of all cells whose nodes may move, in memory order."""
        return Simplices(self.near, self.near_orientation, self.near_shapes, self.near_cells)

    def cells_of(self, rows: NDArray[np.intp]) -> NDArray[np.int64]:
        """The index among all cells of the mesh of the cell of each of some rows of ``near``."""
        chosen: NDArray[np.int64] = self.face_cell[
            self.near_origin[rows if self.near_cells is None else self.near_cells[rows]]
        ]
        return chosen

    @cached_property
    def scored(self) -> Simplices:
        """Those by which meshes on the way are compared: of the cells with a free node; ``simplices`` itself, where
        these are all."""
        return self.changeable if self.near_cells is None else self._taken(self._scored_rows())

    @cached_property
    def others(self) -> Simplices:
        """Those of the cells without a free node."""
        left = np.ones(len(self.near), dtype=bool)
        left[self._scored_rows()] = False
        return self._taken(np.flatnonzero(left).astype(np.int32))

    def _scored_rows(self) -> Ints:
        if self.near_cells is None:
            return self.rows_at(self.near_free)
        found: Ints = links.rows_of_cells_with(self.near, self.near_cells, self.near_free)
        return found

    @cached_property
    def changeable(self) -> Simplices:
        """Those that have a free node."""
        return self._taken(self.rows_at(self.near_free))

    def _taken(self, rows: Ints) -> Simplices:
        """Some of the simplices; themselves, if all."""
        simplices = self.simplices
        if len(rows) == len(self.near):
            return simplices
        in_plane = isinstance(simplices, Simplices)  # those of a surface are others
        return taken_from(simplices, rows) if in_plane and simplices.cells is not None else simplices.take(rows)

    @cached_property
    def links(self) -> kernels_stars.Stars:
        """The stars of all nodes by places in memory, in CSR form."""
        return kernels_stars.Stars(self.near_start, self.near_ring, self.near_pattern, self.patterns)

    @cached_property
    def colours(self) -> Ints:
        """(N,) colour of each node by id, −1 where held."""
        return self.near_colours[self.places]
