"""Second-order cells of a plane with their places, as stages and untangling see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.curved.descend import guarded_sweep, improve_nodes, straighten, untangling_sweep
from gmsnet.kernels.curved.stars import CENTRE, NO_EDGE, CurvedMesh, dragged
from gmsnet.kernels.simplex.bernstein import KINDS, QUAD9
from gmsnet.kernels.simplex.jacobian import judge_cells, straight_signs
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.star.guard import LARGEST, Guard, MeshGuard, Precision
from gmsnet.measure.curved import judge_curved

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Signs = NDArray[np.int8]

LOW = 0.5  # a cell whose certified bound over its straight size is less gets more room


class PlanarCells(NamedTuple):
    """Nodes by places in memory.

    points: (N, 2) float64, C-contiguous; they and the stored offsets of the mesh change in place. free: corners,
    middles and centres that may move; those of the boundary must not be among them.
    """

    points: Floats
    mesh: CurvedMesh
    free: Flags
    precision: Precision = Precision()

    @property
    def names(self) -> tuple[str, ...]:
        """What the numbers in ``mesh.kinds`` stand for."""
        return KINDS

    @property
    def low(self) -> float:
        """A cell with a lower bound is to get more room."""
        return LOW

    @property
    def inner(self) -> Flags:
        """(N,) the middles and centres that may move by themselves: free ones, with a cell at each side."""
        mesh = self.mesh
        inner = np.zeros(len(self.free), dtype=bool)
        inner[mesh.edges[mesh.dragged, 2]] = True
        inner[mesh.cells[mesh.centre_dragged, CENTRE]] = True
        return self.free & inner

    @property
    def corner(self) -> Flags:
        """(N,) the corners that may move."""
        found: Flags = self.free & self.mesh.corner
        return found

    def judged(self) -> tuple[Signs, Floats]:
        """See ``judge_curved``."""
        return judge_curved(self.points, self.mesh.cells, self.mesh.kinds, self.precision)

    def signs(self, cells: Ints) -> Signs:
        """Of some cells, as far as float64 tells: 1 where they are certified valid."""
        sign, quality = np.zeros(len(cells), dtype=np.int8), np.empty(len(cells))
        table, kinds = self.mesh.cells[cells], self.mesh.kinds[cells]
        judge_cells(self.points, table, kinds, self.precision.unit, self.precision.grain, 0, len(cells), sign, quality)
        return sign

    def straight_signs(self, cells: Ints) -> Signs:
        """The same of the corners of straight cells."""
        sign, table = np.zeros(len(cells), dtype=np.int8), self.mesh.cells[cells]
        straight_signs(self.points, table, self.mesh.kinds[cells], *self.precision[:2], sign)
        return sign

    def offsets_at(self, nodes: Ints, cells: Ints) -> tuple[Ints, Ints]:
        """The numbers of what is kept of some middles, and of the centres of some cells."""
        edges = self.mesh.edge_of_middle[nodes]
        return edges[edges != NO_EDGE], cells[self.mesh.kinds[cells] == QUAD9]

    def offsets(self, at: tuple[Ints, Ints]) -> tuple[Floats, Floats]:
        """What is kept of these."""
        return self.mesh.ratio[at[0]], self.mesh.centre_ratio[at[1]]

    def keep(self, at: tuple[Ints, Ints], offsets: tuple[Floats, Floats]) -> None:
        """Keeps that of them."""
        self.mesh.ratio[at[0]], self.mesh.centre_ratio[at[1]] = offsets

    def go(self, nodes: Ints, places: Floats) -> None:
        """Puts corners at their places (K, 2) with what they drag along; nothing is judged."""
        dragged(self.points, self.mesh, nodes, places, self.precision.single)

    def straighten(self, nodes: Ints) -> None:
        """Puts middles and centres at their straight places."""
        straighten(self.points, self.mesh, nodes, self.precision.single)

    def untangling_sweep(self, nodes: Ints, threshold: float) -> int:
        """See kernels.curved.descend."""
        moved: int = untangling_sweep(self.points, self.mesh, nodes, threshold, self.precision.single)
        return moved

    def guarded_sweep(self, nodes: Ints, threshold: float, shape: float) -> int:
        """See kernels.curved.descend. shape: the least 1/q of straight cells around a corner that moves."""
        tally = np.zeros(3, dtype=np.int64)
        guarded_sweep(self.points, self.mesh, nodes, threshold, MeshGuard(*self.precision, shape * LARGEST), tally)
        return int(tally[MOVED])

    def improve(self, nodes: Ints, low: float, guard: Guard, tally: Ints) -> None:
        """Moves those of the nodes whose cells are low, by the guard; see kernels.curved.descend."""
        improve_nodes(self.points, self.mesh, nodes, low, guard, tally)
