"""The tetrahedra of a mesh in memory order, read so that all of a part are alike: what ``Volume`` is made of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.jacobian import has_form
from gmsnet.errors import InputError
from gmsnet.kernels.simplex import orientation3
from gmsnet.kernels.topology import connectivity, facets
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.parallel.threads import side_by_side
from gmsnet.topology.bins import Counts, in_bins
from gmsnet.topology.fans import Marks
from gmsnet.topology.ordering import memory_order, space_points, taken
from gmsnet.topology.polygons import Ints

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

SMOOTHED = ("tetra",)  # the kinds whose nodes may move
BITS = connectivity.BOUNDARY, connectivity.INTERFACE, connectivity.NON_MANIFOLD
OF_OTHER_CELLS = np.uint16(
    connectivity.LINE | connectivity.FACE | connectivity.UNSUPPORTED_CELL | connectivity.SECOND_ORDER
)
BYTES_PER_CELL = 190  # that the set-up takes at most


@dataclass(frozen=True, eq=False)
class Wound:
    """Tetrahedra that are read alike.

    cell: (T,) the index of each among all cells of the mesh; cells: (T, 4) their nodes, both in file order. By places
    in memory: rows (T, 4), orientation (T,) int8, −1 where the volume is to be taken with the other sign, region (T,),
    or none (0,) where all are the same; origin: the place in file order of each row. marks: (N,) uint16 by places in
    memory, why nodes are held, as far as facets tell. memory: (N,) node ids in memory order; position: the places.
    """

    cell: NDArray[np.int64]
    cells: Ints
    rows: Ints
    orientation: NDArray[np.int8]
    region: NDArray[np.int64]
    origin: Ints
    marks: Marks
    memory: Ints
    position: Ints

    @classmethod
    def of(cls, mesh: Mesh, fixed: Flags | None = None, threads: int = 1) -> Wound:
        """Of a mesh; ``fixed`` and errors: see ``Volume.of``. threads: one or two."""
        refuse_flat(mesh)
        count = sum(len(block.nodes) for block in mesh.cells if block.kind in SMOOTHED)
        refuse_unless_free(count * BYTES_PER_CELL, f"the connectivity of {count:,} tetrahedra")
        points = space_points(mesh)
        (memory, position), (cells, cell, region) = side_by_side(
            threads, partial(memory_order, points, mesh.box), partial(_tetrahedra, mesh)
        )
        origin, rows, used = _ordered(cells, position, threads)
        region = region.take(origin) if len(region) else region
        marks = _known_marks(mesh, fixed, position)
        orientation = _wound(taken(points, memory), rows, region, marks, threads)
        marks[~used & (marks & OF_OTHER_CELLS == 0)] |= np.uint16(connectivity.UNUSED)
        return cls(cell, cells, rows, orientation, region, origin, marks, memory, position)

    def bounded_at(self, nodes: Flags) -> Wound:
        """The same as a part of more cells, which has all of those at the nodes (N,) by id of their boundary."""
        inside = np.where(nodes[self.memory], np.uint16(0), np.uint16(connectivity.BOUNDARY))
        return replace(self, marks=self.marks & ~inside)

    @cached_property
    def outer(self) -> NDArray[np.int64]:
        """(F,) the facets of one cell alone, 4t + k (kernels.topology.facets)."""
        at_boundary = self.marks & np.uint16(connectivity.BOUNDARY) != 0
        near = np.flatnonzero(at_boundary[self.rows].sum(axis=1) >= 3)  # few: the others have none of these facets
        part = self.rows[near]
        alone = np.flatnonzero(_matched(part, len(self.marks)) == facets.ALONE)
        alone = alone[at_boundary[self._corners(part, alone)].all(axis=1)]  # others have a cell that is not near
        found: NDArray[np.int64] = 4 * near[alone >> 2] + (alone & 3)
        return found

    @property
    def boundary_cell(self) -> NDArray[np.int64]:
        """(F,) the cell of each facet of ``boundary``."""
        return self.outer >> 2

    @cached_property
    def boundary(self) -> Ints:
        """(F, 3) the nodes of these facets, counter-clockwise as seen from outside."""
        corners = self._corners(self.rows, self.outer)
        return np.where(self.orientation[self.outer >> 2, None] > 0, corners, corners[:, [0, 2, 1]])

    @staticmethod
    def _corners(rows: Ints, chosen: NDArray[np.int64]) -> Ints:
        """(K, 3) the nodes of some facets 4t + k of rows."""
        corners: Ints = np.take_along_axis(rows[chosen >> 2], facets.OPPOSITE[chosen & 3], axis=1)
        return corners


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


def _ordered(cells: Ints, position: Ints, threads: int) -> tuple[Ints, Ints, Flags]:
    """Cells by the lowest place of their nodes in memory, else as they are.

    Returns their numbers (T,) and their corners (T, 4) by places in memory, and (N,) which places have cells.
    """
    place, rows, used = np.empty_like(cells), np.empty_like(cells), np.zeros(len(position), dtype=np.bool_)
    origin = np.empty(len(cells), dtype=np.int32)

    def count(first: int, last: int, counts: Counts) -> None:
        facets.place_cells(cells, first, last, position, place, used, counts)

    def write(first: int, last: int, begin: Counts) -> None:
        facets.order_cells(place, first, last, begin, origin, rows)

    in_bins(len(cells), len(position), threads, count, write)
    return origin, rows, used


def mark_of(block: CellBlock) -> int:
    """Why the nodes of cells of other kinds are held."""
    if block.dimension not in (3, None):
        return connectivity.FACE if block.dimension == 2 else connectivity.LINE
    curved = has_form(block.kind) and block.cell.order > 1
    return connectivity.SECOND_ORDER if curved else connectivity.UNSUPPORTED_CELL


def _known_marks(mesh: Mesh, fixed: Flags | None, position: Ints) -> NDArray[np.uint16]:
    """(N,) by places in memory: of cells that are not smoothed, of faces and lines, and of chosen nodes."""
    marks = np.zeros(len(position), dtype=np.uint16)
    for block in mesh.cells:
        if block.kind not in SMOOTHED:
            marks[position[block.nodes.ravel()]] |= np.uint16(mark_of(block))
    if fixed is not None and fixed.any():
        marks[position[fixed]] |= np.uint16(connectivity.CHOSEN)
    return marks


def _wound(
    points: Floats, rows: Ints, region: NDArray[np.int64], marks: NDArray[np.uint16], threads: int
) -> NDArray[np.int8]:
    """The orientation of each cell; marks the nodes of the boundary, of interfaces and of what cannot be wound."""
    count = len(rows)
    (positive, negative), (area, meeting) = side_by_side(
        threads, partial(orientation3.count_signs, points, rows), partial(_enclosed, rows, region, len(marks))
    )
    if count in (positive, negative):
        orientation = np.full(count, 1 if positive == count else -1, dtype=np.int8)
        marks |= meeting
        if _marked_alike(rows, area, marks):
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


def _enclosed(rows: Ints, region: NDArray[np.int64], nodes: int) -> tuple[NDArray[np.uint64], NDArray[np.uint16]]:
    """(N,) 0 where the cells close around a node, if all have one orientation; and marks of where regions meet."""
    places, area = np.empty((nodes, 2), dtype=np.uint64), np.zeros(nodes, dtype=np.uint64)
    facets.scatter(places)
    own, meeting = np.empty(nodes if len(region) else 0, dtype=np.int64), np.zeros(nodes, dtype=np.uint16)
    facets.enclose(rows, region, places, area, own, meeting, connectivity.INTERFACE)
    return area, meeting


def _marked_alike(rows: Ints, area: NDArray[np.uint64], marks: NDArray[np.uint16]) -> bool:
    """The marks of facets where all cells have one orientation; False if some see a facet from the same side.

    Only the cells at nodes around which they do not close are looked at for facets. area: see ``_enclosed``.
    """
    outer = connectivity.touching(rows, area != 0)
    part, alike, whole = rows[outer], np.ones(len(outer), dtype=np.int8), np.empty(0, dtype=np.int64)
    if not facets.mark_facets(part, _matched(part, len(marks)), whole, alike, area, *BITS, marks):
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
