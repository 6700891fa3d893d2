"""What follows from a mesh's connectivity: winding, boundary, interfaces, which nodes are held and why, the patches.

Built once per connectivity. Coordinates enter in two places only: which of the two sides of a part is up (its larger
area is the positive one), and the memory order of the stars, which does not influence results.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels import connectivity, layout
from gmsnet.mesh import CORNERS, CellBlock, Mesh

Ints = NDArray[np.int32]
Flags = NDArray[np.bool_]

SMOOTHED = ("triangle",)  # the cell types whose nodes may move
MOST_NEIGHBOURS = 4096  # a hub of more is held: a block of 64 such stars would no longer be a block


@dataclass(frozen=True, eq=False)
class Stars:
    """The free nodes with their rings in blocks of 64 of one colour and degree (see kernels.layout.blocks)."""

    centre: Ints
    rings: Ints
    offset: NDArray[np.int64]
    degree: Ints
    count: Ints
    first: Ints

    @property
    def colours(self) -> int:
        """How many colours there are; the blocks of colour c are first[c] … first[c + 1] − 1."""
        return len(self.first) - 1

    @cached_property
    def most(self) -> int:
        """The largest degree."""
        return int(self.degree.max(initial=0))


@dataclass(frozen=True, eq=False)
class Topology:
    """The connectivity of a mesh, seen from its nodes.

    triangles: (T, 3) corner nodes of all cells with three corners, in file order (six-node triangles by their
    corners); cell: (T,) the index of each among all cells of the mesh; turn: (T,) int8, −1 where it has to be read
    backwards for all of its part to be wound alike with positive area. held: reason → node ids, the first reason that
    applies. free: (F,) ids of the nodes that may move. start (N + 1), ring: the rings of the free nodes,
    counter-clockwise, in CSR form by node id. colours: (N,) no two free nodes of one cell share a colour; −1 where
    held. parts: how many pieces the faces form over shared edges. memory: (N,) node ids in memory order.
    """

    nodes: int
    plane: tuple[int, int] | None
    triangles: Ints
    cell: NDArray[np.int64]
    turn: NDArray[np.int8]
    parts: int
    held: dict[str, NDArray[np.int64]]
    free: Ints
    start: Ints
    ring: Ints
    colours: Ints
    memory: Ints

    @classmethod
    def of(cls, mesh: Mesh, fixed: Flags | None = None) -> Topology:
        """The topology of a mesh; ``fixed`` (N,) bool holds further nodes ("fixed by the user")."""
        nodes = len(mesh.points)
        faces = _Faces.of(mesh)
        planar = _planar_points(mesh)
        corner, first = faces.corner, faces.first
        face, head = connectivity.half_edges(first, corner)
        twin = connectivity.match(corner, head, nodes)
        part, turn, consistent = connectivity.wind(first, corner, twin, face)
        if mesh.plane is not None:
            area = connectivity.part_areas(planar, first, corner, part, turn, len(consistent))
            turn = np.where(area[part] < 0, -turn, turn).astype(np.int8)

        boundary, interface, crowded = (np.zeros(nodes, dtype=bool) for _ in range(3))
        connectivity.mark_edges(corner, head, twin, face, faces.region, boundary, interface, crowded)
        unwound = np.zeros(nodes, dtype=bool)
        unwound[corner[~consistent[part][face]]] = True
        reasons = {
            "boundary": boundary,
            "interface between regions": interface,
            "node of a line or vertex cell": _used_by(mesh, lambda b: b.dimension < 2),
            "node of a cell that is not smoothed": _used_by(mesh, lambda b: b.dimension > 1 and b.kind not in SMOOTHED),
            "non-manifold edge": crowded,
            "part that cannot be wound consistently": unwound,
            "fixed by the user": np.zeros(nodes, dtype=bool) if fixed is None else fixed,
        }
        candidate = ~np.logical_or.reduce(list(reasons.values()))
        state, start, ring = connectivity.walk_fans(
            first, corner, head, twin, face, turn, faces.smoothable, candidate, nodes
        )
        unused = ~_used_by(mesh, lambda b: True)
        hub = start[1:] - start[:-1] > MOST_NEIGHBOURS
        fan = candidate & ~unused & (state != connectivity.FREE)
        reasons = {"not used by any cell": unused, **reasons, "star is not one closed fan": fan}
        reasons[f"more than {MOST_NEIGHBOURS} neighbours"] = hub
        is_free = candidate & ~unused & ~fan & ~hub
        free = np.flatnonzero(is_free).astype(np.int32)
        whole = faces.corners == 3
        return cls(
            nodes=nodes,
            plane=mesh.plane,
            triangles=corner[faces.triangle_corners].reshape(-1, 3),
            cell=faces.cell[whole],
            turn=turn[whole],
            parts=len(consistent),
            held=_first_reason(reasons),
            free=free,
            start=start,
            ring=ring,
            colours=connectivity.colour(free, start, ring, is_free),
            memory=layout.morton_order(planar),
        )

    @cached_property
    def position(self) -> Ints:
        """(N,) place of each node in memory order."""
        position = np.empty(self.nodes, dtype=np.int32)
        position[self.memory] = np.arange(self.nodes, dtype=np.int32)
        return position

    @cached_property
    def stars(self) -> Stars:
        """The patches in the order in which they are smoothed."""
        by_memory = self.memory[self.colours[self.memory] >= 0]
        degrees = self.start[1:] - self.start[:-1]
        most = int(degrees.max(initial=0, where=self.colours >= 0))
        colours = int(self.colours.max(initial=-1)) + 1
        arrays = layout.blocks(by_memory, self.position, self.start, self.ring, self.colours, most, colours)
        return Stars(*arrays)

    def ring_of(self, node: int) -> Ints:
        """The neighbours of a free node, counter-clockwise (empty for a held one)."""
        return self.ring[self.start[node] : self.start[node + 1]]


@dataclass(frozen=True)
class _Faces:
    """The two-dimensional cells as polygons (their corners), in CSR form."""

    first: Ints
    corner: Ints
    corners: Ints  # how many corners each has
    region: NDArray[np.int64]
    smoothable: Flags
    cell: NDArray[np.int64]
    triangle_corners: Flags  # per corner: does it belong to a face with three?

    @classmethod
    def of(cls, mesh: Mesh) -> _Faces:
        corner, corners, region, smoothable, cell = [], [], [], [], []
        before = 0
        for block in mesh.cells:
            count = len(block.nodes)
            if block.dimension == 2:
                size = CORNERS.get(block.kind, block.nodes.shape[1])
                corner.append(block.nodes[:, :size].ravel())
                corners.append(np.full(count, size))
                region.append(block.regions)
                smoothable.append(np.full(count, block.kind in SMOOTHED))
                cell.append(np.arange(before, before + count))
            before += count
        if sum(len(c) for c in corner) >= 2**31:
            raise InputError("the mesh has more than 2³¹ cell corners, which is more than gmsnet can number")
        sizes = _joined(corners, np.int32)
        first = np.zeros(len(sizes) + 1, dtype=np.int32)
        np.cumsum(sizes, out=first[1:])
        return cls(
            first=first,
            corner=_joined(corner, np.int32),
            corners=sizes,
            region=_joined(region, np.int64),
            smoothable=_joined(smoothable, np.bool_),
            cell=_joined(cell, np.int64),
            triangle_corners=np.repeat(sizes == 3, sizes),
        )


def _joined(arrays: list[NDArray[Any]], dtype: type) -> NDArray[Any]:
    return np.concatenate(arrays).astype(dtype, copy=False) if arrays else np.empty(0, dtype=dtype)


def _used_by(mesh: Mesh, chosen: Any) -> Flags:
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


def _planar_points(mesh: Mesh) -> NDArray[np.float64]:
    """The points in the plane of the mesh (N, 2); for one that is not planar, its first two coordinates."""
    return np.ascontiguousarray(mesh.points[:, mesh.plane or (0, 1)])


def planar_points(mesh: Mesh) -> NDArray[np.float64]:
    """The points in the plane of the mesh (N, 2), scaled by a power of two so that the largest coordinate is near 1.

    The scaling is exact, and keeps products of tiny or huge coordinates from under- or overflowing.
    """
    return _planar_points(mesh) * 0.5 ** scale_exponent(mesh)


def scale_exponent(mesh: Mesh) -> int:
    """The power of two by which ``planar_points`` divides."""
    largest = float(np.abs(_planar_points(mesh)).max(initial=0.0))
    return int(np.frexp(largest)[1]) if largest > 0.0 else 0


__all__ = ["CellBlock", "Stars", "Topology", "planar_points", "scale_exponent"]
