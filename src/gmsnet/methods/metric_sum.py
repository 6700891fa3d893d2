"""How far a mesh is from its metric, as a function of the places of its nodes: sums over the corner simplices.

E is the symmetric Dirichlet energy of each simplex against the unit simplex of the metric (kernels/metric/quality.py).
What depends on the place of the nodes through the metric is part of the gradient (Dobrev, Knupp, Kolev, Mittal, Tomov:
The target-matrix optimization paradigm for high-order meshes, SIAM Journal on Scientific Computing 41, 2019; Huang,
Russell: Adaptive moving mesh methods, Springer 2011).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.metric import nodes, places
from gmsnet.kernels.metric.nodes import Around, Term
from gmsnet.kernels.metric.places import Background
from gmsnet.kernels.metric.quality import energy, qualities
from gmsnet.kernels.untangle.cells import find_bad
from gmsnet.kernels.whole import graph
from gmsnet.kernels.whole.graph import Matrix
from gmsnet.methods.base import Field
from gmsnet.methods.multigrid import Multigrid
from gmsnet.methods.sliders import Sliders
from gmsnet.metric.conformity import oriented
from gmsnet.metric.field import Metric
from gmsnet.metric.tensors import tensors_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

SWEEPS, CREEPS = 20, 5e-3  # over single nodes, at most; a smaller share of the sum gained in one is the end


@dataclass(eq=False)
class Problem:
    """ΣE, or Σ(E/top)^p, p = 2^doublings, as a function of the places of some nodes. See ``conjugate.Sum``.

    table: (S, 3) weights of edges, None where all are 1. number: (N,) the rows of the nodes that move, −1 of others.
    sliders: those of them that slide.
    background: the metric between nodes; start: (N,) where each node was in it. logs, slopes: of the metric at the
    nodes. floor: of 1/E, 0 for none. still: are the slopes taken as 0?
    """

    cells: NDArray[np.int32]
    table: Floats | None
    moved: NDArray[np.intp]
    number: NDArray[np.int32]
    matrix: Matrix
    background: Background
    start: NDArray[np.int32]
    logs: Floats
    slopes: Floats
    floor: float = 0.0
    doublings: int = 0
    top: float = 1.0
    sliders: Sliders | None = None
    still: bool = False

    @classmethod
    def of(cls, field: Field, metric: Metric, free: NDArray[np.bool_]) -> Problem:
        """Of the nodes (N,) that are free and have no simplex that is not certified positive."""
        simplices, free = field.planar.changeable, free.copy()
        precision, count = field.precision, len(simplices.rows)
        bad, every = np.empty(count, dtype=bool), np.ones(count, dtype=bool)
        if find_bad(field.points, field.points, simplices, every, precision.unit, precision.grain, bad):
            free[simplices.rows[bad]] = False
        cells, table = oriented(simplices)
        good = free[cells].any(axis=1)
        cells, table = cells[good], None if table is None else table[good]
        moved = np.flatnonzero(free)
        number = np.full(len(free), -1, dtype=np.int32)
        number[moved] = np.arange(len(moved), dtype=np.int32)
        start, column = graph.neighbours(cells, table, number, len(moved))
        matrix = Matrix(start, column, np.empty(len(column)), np.empty(len(moved)))
        background = metric.background(field.points)
        logs, slopes = np.empty((len(free), 3)), np.empty((len(free), 3, 2))
        problem = cls(cells, table, moved, number, matrix, background, metric.first.copy(), logs, slopes)
        places.evaluate(background, field.points, problem.start, logs, slopes)
        slopes[~free] = 0.0
        problem.sliders = Sliders.of(field, free)
        return problem

    def look(self, points: Floats) -> None:
        """Takes the metric from where the nodes are now."""
        places.evaluate_some(self.background, points, self.moved, self.start, self.logs, self.slopes)
        if self.still:
            self.slopes[self.moved] = 0.0

    def least(self, points: Floats) -> float:
        """The least 1/E of these simplices."""
        self.look(points)
        values = np.empty(len(self.cells))
        qualities(points, self.cells, self.table, self.logs, values)
        return float(values.min(initial=1.0))

    def swept(self, points: Floats) -> Floats:
        """Where sweeps over single nodes lead from points (N, 2), as long as they gain much; no node may slide."""
        points, awake = points.copy(), np.ones(len(points), dtype=bool)
        total, _ = self._value(points, np.empty_like(points))
        star = Around(self.cells, self.table, *nodes.around(self.cells, self.number, len(self.moved)))
        term = Term(self.floor, self.doublings, self.top)
        for _ in range(SWEEPS):
            fallen: float = nodes.sweep(
                points, self.moved, star, term, self.background, self.start, self.logs, self.slopes, awake
            )
            if not fallen > CREEPS * total:
                break
            total -= fallen
        return points

    def value(self, points: Floats, gradient: Floats) -> float:
        """See ``conjugate.Sum``."""
        total = self._value(points, gradient)[0]
        if self.sliders is not None and total < math.inf:  # else there is no gradient
            self.sliders.along(gradient, self.sliders.nodes)
        return total

    def _value(self, points: Floats, gradient: Floats) -> tuple[float, Floats]:
        share = np.empty(len(self.cells))
        self.look(points)
        total: float = energy(
            points,
            self.cells,
            self.table,
            self.logs,
            self.slopes,
            self.floor,
            self.doublings,
            self.top,
            gradient,
            share,
        )
        return total, share

    def inverse(self, points: Floats) -> Callable[[Floats], Floats]:
        """Multigrid on the Laplacian of the mesh in the metric, each node in the frame of its own tensor."""
        _, share = self._value(points, np.empty_like(points))
        table = np.repeat(share[:, None], 3, axis=1) if self.table is None else share[:, None] * self.table
        graph.assemble(points, self.cells, table, self.number, True, self.matrix)
        cycle = Multigrid(self.matrix)
        a, b, c = tensors_of(self.logs[self.moved] * np.array([0.0, -0.5, -0.5])).T

        def apply(residual: Floats) -> Floats:
            x, y = residual.T
            inner = cycle(np.column_stack([a * x + b * y, b * x + c * y]))
            x, y = inner.T
            found = np.column_stack([a * x + b * y, b * x + c * y])
            return found if sliders is None else sliders.along(found, self.number[sliders.nodes])

        sliders = self.sliders
        return apply
