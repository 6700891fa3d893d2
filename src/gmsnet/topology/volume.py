"""The connectivity of a mesh of tetrahedra, seen from its nodes.

A node is free where its cells are one closed ball: each facet at it belongs to two cells, which see it from two sides,
and with F cells there are F/2 + 2 nodes around it, as on a sphere of F triangles. Nodes are numbered as in the plane:
by ids at the doors, and by places in memory inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.simplex import orientation3
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.space import LANES3, SpaceBlocks
from gmsnet.kernels.topology import balls, connectivity, facets, layout
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.topology.connectivity import Connectivity
from gmsnet.topology.held import reasons_in_space, sorted_out
from gmsnet.topology.ordering import space_points
from gmsnet.topology.polygons import Ints
from gmsnet.topology.stars import Colouring, Stars

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

SMOOTHED = ("tetra",)  # the kinds whose nodes may move
MOST = 255  # nodes around a free node: they are numbered by one byte
BITS = connectivity.BOUNDARY, connectivity.INTERFACE, connectivity.NON_MANIFOLD
BYTES_PER_CELL = 190  # that the set-up takes at most


@dataclass(frozen=True, eq=False)
class Volume(Connectivity):
    """See the module.

    cell: (T,) the index of each tetrahedron among all cells of the mesh; cells: (T, 4) their nodes in file order, and
    orientation: (T,) int8, −1 where the volume is to be taken with the other sign, for all of a part to be alike and
    mostly positive. held, free, memory, near_free: see Connectivity. near (T, 4), near_orientation: by places in
    memory; near_origin: the place in file order of each row of near. The cells at node v that is free, or was before
    others were held, are start[v] … start[v + 1] − 1 of local (M, 3), which nodes of its ring their spokes end in:
    ring_start (N + 1,), ring.
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

    @classmethod
    def of(cls, mesh: Mesh, fixed: Flags | None = None) -> Volume:
        """The connectivity of a mesh; ``fixed`` (N,) bool holds further nodes ("fixed by the user").

        Raises InputError for a mesh that lies in a plane, and where memory does not suffice.
        """
        refuse_flat(mesh)
        cells, cell, region = _tetrahedra(mesh)
        nodes = len(mesh.points)
        refuse_unless_free(len(cells) * BYTES_PER_CELL, f"the connectivity of {len(cells):,} tetrahedra")
        points = space_points(mesh)
        memory, position = np.empty(nodes, dtype=np.int32), np.empty(nodes, dtype=np.int32)
        keys, other = np.empty(nodes, dtype=np.int64), np.empty(nodes, dtype=np.int64)
        layout.morton_order3(points, keys, other, memory, position)
        place, origin = np.empty_like(cells), np.empty(len(cells), dtype=np.int32)
        facets.order_cells(cells, position, np.zeros(nodes + 2, dtype=np.int32), place, origin)
        rows, region = place.take(origin, axis=0), region.take(origin) if len(region) else region
        marks = _known_marks(mesh, fixed, position)
        orientation = _wound(points[memory], rows, region, marks)
        others = np.uint16(connectivity.LINE | connectivity.UNSUPPORTED_CELL)
        unused = (np.bincount(rows.ravel(), minlength=nodes) == 0) & (marks & others == 0)
        marks[unused] |= np.uint16(connectivity.UNUSED)
        start = np.zeros(nodes + 2, dtype=np.int64)
        balls.count_stars(rows, marks, start)
        spokes = np.empty((start[-1], 3), dtype=np.int32)
        balls.list_stars(rows, orientation, marks, start, spokes)
        ring_start, ring = np.empty(nodes + 1, dtype=np.int64), np.empty(3 * len(spokes) // 2 + nodes, dtype=np.int32)
        local = np.empty((len(spokes), 3), dtype=np.uint8)
        end = balls.rings(start, spokes, ring_start, ring, local, MOST)
        start, around = start[:-1], np.diff(ring_start)
        marks[(marks == 0) & (around == 0)] |= np.uint16(connectivity.HIGH_VALENCE)
        ball = 2 * around == np.diff(start) + 4
        marks[(marks == 0) & ~ball] |= np.uint16(connectivity.NOT_A_DISK)
        held, free, places = sorted_out(marks, position, reasons_in_space(MOST))
        of_cell = np.empty_like(orientation)
        of_cell[origin] = orientation
        padded = np.append(ring[:end], np.zeros(connectivity.WIDTH, dtype=np.int32))
        return cls(
            cell, cells, of_cell, rows, orientation, origin, start, local, ring_start, ring[:end],
            Colouring(places, ring_start, padded), held=held, free=free, memory=memory, near_free=marks == 0,
        )  # fmt: skip

    @cached_property
    def near_colours(self) -> Ints:
        """(N,) by places in memory: colours, of which no two free nodes of one cell share one; −1 where held."""
        return np.where(self.near_free, self.colouring.colours, np.int32(-1))

    @property
    def near_ringed(self) -> Flags:
        """(N,) by places in memory: which nodes have a star."""
        return np.diff(self.start) > 0

    def cells_of(self, rows: NDArray[np.intp]) -> NDArray[np.int64]:
        """The index among all cells of the mesh of the cell of each of some rows of ``near``."""
        found: NDArray[np.int64] = self.cell[self.near_origin[rows]]
        return found

    @cached_property
    def simplices(self) -> Tetrahedra:
        """All of them, in memory order."""
        return Tetrahedra(self.near, self.near_orientation)

    @cached_property
    def changeable(self) -> Tetrahedra:
        """Those that have a free node."""
        return self.simplices.take(np.flatnonzero(self.near_free[self.near].any(axis=1)).astype(np.int32))

    @property
    def scored(self) -> Tetrahedra:
        """Those by which meshes on the way are compared."""
        return self.changeable

    @cached_property
    def stars(self) -> Stars:
        """The stars of the free nodes in the order in which they are smoothed."""
        return self.stars_of(np.flatnonzero(self.near_free))

    def stars_of(self, nodes: NDArray[np.int64]) -> Stars:
        """The stars of some free nodes, by places in memory."""
        cells = np.diff(self.start)[nodes]
        colour = self.near_colours[nodes]
        order = nodes[np.lexsort((nodes, cells, colour))].astype(np.int32)
        colours = int(colour.max(initial=-1)) + 1
        sizes = np.bincount(colour, minlength=colours)
        blocks = -(-sizes // LANES3)
        of_colour = np.concatenate([[0], np.cumsum(blocks)])
        begin = np.concatenate([[0], np.cumsum(sizes)])[:-1]
        within = np.arange(of_colour[-1]) - np.repeat(of_colour[:-1], blocks)
        first = np.append(np.repeat(begin, blocks) + LANES3 * within, len(order)).astype(np.int64)
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
        balls.fill_blocks3(order, self.ring_start, self.ring, self.start, self.local, first, rings, spokes, made)
        return Stars(made, of_colour.astype(np.int32))


def refuse_flat(mesh: Mesh) -> None:
    """InputError for volumes that lie in a plane."""
    if mesh.plane is not None:
        raise InputError("the mesh has volumes, but all its nodes lie in one plane: check the file's coordinates")


def _tetrahedra(mesh: Mesh) -> tuple[Ints, NDArray[np.int64], NDArray[np.int64]]:
    """The cells (T, 4), the index of each among all cells, and their regions, none (0,) where all are the same."""
    chosen, numbers, before = [], [], 0
    for block in mesh.cells:
        if block.kind in SMOOTHED and len(block.nodes):
            chosen.append(block)
            numbers.append(np.arange(before, before + len(block.nodes)))
        before += len(block.nodes)
    if not chosen:
        return np.empty((0, 4), dtype=np.int32), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    cells = np.concatenate([block.nodes for block in chosen], dtype=np.int32, casting="same_kind")
    first = chosen[0].regions[0]
    same = all((block.regions == first).all() for block in chosen)
    region = np.empty(0, dtype=np.int64) if same else np.concatenate([block.regions for block in chosen])
    return cells, numbers[0] if len(numbers) == 1 else np.concatenate(numbers), region


def _known_marks(mesh: Mesh, fixed: Flags | None, position: Ints) -> NDArray[np.uint16]:
    """(N,) by places in memory: of cells that are not smoothed, of faces and lines, and of chosen nodes."""
    marks = np.zeros(len(position), dtype=np.uint16)
    for block in mesh.cells:
        if block.kind not in SMOOTHED:
            volume = block.dimension in (3, None)
            mark = connectivity.UNSUPPORTED_CELL if volume else connectivity.LINE
            marks[position[block.nodes.ravel()]] |= np.uint16(mark)
    if fixed is not None and fixed.any():
        marks[position[fixed]] |= np.uint16(connectivity.CHOSEN)
    return marks


def _wound(points: Floats, rows: Ints, region: NDArray[np.int64], marks: NDArray[np.uint16]) -> NDArray[np.int8]:
    """The orientation of each cell; marks the nodes of the boundary, of interfaces and of what cannot be wound."""
    count = len(rows)
    positive, negative = orientation3.count_signs(points, rows)
    if count in (positive, negative):
        orientation = np.full(count, 1 if positive == count else -1, dtype=np.int8)
        if _marked_alike(rows, region, marks):
            return orientation
    twin, nothing = _matched(rows, len(marks)), np.empty(0, dtype=np.uint64)
    piece, orientation = np.full(count, -1, dtype=np.int32), np.ones(count, dtype=np.int8)
    consistent = facets.wind(rows, twin, piece, orientation)
    facets.mark_facets(rows, twin, region, orientation, nothing, *BITS, marks)
    volume, extent = _part_volumes(points, rows, piece, orientation, len(consistent))
    orientation[volume[piece] < 0.0] *= -1
    for parts, mark in (
        (~consistent, connectivity.NON_ORIENTABLE),
        (np.abs(volume) <= 1e-9 * extent, connectivity.ZERO_AREA),
    ):
        marks[rows[parts[piece]].ravel()] |= np.uint16(mark)
    return orientation


def _marked_alike(rows: Ints, region: NDArray[np.int64], marks: NDArray[np.uint16]) -> bool:
    """The same marks where all cells have one orientation; False if some see a facet from the same side.

    Only the cells at nodes around which they do not close are looked at for facets.
    """
    nodes = len(marks)
    places, area = np.empty((nodes, 2), dtype=np.uint64), np.zeros(nodes, dtype=np.uint64)
    facets.scatter(places)
    own = np.empty(nodes if len(region) else 0, dtype=np.int64)
    facets.enclose(rows, region, places, area, own, marks, connectivity.INTERFACE)
    outer = np.flatnonzero((area != 0)[rows].any(axis=1))
    part, alike = rows[outer], np.ones(len(outer), dtype=np.int8)
    if not facets.mark_facets(part, _matched(part, nodes), region[:0], alike, area, *BITS, marks):
        return False
    marks[(area != 0) & (marks == 0)] |= np.uint16(connectivity.NOT_A_DISK)
    return True


def _matched(rows: Ints, nodes: int) -> Ints:
    """(4T,) the facet on the other side of each (kernels.topology.facets)."""
    twin = np.empty(4 * len(rows), dtype=np.int32)
    keys, numbers = np.empty(4 * len(rows), dtype=np.int64), np.empty(4 * len(rows), dtype=np.int32)
    facets.match(rows, np.zeros(nodes + 2, dtype=np.int64), keys, numbers, twin)
    return twin


def _part_volumes(
    points: Floats, rows: Ints, piece: Ints, orientation: NDArray[np.int8], parts: int
) -> tuple[Floats, Floats]:
    """The signed volume of each part, and the sum of the absolute ones, six times."""
    a, b, c = (points[rows[:, k], :3] - points[rows[:, 0], :3] for k in (1, 2, 3))
    volume = orientation * np.einsum("ij,ij->i", a, np.cross(b, c))
    signed, absolute = np.zeros(parts), np.zeros(parts)
    np.add.at(signed, piece, volume)
    np.add.at(absolute, piece, np.abs(volume))
    return signed, absolute
