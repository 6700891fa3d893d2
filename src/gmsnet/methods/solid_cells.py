"""Second-order volumes with their places, as stages and untangling see them: see methods.planar_cells."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.commit3 import judge_curved_solids, refused, straight_signs3
from gmsnet.kernels.curved.descend3 import guarded_sweep3, improve_nodes3, straighten3, untangling_sweep3
from gmsnet.kernels.curved.raise3 import raise_nodes3
from gmsnet.kernels.curved.stars3 import NO_FOLLOWER, CurvedSolids, put_all
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import Guard, MeshGuard, Precision
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.solid import exact_signs_of
from gmsnet.methods.floor import floor_of
from gmsnet.topology.curved_solids import CURVED

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Signs = NDArray[np.int8]

LOW = 0.5  # a cell whose certified bound over its straight cell's least determinant is less gets more room
HALVINGS, ROUNDS = 5, 12  # of the way of a corner, before it stays; after so many rounds it stays at once


class SolidCells(NamedTuple):
    """Nodes by places in memory. points: (N, 4); see PlanarCells."""

    points: Floats
    mesh: CurvedSolids
    free: Flags
    precision: Precision = Precision()

    @property
    def names(self) -> tuple[str, ...]:
        """What the numbers in ``mesh.kinds`` stand for."""
        return CURVED

    @property
    def low(self) -> float:
        """A cell with a lower bound is to get more room."""
        return LOW

    @property
    def inner(self) -> Flags:
        """(N,) the nodes on edges, in faces and in cells that may move by themselves."""
        found: Flags = self.free & (self.mesh.number != NO_FOLLOWER)
        return found

    @property
    def corner(self) -> Flags:
        """(N,) the corners that may move."""
        found: Flags = self.free & (self.mesh.number == NO_FOLLOWER) & (np.diff(self.mesh.cell_start) > 0)
        return found

    def _judged(self, cells: Ints, enough: float) -> tuple[Signs, Floats]:
        sign, quality = np.zeros(len(cells), dtype=np.int8), np.empty(len(cells))
        unit, grain = self.precision.unit, self.precision.grain
        judge_curved_solids(self.points, self.mesh, cells, unit, grain, enough, sign, quality)
        return sign, quality

    def judged(self) -> tuple[Signs, Floats]:
        """The sign of det J in each cell, exact where floats do not tell, and its ``quality3``.

        The bound is sharp where it is ``low``.
        """
        sign, quality = self._judged(np.arange(len(self.mesh.cells)), self.low)
        for kind, form in enumerate(self.mesh.forms):
            rows = np.flatnonzero((sign == 0) & (self.mesh.kinds == kind))
            if len(rows):
                nodes = self.points[self.mesh.cells[rows, : form.nodes], :3]
                sign[rows], _ = exact_signs_of(nodes, form, np.ones(len(rows), dtype=np.int8))
        return sign, quality

    def signs(self, cells: Ints) -> Signs:
        """Of some cells, as far as float64 tells: 1 where they are certified valid."""
        return self._judged(cells, -math.inf)[0]

    def straight_signs(self, cells: Ints) -> Signs:
        """The same of the corners of straight cells."""
        sign = np.zeros(len(cells), dtype=np.int8)
        straight_signs3(self.points, self.mesh, cells, self.precision.unit, self.precision.grain, sign)
        return sign

    def offsets_at(self, nodes: Ints, cells: Ints) -> Ints:
        """The numbers of what is kept of some nodes that are no corners."""
        return np.asarray(self.mesh.number[nodes], dtype=np.int64)

    def offsets(self, at: Ints) -> Floats:
        """What is kept of these."""
        return self.mesh.kept[at]

    def keep(self, at: Ints, offsets: Floats) -> None:
        """Keeps that of them."""
        self.mesh.kept[at] = offsets

    def go(self, nodes: Ints, places: Floats) -> None:
        """Puts corners at their places (K, 3 or more) with what follows them; nothing is judged."""
        put_all(self.points, self.points.copy(), self.mesh, nodes, places[:, :3], self.precision.single)

    def straighten(self, nodes: Ints) -> None:
        """Puts nodes that are no corners at their straight places."""
        straighten3(self.points, self.mesh, nodes, self.precision.single)

    def untangling_sweep(self, nodes: Ints, threshold: float) -> int:
        """See kernels.curved.descend3."""
        moved: int = untangling_sweep3(self.points, self.mesh, nodes, threshold, self.precision.single)
        return moved

    def guarded_sweep(self, nodes: Ints, threshold: float, shape: float) -> int:
        """See kernels.curved.descend3. shape: the least η of straight cells around a corner that moves."""
        tally, guard = np.zeros(3, dtype=np.int64), MeshGuard(*self.precision, floor_of(shape))
        guarded_sweep3(self.points, self.mesh, nodes, threshold, guard, tally)
        return int(tally[MOVED])

    def improve(self, nodes: Ints, low: float, guard: Guard, tally: Ints) -> None:
        """Moves those of the nodes whose cells are low, by the guard; see kernels.curved.descend3."""
        _, quality = self._judged(np.arange(len(self.mesh.cells)), low)
        near = np.zeros(len(self.points) + 1, dtype=bool)
        near[self.mesh.cells[quality < low]] = True
        improve_nodes3(self.points, self.mesh, nodes[near[nodes]], low, guard, tally)

    def bounds(self, cells: Ints, enough: float) -> Floats:
        """The ``quality3`` of some cells, sharp where it is less than ``enough``."""
        return self._judged(cells, enough)[1]

    def raise_bounds(self, cells: Ints, threshold: float, room: float, guard: Guard, tally: Ints) -> None:
        """Moves nodes of some cells that are no corners; see kernels.curved.raise3."""
        near = np.zeros(len(self.points) + 1, dtype=bool)
        near[self.mesh.cells[cells]] = True
        raise_nodes3(self.points, self.mesh, np.flatnonzero(near[:-1] & self.inner), threshold, room, guard, tally)

    def around(self, nodes: Ints) -> Ints:
        """The cells that have some of the nodes."""
        chosen = np.zeros(len(self.points) + 1, dtype=bool)
        chosen[nodes] = True
        return np.flatnonzero(chosen[self.mesh.cells].any(axis=1))

    def advance(self, places: Floats, guard: Guard, room: float, valid: Flags) -> Ints:
        """Takes the corners to their places (N, 3 or more) together, with what follows them; returns which have moved.

        A cell of a corner that moves is valid afterwards, with a ``quality3`` of ``room`` or more, and its
        corners are certified above the guard's floor. Where one would not be, its corners go half of the way, and so
        on. Those of cells that are not valid to begin with stay. valid: (C,) which cells are, straight ones apart.
        """
        start, share = self.points.copy(), np.zeros(len(self.points))
        share[self.corner & (places[:, :3] != start[:, :3]).any(axis=1)] = 1.0
        cells = self.around(np.flatnonzero(share))
        share[self._corners(cells[~valid[cells] | (self.straight_signs(cells) != 1)])] = 0.0
        nodes, rounds = np.flatnonzero(share), 0
        while len(nodes):
            part = share[nodes, None]
            targets = start[nodes, :3] + part * (places[nodes, :3] - start[nodes, :3])
            targets = np.where(part == 1.0, places[nodes, :3], np.where(part == 0.0, start[nodes, :3], targets))
            put_all(self.points, start, self.mesh, nodes, targets, self.precision.single)
            cells = self.around(nodes)
            nodes = self._corners(cells[self._refused(cells, guard, room)])
            nodes = nodes[share[nodes] > 0.0]
            rounds += 1
            share[nodes] *= 0.5 if rounds < ROUNDS else 0.0
            share[nodes[share[nodes] < 0.5**HALVINGS]] = 0.0
        return np.flatnonzero(share)

    def _refused(self, cells: Ints, guard: Guard, room: float) -> Flags:
        found = np.empty(len(cells), dtype=bool)
        refused(self.points, self.mesh, cells, guard, room, found)
        return found

    def _corners(self, cells: Ints) -> Ints:
        """The corners of some cells."""
        nodes, kinds = self.mesh.cells[cells, :8], self.mesh.kinds[cells]
        found: Ints = sorted_unique(nodes[np.arange(8) < self.mesh.corners[kinds][:, None]]).astype(np.int64)
        return found
