"""What follows from a mesh's connectivity: winding, boundary, interfaces, which nodes are held and why, the patches.

Built once per connectivity. Coordinates enter in two places only: which of the two sides of a part is up (its larger
area is the positive one), and the memory order of the nodes, which does not influence results.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.faces import SMOOTHED, Faces
from gmsnet.kernels import connectivity, layout
from gmsnet.kernels.stars import Blocks
from gmsnet.mesh import CellBlock, Mesh

Ints = NDArray[np.int32]
Flags = NDArray[np.bool_]

NO_AREA = 1e-9  # of the sum of its faces' areas: the area of such a part (a closed surface pressed flat) is noise
MOST_NEIGHBOURS = 4096  # a hub of more is held: a block of 64 such stars would no longer fit any cache


@dataclass(frozen=True, eq=False)
class Stars:
    """The patches in blocks of 64 stars of one colour and degree; those of colour c are first[c] … first[c + 1] − 1."""

    blocks: Blocks
    first: Ints

    @property
    def colours(self) -> int:
        """How many colours there are."""
        return len(self.first) - 1


@dataclass(frozen=True, eq=False)
class Topology:
    """The connectivity of a mesh, seen from its nodes.

    plane: the two axes of a planar mesh, else None. triangles: (T, 3) corner nodes of all cells with three corners, in
    file order (six-node triangles by their corners); cell: (T,) the index of each among all cells of the mesh; turn:
    (T,) int8, −1 where it has to be read backwards for all of its part to be wound alike with positive area.
    parts: how many pieces the faces form over shared edges. held: reason → node ids, the first reason that applies.
    free: (F,) ids of the nodes that may move, ascending.
    memory: (N,) node ids in memory order. In that order, by places in memory: near (T, 3) and near_turn (T,), the
    triangles; rings, each from its smallest id on, their CSR start (N + 1) and the colours (N,), of which no two free
    nodes of one cell share one (−1 where held).
    """

    plane: tuple[int, int] | None
    triangles: Ints
    cell: NDArray[np.int64]
    turn: NDArray[np.int8]
    parts: int
    held: dict[str, NDArray[np.int64]]
    free: Ints
    memory: Ints
    near: Ints
    near_turn: NDArray[np.int8]
    near_start: Ints
    near_ring: Ints
    near_colours: Ints

    @classmethod
    def of(cls, mesh: Mesh, fixed: Flags | None = None) -> Topology:
        """The topology of a mesh; ``fixed`` (N,) bool holds further nodes ("fixed by the user")."""
        nodes = len(mesh.points)
        planar = planar_points(mesh)
        memory = layout.morton_order(planar)
        position = _inverse(memory)
        written = Faces.of(mesh)
        faces = written.renumbered(position)
        first, corner = faces.first, faces.corner
        face, head = connectivity.half_edges(first, corner)
        twin = connectivity.match(corner, head, nodes)
        part, turn, consistent = connectivity.wind(first, corner, twin, face)
        if mesh.plane is not None:
            area, extent = connectivity.part_areas(planar[memory], first, corner, part, turn, len(consistent))
            if (area < 0).any():
                turn = np.where(area[part] < 0, -turn, turn).astype(np.int8)
            flat = np.abs(area) <= NO_AREA * extent
        else:
            flat = np.zeros(len(consistent), dtype=bool)

        boundary, interface, crowded, unwound, sideless = (np.zeros(nodes, dtype=bool) for _ in range(5))
        connectivity.mark_edges(corner, head, twin, face, faces.region, boundary, interface, crowded)
        if not consistent.all():
            unwound[corner[~consistent[part][face]]] = True
        if flat.any():
            sideless[corner[flat[part][face]]] = True
        unused = ~_used_by(mesh, lambda block: True)
        reasons = {
            "not used by any cell": unused,
            "boundary": boundary[position],
            "interface between regions": interface[position],
            "node of a line or vertex cell": _used_by(mesh, lambda block: block.dimension < 2),
            "node of a cell that is not smoothed": _used_by(
                mesh, lambda block: block.dimension > 1 and block.kind not in SMOOTHED
            ),
            "non-manifold edge": crowded[position],
            "part that cannot be wound consistently": unwound[position],
            "part of zero area, which has no positive side": sideless[position],
            "fixed by the user": np.zeros(nodes, dtype=bool) if fixed is None else fixed,
        }
        candidate = ~np.logical_or.reduce(list(reasons.values()))
        state, start, ring = connectivity.walk_fans(
            first, corner, head, twin, face, turn, faces.smoothable, candidate[memory], nodes
        )
        connectivity.turn_rings(start, ring, memory)
        hub = (np.diff(start) > MOST_NEIGHBOURS)[position]
        fan = candidate & (state != connectivity.FREE)[position]
        reasons |= {"star is not one closed fan": fan, f"more than {MOST_NEIGHBOURS} neighbours": hub}
        is_free = candidate & ~fan & ~hub
        free = np.flatnonzero(is_free).astype(np.int32)
        whole, near = faces.triangles()
        three, triangles = written.triangles()
        back = np.empty(len(written), dtype=np.int8)
        back[faces.origin] = turn
        return cls(
            plane=mesh.plane,
            triangles=triangles,
            cell=written.cell[three],
            turn=back[three],
            parts=len(consistent),
            held=_first_reason(reasons),
            free=free,
            memory=memory,
            near=near,
            near_turn=turn[whole],
            near_start=start,
            near_ring=ring,
            # In the order of the node ids, so that colours follow from the connectivity alone.
            near_colours=connectivity.colour(position[free], start, ring, is_free[memory]),
        )

    def holding(self, chosen: Flags, reason: str) -> Topology:
        """The same, with the free nodes among the chosen (N,) by id held for this reason."""
        newly = self.free[chosen[self.free]]
        if not len(newly):
            return self
        colours = np.where(chosen[self.memory], -1, self.near_colours).astype(np.int32)
        held = {**self.held, reason: newly.astype(np.int64)}
        return replace(self, held=held, free=self.free[~chosen[self.free]], near_colours=colours)

    def restricted(self, active: Flags) -> tuple[Topology, Ints]:
        """The same with the active nodes (N,) by places in memory alone free, and only the triangles around them.

        For a while: ``held`` does not tell of the others. Returns also the rows of those triangles in ``near``.
        """
        rows: Ints = connectivity.touching(self.near, active)
        near, turn = self.near[rows], self.near_turn[rows]
        free = np.sort(self.memory[np.flatnonzero(active)])
        colours = np.where(active, self.near_colours, np.int32(-1))
        inner = replace(self, near=near, near_turn=turn, free=free, near_colours=colours)
        inner.__dict__["changeable"] = near, turn  # all of them
        return inner, rows

    @cached_property
    def stars(self) -> Stars:
        """The patches in the order in which they are smoothed."""
        free = np.flatnonzero(self.near_colours >= 0).astype(np.int32)
        most = int(np.diff(self.near_start)[free].max(initial=0))
        colours = int(self.near_colours.max(initial=-1)) + 1
        centre, rings, offset, degree, filled, first = layout.blocks(
            free, self.near_start, self.near_ring, self.near_colours, most, colours
        )
        return Stars(Blocks(centre, rings, offset, degree, filled, most), first)

    @cached_property
    def patches(self) -> tuple[Ints, Ints]:
        """The rings of the free nodes by node ids: start (F + 1) and ring, row i of node free[i].

        Counter-clockwise, each from its smallest id on.
        """
        place = self.places[self.free]
        degree = np.diff(self.near_start)[place]
        start = np.zeros(len(place) + 1, dtype=np.int32)
        np.cumsum(degree, out=start[1:])
        within = np.arange(start[-1]) - np.repeat(start[:-1], degree)
        return start, self.memory[self.near_ring[np.repeat(self.near_start[place], degree) + within]]

    @cached_property
    def places(self) -> Ints:
        """(N,) the place in memory of each node by id."""
        return _inverse(self.memory)

    @cached_property
    def near_free(self) -> Flags:
        """(N,) by places in memory: which nodes may move."""
        return self.near_colours >= 0

    @cached_property
    def near_ringed(self) -> Flags:
        """(N,) by places in memory: which nodes have a ring: the free ones, and those held since (``holding``)."""
        return np.diff(self.near_start) > 0

    def with_rings_of_free_nodes(self) -> Topology:
        """The same, in which a node has a ring only if it is free."""
        free = self.near_free
        if (self.near_ringed == free).all():
            return self
        degree = np.diff(self.near_start)
        start = np.zeros_like(self.near_start)
        np.cumsum(np.where(free, degree, 0), out=start[1:])
        return replace(self, near_start=start, near_ring=self.near_ring[np.repeat(free, degree)])

    @cached_property
    def changeable(self) -> tuple[Ints, NDArray[np.int8]]:
        """The rows of near and near_turn that have a free node."""
        rows = connectivity.touching(self.near, self.near_free)
        every = len(rows) == len(self.near)
        return (self.near, self.near_turn) if every else (self.near[rows], self.near_turn[rows])

    @cached_property
    def colours(self) -> Ints:
        """(N,) colour of each node by id, −1 where held."""
        return self.near_colours[self.places]


def _inverse(order: Ints) -> Ints:
    place = np.empty_like(order)
    place[order] = np.arange(len(order), dtype=order.dtype)
    return place


def _used_by(mesh: Mesh, chosen: Callable[[CellBlock], bool]) -> Flags:
    flags = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.cells:
        if chosen(block):
            flags[block.nodes] = True
    return flags


def _first_reason(reasons: dict[str, Flags]) -> dict[str, NDArray[np.int64]]:
    """Reason → ids, each node under the first reason that applies to it; reasons without nodes are left out."""
    held: dict[str, NDArray[np.int64]] = {}
    taken = np.zeros(len(next(iter(reasons.values()))), dtype=bool)
    for reason, flags in reasons.items():
        if (ids := np.flatnonzero(flags & ~taken)).size:
            held[reason] = ids
        taken |= flags
    return held


class Flat(Protocol):
    """Points in a plane: a Mesh, or what is kept of one. See there."""

    @property
    def points(self) -> NDArray[np.float64]:
        """(N × 2 or N × 3) coordinates."""
        ...

    @property
    def plane(self) -> tuple[int, int] | None:
        """The two axes."""
        ...

    @property
    def single(self) -> bool:
        """Are they in single precision?"""
        ...


def planar_points(mesh: Flat) -> NDArray[np.float64]:
    """The points in the plane of the mesh (N, 2), divided by 2 to the power of ``scale_exponent``, which is exact.

    The largest coordinate is then near 1, so that products of tiny or huge ones neither under- nor overflow. Of a mesh
    that is not planar, the first two coordinates.
    """
    exponent = scale_exponent(mesh)
    if abs(exponent) < 1000:
        return np.ascontiguousarray(_in_plane(mesh) * 2.0**-exponent)
    return np.ldexp(_in_plane(mesh), -exponent)


def near_points(mesh: Flat, topology: Topology) -> NDArray[np.float64]:
    """The same by places in memory."""
    return np.take(planar_points(mesh), topology.memory, axis=0)


def scale_exponent(mesh: Flat) -> int:
    """The power of two by which ``planar_points`` divides: none in single precision, where nothing can overflow."""
    if mesh.single:
        return 0
    points = _in_plane(mesh)
    largest = max(-float(points.min(initial=0.0)), float(points.max(initial=0.0)))
    return int(np.frexp(largest)[1])


def _in_plane(mesh: Flat) -> NDArray[np.float64]:
    """(N, 2) view."""
    first, second = mesh.plane or (0, 1)
    return mesh.points[:, first : second + 1 : second - first]
