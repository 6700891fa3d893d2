"""How nodes inside follow a boundary that moves: each edge turns with its surroundings and keeps its length as it can.

Minimised is Σ w s |(y_j − y_i) − R (x_j − x_i)|² over the edges, R half way between the rotations at its two ends, and
w = 1/|x_j − x_i|²: relative changes count, so small cells near walls are the stiffest, and thin layers keep their
spacing. s is ten times as much in layers, where short edges among long ones have up to a hundred times more, so that
rows keep their heights where a wall is stretched; and falls slowly with the distance from what moves. Rotations of the
boundary are known; inside they are harmonic at first (Zayer, Rössl, Karni, Seidel: Harmonic guidance for surface
deformation, Computer Graphics Forum 24, 2005). Then places and best rotations follow each other by turns (Sorkine,
Alexa: As-rigid-as-possible surface modeling, Symposium on Geometry Processing, 2007). Motions of all boundaries as one
body are reproduced but for rounding, in space to ``ACCURATE``.

The systems are solved by factors in the plane. In space these would be too large, and conjugate gradients with
multigrid take their place. Where nodes of a plane slide, factors of the first system serve the later ones: of straight
lines they are the same, along curved ones conjugate gradients make up for the turning of the tangents.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
import scipy.sparse
import scipy.spatial
from numpy.typing import NDArray

from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.kernels.whole import multigrid
from gmsnet.kernels.whole.graph import Matrix
from gmsnet.methods.multigrid import Multigrid, approach
from gmsnet.motion.path import Flags, Floats, Ints
from gmsnet.motion.rails import Rails
from gmsnet.motion.rotations import rotations_in
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.untangle.harmonic import solver_of

Solve = Callable[..., Floats]

ITERATIONS, SMALL_TURN = 12, 1e-3  # radians
TINY, FLAT = 1e-300, 1e-28  # FLAT: of the longest edge's square; shorter edges count as that long
IN_LAYERS, SHORT = 10.0, 100.0  # times as stiff; times as much again, at most, are short edges among long ones
REACH = 0.5  # of the extent of what moves: at this distance from it edges are 1/√2 times as stiff
NOBODY, NOWHERE = np.empty(0, dtype=np.intp), np.empty((0, 0, 0))
ACCURATE, MOST = 1e-6, 60  # of the residual, where systems are solved step by step, and steps
STALE = 8  # steps: factors that need more are made anew


@dataclass(frozen=True, eq=False)
class Follower:
    """edges: (E, 2) of all cells with a free node, diagonals of quads too, by places in memory. free: (N,) bool.

    layers: (E,) those within layers and near refined walls. stiffness: (E,) beside what follows from all lengths.
    """

    edges: Ints
    free: Flags
    layers: Flags
    stiffness: Floats

    @classmethod
    def of(cls, topology: Topology | Volume, points: Floats, moving: Flags, kept: Flags) -> Follower:
        """Of the free nodes of a topology. points: (N, D). moving: (N,) held nodes that go elsewhere. kept: (N,) of
        layers."""
        rows, free = topology.near, topology.near_free
        rows = rows[free[rows].any(axis=1)]
        corners = rows.shape[1]
        edges = np.concatenate([rows[:, [i, j]] for i in range(corners) for j in range(i + 1, corners)])
        edges = np.sort(edges[free[edges].any(axis=1)], axis=1)
        key = sorted_unique(edges[:, 0].astype(np.int64) * len(free) + edges[:, 1])
        edges = np.column_stack(np.divmod(key, len(free))).astype(np.int32)
        layers = (kept | ~free)[edges].all(axis=1) & kept[edges].any(axis=1)
        bodies = points[moving if moving.any() else ~free]
        away, _ = scipy.spatial.cKDTree(bodies).query(points)
        reach = max(REACH * float(np.ptp(bodies, axis=0).max()), TINY)
        stiffness = 1.0 / np.sqrt(1.0 + away[edges].mean(axis=1) / reach)
        stiffness[layers] *= IN_LAYERS * _shortness(points, edges[layers])
        return cls(edges, free, layers, stiffness)

    def follow(
        self, points: Floats, attitude: Floats, ways: Floats, places: Floats, turns: Floats, since: Floats, sure: Flags,
        rails: Rails | None = None,
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """The points (N, D) when held nodes are at new places, and the attitudes of the surroundings of each node then.

        points, attitude: (N, D) and of each node, as they are now. ways: (E, D) along the edges, that are to be kept,
        as they were before any rotation. places, turns: (N, D) and (N, k) of held nodes. since: (N, k) by about how
        much they turn now. sure: (N,) where ``turns`` is known; of other held nodes it follows. rails: on which some of
        the free nodes slide.
        """
        a, b = self.edges.T
        count, free, rotations = len(points), self.free, rotations_in(points.shape[1])
        if not free.any():
            return places, rotations.turn(rotations.still(count), turns)
        square = (ways**2).sum(axis=1)
        weight = self.stiffness / np.maximum(square, max(FLAT * float(square.max()), TINY))
        matrix = scipy.sparse.csr_array((weight, (a, b)), shape=(count, count))
        matrix = (matrix + matrix.T).tocsr()
        rows = np.flatnonzero(free)
        inner = matrix[rows]
        diagonal = np.asarray(np.bincount(a, weight, count) + np.bincount(b, weight, count), dtype=np.float64)[rows]
        solve = _solver(inner[:, rows], diagonal, points.shape[1], rails)
        shift = np.where(free[:, None], 0.0, rotations.toward(attitude, turns, since))
        shift[rows] = solve(inner @ shift)
        attitude, refit = rotations.turn(attitude, shift), free | ~sure
        new = np.where(free[:, None], points, places)
        for iteration in range(ITERATIONS):
            pull = rotations.pulls(self.edges, weight, ways, attitude, new)[rows]
            if rails is None:
                new[rows] += solve(pull)
            else:
                new[rows] += solve(pull, np.searchsorted(rows, rails.nodes), rails.ways(new))
                rails.land(new)
            settled = rotations.fit(self.edges, weight, ways, new, refit, attitude) < SMALL_TURN
            if settled and iteration:  # the second one makes places exact that are solved for step by step
                break
        return new, attitude


def _shortness(points: Floats, edges: Ints) -> Floats:
    """(E,) the squared length of the longest edge at either end over that of each edge, ``SHORT`` at most."""
    square = np.maximum(((points[edges[:, 1]] - points[edges[:, 0]]) ** 2).sum(axis=1), TINY)
    longest = np.zeros(len(points))
    for end in range(2):
        np.maximum.at(longest, edges[:, end], square)
    found: Floats = np.minimum(longest[edges].max(axis=1) / square, SHORT)
    return found


class System:
    """A Laplacian of n nodes in D dimensions, some of which slide, solved by conjugate gradients with multigrid.

    Numbers stand in pairs of columns, (pairs · n, 2).
    """

    def __init__(self, joins: scipy.sparse.csr_array, diagonal: Floats) -> None:
        self.joins = joins = joins.tocsr()
        joins.sort_indices()
        self.matrix = Matrix(joins.indptr.astype(np.int64), joins.indices.astype(np.int32), joins.data, diagonal)
        self.cycle = Multigrid(self.matrix)
        self.factors: Factors | None = None

    def solve(self, right: Floats, rows: NDArray[np.intp] = NOBODY, ways: Floats = NOWHERE) -> Floats:
        """For right-hand sides (n, k). In some rows (K,) the solution is along ways (K, k, k), each a projection."""
        count, columns = right.shape
        pairs = -(-columns // 2)

        def parts(values: Floats) -> list[Floats]:
            return [values[count * k : count * (k + 1)] for k in range(pairs)]

        def projected(values: Floats) -> Floats:
            if len(rows):
                some = np.column_stack([part[rows] for part in parts(values)])
                some[:, :columns] = np.einsum("nij,nj->ni", ways, some[:, :columns])
                for k, part in enumerate(parts(values)):
                    part[rows] = some[:, 2 * k : 2 * k + 2]
            return values

        def times(values: Floats, out: Floats) -> None:
            for part, image in zip(parts(values), parts(out), strict=True):
                multigrid.times(self.matrix, part, image)
            projected(out)

        def cycles(values: Floats) -> Floats:
            return projected(np.concatenate([self.cycle(part) for part in parts(values)]))

        # what is held across and free along is not what cycles know
        inverse = self.along(rows, ways) if len(rows) and columns == 2 else cycles
        rest = np.zeros((count, 2 * pairs))
        rest[:, :columns] = right
        rest = projected(np.concatenate([rest[:, 2 * k : 2 * k + 2] for k in range(pairs)]))
        found, steps = np.zeros_like(rest), 0
        for x, left, all_of_it in islice(approach(times, inverse, rest), MOST):
            found, steps = x, steps + 1
            if left <= ACCURATE * ACCURATE * all_of_it:
                break
        if steps > STALE:
            self.factors = None
        return np.column_stack(parts(found))[:, :columns]

    def along(self, rows: NDArray[np.intp], ways: Floats) -> Callable[[Floats], Floats]:
        """About the inverse for right-hand sides (n, 2) in a plane that are along ways; exact for the first ones."""
        if self.factors is None:
            self.factors = Factors(self.joins, self.matrix.diagonal, rows, ways)
        return partial(self.factors.solve, self.factors.tangents(ways))


class Factors:
    """Of a Laplacian of n nodes in a plane, of which some, in ``rows`` (K,), go along lines.

    Their unknown is how far they go, so that there are 2 n − K.
    """

    def __init__(self, joins: scipy.sparse.csr_array, diagonal: Floats, rows: NDArray[np.intp], ways: Floats) -> None:
        count, self.rows = len(diagonal), rows
        slides = np.zeros(count, dtype=bool)
        slides[rows] = True
        ends = np.cumsum(np.where(slides, 1, 2))
        self.inner, self.last = np.flatnonzero(~slides), ends - 1
        longer = np.where((ways[:, 0, 0] > ways[:, 1, 1])[:, None], ways[:, :, 0], ways[:, :, 1])
        longer[~longer.any(axis=1)] = 1.0, 0.0  # a node that can go nowhere: ``tangents`` keeps it where it is
        self.first_tangents = longer / np.linalg.norm(longer, axis=1, keepdims=True)
        nodes = np.concatenate([self.inner, self.inner, rows, rows])
        axes = np.repeat([0, 1, 0, 1], [len(self.inner)] * 2 + [len(rows)] * 2)
        unknowns = np.concatenate([self.last[self.inner] - 1, self.last[self.inner], self.last[rows], self.last[rows]])
        parts = np.concatenate([np.ones(2 * len(self.inner)), self.first_tangents.T.ravel()])
        spread = scipy.sparse.csr_array((parts, (2 * nodes + axes, unknowns)), shape=(2 * count, ends[-1]))
        both = scipy.sparse.kron(scipy.sparse.diags_array(diagonal) - joins, scipy.sparse.eye_array(2), format="csr")
        matrix = (spread.T @ both @ spread).tocsc()
        matrix.eliminate_zeros()
        self.solve_reduced = solver_of(matrix)

    def tangents(self, ways: Floats) -> Floats:
        """(K, 2) unit vectors along ways (K, 2, 2), forward as the first ones were."""
        found = np.einsum("nij,nj->ni", ways, self.first_tangents)
        size = np.linalg.norm(found, axis=1, keepdims=True)
        return np.where(size > 0.0, found / np.maximum(size, TINY), 0.0)

    def solve(self, tangents: Floats, values: Floats) -> Floats:
        """(n, 2) to (n, 2), whose rows are along tangents (K, 2) where nodes slide."""
        right = np.empty(self.last[-1] + 1)
        right[self.last] = values[:, 1]
        right[self.last[self.inner] - 1] = values[self.inner, 0]
        right[self.last[self.rows]] = (tangents * values[self.rows]).sum(axis=1)
        solved = self.solve_reduced(right)
        out = np.column_stack([solved[self.last - 1], solved[self.last]])
        out[self.rows] = tangents * solved[self.last[self.rows], None]
        return out


def _solver(joins: scipy.sparse.csr_array, diagonal: Floats, dimension: int, rails: Rails | None) -> Solve:
    """Solves systems with a diagonal less what joins nodes; see ``System.solve``."""
    if dimension == 2 and rails is None:
        return solver_of(scipy.sparse.diags_array(diagonal, format="csc") - joins.tocsc())
    return System(joins, diagonal).solve
