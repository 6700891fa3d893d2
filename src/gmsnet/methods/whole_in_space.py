"""All free nodes of a volume at once, for the worst cells: conjugate gradients on powers of q^(3/2) over the mesh.

As in the plane (methods/whole_mesh.py): what one of the worst cells needs, its neighbours need, too, and no node alone
can give it. Preconditioned is by multigrid on the Laplacian that is the Hessian where volumes are held fixed. Nodes
that slide stay. It is a transaction: what comes out is taken if all cells are certified valid, and the least η
gains. What it costs in the mean comes back, but for a part, in the sweeps that follow, and is judged after these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio3 import WEIGHTS3, Tetrahedra
from gmsnet.kernels.star.block import MOVED
from gmsnet.kernels.whole import powers3
from gmsnet.kernels.whole.graph import Matrix
from gmsnet.measure.volumes import look
from gmsnet.methods.base import Field, Smoother, Tally
from gmsnet.methods.conjugate import minimise
from gmsnet.methods.multigrid import Multigrid
from gmsnet.methods.whole_mesh import CLOSE
from gmsnet.parallel.executor import Executor
from gmsnet.topology.mixed_volume import MixedVolume

Floats = NDArray[np.float64]
SMALL = 1e-12  # of the largest entry of a diagonal: no entry is smaller
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (3, 1))  # as the columns of WEIGHTS3


@dataclass(eq=False)
class Problem:
    """Σ(r/top)^p, r = q^(3/2) but for a factor, p = 2^doublings, as a function of the places of some nodes.

    simplices: those with such a node. moved: (n,) the nodes. number: (N,) their rows, −1 for others.
    """

    simplices: Tetrahedra
    moved: NDArray[np.intp]
    number: NDArray[np.int64]
    doublings: int
    top: float
    sliders: None = None
    cells: None = None

    @classmethod
    def of(cls, field: Field, doublings: int) -> Problem | None:
        """Of the free nodes; None where no simplex that they have is the worst of its cells, or one is not positive."""
        simplices, free = field.topology.changeable, field.topology.near_free.copy()
        assert isinstance(simplices, Tetrahedra)
        if field.constraint is not None:
            free[field.constraint.row >= 0] = False
        good = free[simplices.rows].any(axis=1)
        if not good.any():
            return None
        some, held = (_part(simplices, np.flatnonzero(rows)) for rows in (good, ~good))
        top, still = (powers3.largest(field.points, each.rows, each.orientation, each.shapes) for each in (some, held))
        if still >= top or not top < math.inf:
            return None
        moved = np.flatnonzero(free)
        number = np.full(len(free), -1)
        number[moved] = np.arange(len(moved))
        return cls(some, moved, number, doublings, top)

    def largest(self, points: Floats) -> float:
        """The largest r."""
        return float(powers3.largest(points, *self.simplices[:3]))

    def value(self, points: Floats, gradient: Floats) -> float:
        """See ``conjugate.Sum``."""
        return self._value(points, gradient)[0]

    def _value(self, points: Floats, gradient: Floats) -> tuple[float, Floats]:
        rows, orientation, shapes = self.simplices[:3]
        weights = np.empty(len(rows))
        total = powers3.powered(points, rows, orientation, shapes, self.top, self.doublings, gradient, weights)
        return float(total), weights

    def inverse(self, points: Floats) -> Callable[[Floats], Floats]:
        """See ``conjugate.Sum``."""
        import scipy.sparse  # it takes a tenth of a short run

        rows, _, shapes = self.simplices[:3]
        _, weights = self._value(points, np.empty_like(points))
        table = WEIGHTS3[np.zeros(len(rows), dtype=np.uint8) if shapes is None else shapes]
        share = (weights[:, None] * np.maximum(table, 0.0)).T.ravel()
        one, two = self.number[np.concatenate([rows[:, edge] for edge in EDGES])].T
        count = len(self.moved)
        ends, both = np.concatenate([one, two]), np.concatenate([share, share])
        diagonal = np.bincount(ends[ends >= 0], both[ends >= 0], count).astype(np.float64)
        diagonal += SMALL * diagonal.max()
        inner = (one >= 0) & (two >= 0) & (share > 0.0)
        joins = scipy.sparse.coo_array((share[inner], (one[inner], two[inner])), shape=(count, count)).tocsr()
        joins = (joins + joins.T).tocsr()
        joins.sort_indices()
        cycle = Multigrid(Matrix(joins.indptr.astype(np.int64), joins.indices.astype(np.int32), joins.data, diagonal))

        def apply(rest: Floats) -> Floats:
            last = np.column_stack([rest[:, 2], np.zeros(count)])
            return np.column_stack([cycle(np.ascontiguousarray(rest[:, :2])), cycle(last)[:, 0]])

        return apply


def _part(simplices: Tetrahedra, rows: NDArray[np.intp]) -> Tetrahedra:
    """Some of them, as simplices of no cells."""
    shapes = None if simplices.shapes is None else simplices.shapes[rows]
    return Tetrahedra(simplices.rows[rows], simplices.orientation[rows], shapes)


class WholeInSpace(Smoother):
    """One sweep moves all nodes. Not for the level STAR, whose floors such moves do not know.

    doublings: of the power of q^(3/2), tried in turn until something is taken.
    """

    doublings: Sequence[int]

    stops_when_idle = False

    def __init__(self, doublings: Sequence[int]) -> None:
        self.doublings = doublings

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        self.converged = True
        tally, before = np.zeros(3, dtype=np.int64), field.points.copy()
        whole = executor.gathered(field)  # on one process
        if executor.returned(field, whole, whole is not None and self._taken(whole)):
            field.floor.forget()
            if isinstance(field.topology, MixedVolume):
                field.topology.forget_slack()
            moved = (field.points != before).any(axis=1) & field.topology.near_free
            tally[MOVED] = executor.total(np.array(np.count_nonzero(moved)))
        return tally

    def _taken(self, field: Field) -> bool:
        """Whether nodes are where they were found to be better."""
        for doublings in self.doublings:
            problem = Problem.of(field, doublings)
            if problem is None:
                return False
            places = np.ascontiguousarray(field.points[:, :3])
            there = field.points.copy()
            there[:, :3] = minimise(problem, places, CLOSE)
            there = field.written(there)
            if _is_valid(there, field) and problem.largest(there) < problem.top:
                field.points[:] = there
                return True
        return False


def _is_valid(points: Floats, field: Field) -> bool:
    """Is each cell with a free node certified to be valid everywhere?"""
    simplices = field.topology.changeable
    assert isinstance(simplices, Tetrahedra)
    count = len(simplices.rows)
    bad, inverted = np.empty((2, count), dtype=bool)
    return look(points, simplices, field.precision, bad, inverted, np.empty(count)) == 0
