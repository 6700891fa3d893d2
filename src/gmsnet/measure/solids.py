"""The volume cells of a mesh of any kinds as they are when they are measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.jacobian import form_of, has_form
from gmsnet.cells.table import CELLS
from gmsnet.kernels.simplex.validity3 import INVALID, UNDECIDED, corners_of_solids, lower_bounds, volumes_of_solids
from gmsnet.measure.corners import of_corners, straight_size
from gmsnet.measure.solid import judge_volumes
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import exponent_of
from gmsnet.topology.curved_solids import has_curved, straight
from gmsnet.topology.mixed_volume import wound_of
from gmsnet.topology.ordering import space_points

Floats = NDArray[np.float64]
Signs = NDArray[np.int8]

PLURAL = {4: "tetrahedra", 5: "pyramids", 6: "wedges", 8: "hexahedra"}  # by corners


@dataclass(frozen=True, eq=False)
class Solids:
    """The cells of one kind. nodes: (C, n). number: (C,) of each among all cells of the mesh, rising. orientation:
    (C,) int8, −1 for cells that are read inside out."""

    kind: str
    nodes: NDArray[np.int32]
    number: NDArray[np.int64]
    orientation: Signs


@dataclass(frozen=True, eq=False)
class MeasuredSolids:
    """See the module. Nothing of it changes afterwards.

    points: (N, 3), read-only. single: as of the Mesh. blocks: the cells. order: (C,) the rows of the blocks, one after
    the other, in the order of their numbers; None where that is their own.
    """

    points: Floats
    single: bool
    blocks: tuple[Solids, ...]
    order: NDArray[np.intp] | None = None

    names: tuple[str, ...] = ("min_dihedral", "max_dihedral", "shape", "scaled_jacobian", "volume")  # of the columns
    symbol = "η"  # of the shape
    plane = None

    @classmethod
    def of(cls, mesh: Mesh) -> tuple[MeasuredSolids, NDArray[np.int64]]:
        """Those of a mesh, and the index of each among all its cells.

        Cells are wound alike with those that they share the corners of facets with; those that name a corner twice are
        read inside out where most of their kind, with straight edges, have a negative size.
        """
        blocks, before = [], 0
        points, wound = space_points(mesh), _wound(mesh)
        for block in mesh.cells:
            if has_form(block.kind) and len(block.nodes):
                nodes = block.nodes.astype(np.int32)
                size = straight_size(points, nodes, CELLS[block.kind])
                most = -1 if int((size < 0.0).sum()) > int((size > 0.0).sum()) else 1
                known = wound[before : before + len(nodes)]
                orientation = np.where(known == 0, np.int8(most), known)
                blocks.append(Solids(block.kind, nodes, np.arange(before, before + len(nodes)), orientation))
            before += len(block.nodes)
        return cls._of(mesh, blocks)

    @classmethod
    def of_table(
        cls, mesh: Mesh, nodes: NDArray[np.int32], kind: NDArray[Any], kinds: Sequence[str], number: NDArray[np.int64],
        orientation: Signs,
    ) -> tuple[MeasuredSolids, NDArray[np.int64]]:  # fmt: skip
        """The same of cells (C, 8 or so) of kinds[kind[c]] that are wound already; further columns are not looked at.

        mesh: its points are used. number: (C,), rising.
        """
        blocks = []
        for k, name in enumerate(kinds):
            chosen = np.flatnonzero(kind == k)
            if len(chosen):
                few = np.ascontiguousarray(nodes[chosen, : form_of(name).nodes])
                blocks.append(Solids(name, few, number[chosen], orientation[chosen]))
        return cls._of(mesh, blocks)

    @classmethod
    def _of(cls, mesh: Mesh, blocks: list[Solids]) -> tuple[MeasuredSolids, NDArray[np.int64]]:
        number = np.concatenate([np.empty(0, dtype=np.int64), *(block.number for block in blocks)])
        order = None if (np.diff(number) > 0).all() else np.argsort(number)
        made = cls(mesh.points, mesh.single, tuple(blocks), order)
        return made, number if order is None else number[order]

    def in_order(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the blocks, one after the other along the last axis, in the order of the cells' numbers."""
        return values if self.order is None else values[..., self.order]

    @property
    def counts(self) -> dict[str, int]:
        """How many cells of which kind."""
        found: dict[str, int] = {}
        for block in self.blocks:
            name = PLURAL[CELLS[block.kind].corners or 0]
            found[name] = found.get(name, 0) + len(block.nodes)
        return found

    @property
    def turned(self) -> dict[str, NDArray[np.int64]]:
        """Kind → the numbers of the cells that are read inside out."""
        found: dict[str, list[NDArray[np.int64]]] = {}
        for block in self.blocks:
            if (block.orientation < 0).any():
                found.setdefault(block.kind, []).append(block.number[block.orientation < 0])
        return {kind: np.sort(np.concatenate(numbers)) for kind, numbers in found.items()}

    def at_corners(self, block: Solids) -> Floats:
        """(C, corners) det J at the corners of some cells, in units of their own; of pyramids at those of the base."""
        form = form_of(block.kind)
        values = np.empty((len(block.nodes), form.corners))
        corners_of_solids(space_points(self), block.nodes, form, block.orientation, values)
        return values

    @cached_property
    def exponent(self) -> int:
        """See ``exponent_of``."""
        return exponent_of(self.points, None, self.single)

    def columns(self, rows: NDArray[np.int32] | None = None) -> Floats:
        """Smallest and largest dihedral angle in degrees, η of the worst corner, Verdict's scaled Jacobian and volume
        of each: (5, C), or of some. Cells of second order have the first four of their corners."""
        found = np.empty((5, sum(len(block.nodes) for block in self.blocks)))
        points, first = space_points(self), 0
        for block in self.blocks:
            last = first + len(block.nodes)
            found[:4, first:last] = of_corners(points, block.nodes, CELLS[block.kind], block.orientation)
            volumes_of_solids(points, block.nodes, form_of(block.kind), found[4, first:last])
            found[4, first:last] *= block.orientation
            first = last
        with np.errstate(over="ignore", under="ignore"):  # a volume can be beyond the range where coordinates are not
            found[4] = np.ldexp(found[4], 3 * self.exponent)
        found = self.in_order(found)
        return found if rows is None else found[:, rows]

    @cached_property
    def judged(self) -> tuple[Signs, Floats]:
        """(C,) VALID, INVALID or UNDECIDED, and (C, 3) where in the reference cell; see ``judge_volumes``."""
        points = space_points(self)
        found = [judge_volumes(points, block.nodes, block.kind, block.orientation) for block in self.blocks]
        if not found:
            return np.empty(0, dtype=np.int8), np.empty((0, 3))
        sign, place = (np.concatenate(each) for each in zip(*found, strict=True))
        return self.in_order(sign), self.in_order(place.T).T

    def signs(self) -> Signs:
        """(C,) 1 where det J is positive everywhere in a cell, −1 where it is not, 0 where that is undecided."""
        return self.judged[0]

    @property
    def undecided(self) -> int:
        """How many cells are neither valid nor invalid for certain."""
        return int((self.judged[0] == UNDECIDED).sum())

    @cached_property
    def invalid_inside(self) -> NDArray[np.int64]:
        """The rows of the cells that are invalid although det J is positive at all corners."""
        sign, place = self.judged
        rows = np.flatnonzero(sign == INVALID)
        at_corner = np.isin(place[rows], (0.0, 1.0)).all(axis=1)
        inside: NDArray[np.int64] = rows[~at_corner]
        return inside

    def curved_bounds(self) -> Floats:
        """(K,) of the cells of second order: the lower bound of det J over its mean in size; 1 if it is constant."""
        found, points = [np.empty(0)], space_points(self)
        for block in self.blocks:
            if CELLS[block.kind].order > 1:
                form, orientation, count = form_of(block.kind), block.orientation, len(block.nodes)
                lower, volume = np.empty(count), np.empty(count)
                lower_bounds(points, block.nodes, form, orientation, 0.0, 0.0, 0, count, lower)
                volumes_of_solids(points, block.nodes, form, volume)
                mean = np.abs(volume) / form.volume
                found.append(np.where(mean > 0.0, lower / np.maximum(mean, 1e-300), -np.inf))
        return np.concatenate(found)  # in any order

    def centres(self) -> Floats:
        """(C, 3) the mean of the corners of each."""
        found = [np.empty((0, 3))]
        for block in self.blocks:
            corners = CELLS[block.kind].corners or 1
            found.append((self.points / corners)[block.nodes[:, :corners]].sum(axis=1))
        return self.in_order(np.concatenate(found).T).T


def _wound(mesh: Mesh) -> Signs:
    """The orientation of each cell of a mesh, 0 for those that are not wound."""
    found = np.zeros(sum(len(block.nodes) for block in mesh.cells), dtype=np.int8)
    curved = has_curved(mesh)
    if curved or mesh.has_solids:
        wound = wound_of(straight(mesh) if curved else mesh)
        found[wound.cell[wound.origin]] = wound.orientation
    return found
