"""Untangling meshes of tetrahedra, as a transaction.

Around the inverted cells, within as many rings of free nodes as it takes, sweeps with softened determinants bring all
cells to positive volumes. What is taken in the end keeps two promises: no cell that was positive is not so afterwards,
and none that stays inverted is worse than the worst was. Nodes of cells that break one go back to where they were.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from gmsnet.kernels.methods.barrier3 import Power3
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.kernels.untangle.space import soften
from gmsnet.measure.volumes import exact_signs3, look
from gmsnet.parallel.executor import Executor
from gmsnet.topology.volume import Volume
from gmsnet.untangle.reach import Reach
from gmsnet.untangle.result import ALL, CORNER_HELD, HELD, NOTHING, PART, StillInverted, Untangled, UntanglingStep

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

RINGS = (2, 6, 10**9)  # around the cells that are bad
SWEEPS = (30, 40, 60)  # at most
CLOSE = (0, 1, 2)  # rings, where some cells are left
LAST, FEW = (
    (1, 3, 9, 1, 3, 9),
    0.1,
)  # rings, before nodes go back, where at most this share of the inverted cells is left
EARLY, MANY = 2, 0.1  # after so many rounds, with so many of the cells bad still, another start is taken
SHRINK, FINEST = 0.6, 1e-4  # of ε from sweep to sweep, and of the median of |D| at last
HARMONIC, ITERATIONS = 1e-6, 2000


class Attempt:
    """A mesh on its way.

    points: as they are now; start: as they were. bad, inverted, ratio: of each cell, see ``find_bad``. reach: of which
    mesh this is a part.
    """

    start: Floats
    points: Floats
    bad: Flags
    inverted: Flags
    was_inverted: Flags
    topology: Volume
    precision: Precision
    ratio: NDArray[np.float64]
    left: int
    was: NDArray[np.float64]
    reach: Reach

    def __init__(
        self, points: Floats, topology: Volume, precision: Precision, executor: Executor, reach: Reach | None = None
    ) -> None:  # fmt: skip
        self.start, self.points, self.topology, self.precision = points, points.copy(), topology, precision
        self.executor, self.reach = executor, reach or Reach.whole(topology)
        count = len(topology.near)
        self.bad, self.inverted = np.empty((2, count), dtype=bool)
        self.ratio = np.empty(count)
        self.left = self.look()
        self.was_inverted, self.was = self.inverted.copy(), self.ratio.copy()

    def look(self) -> int:
        """Measures all cells; how many are bad."""
        self.left = look(self.points, self.topology.simplices, self.precision, self.bad, self.inverted, self.ratio)
        return self.left

    @property
    def moved(self) -> Flags:
        """(N,) which nodes are elsewhere than at first."""
        elsewhere: Flags = (self.points != self.start).any(axis=1)
        return elsewhere

    def around(self, rings: int) -> NDArray[np.int64]:
        """The free nodes within so many rings of the bad cells."""
        near, free = self.topology.near, self.topology.near_free
        chosen = np.zeros(len(free), dtype=bool)
        chosen[near[self.bad]] = True
        for _ in range(rings):
            before = np.count_nonzero(chosen)
            chosen[near[rows_at(near, chosen)]] = True
            if np.count_nonzero(chosen) == before:
                break
        self.reach.choose(chosen & free)
        return np.flatnonzero(chosen & free)

    def sweeps(self, rings: int, most: int) -> UntanglingStep:
        """Softened sweeps over the nodes around until no cell is bad, or ``most`` are made."""
        nodes = self.around(rings)
        stars, made = self.topology.stars_of(nodes), 0
        if not len(nodes):
            return UntanglingStep("softened sweeps", 0, 0, self.left)
        blocks, power = stars.blocks, Power3.of(-1)._replace(ratio=0.0)  # steps are not lengthened
        assert isinstance(blocks, SpaceBlocks)
        chosen = np.zeros(len(self.points), dtype=bool)
        chosen[nodes] = True
        rows = rows_at(self.topology.near, chosen)
        first = softness = float(np.median(np.abs(self._determinants(rows)))) or 1e-30

        def visit(begin: int, end: int) -> NDArray[np.int64]:
            soften(self.points, blocks, begin, end, softness, self.precision.single, power)
            return np.zeros(3, dtype=np.int64)

        while made < most and self.left:
            for colour in range(stars.colours):
                self.executor.map(visit, int(stars.first[colour]), int(stars.first[colour + 1]))
                self.executor.after_colour(colour, self.points)
            made += 1
            softness = max(SHRINK * softness, FINEST * first)
            self.look()
        return UntanglingStep("softened sweeps", len(nodes), made, self.left)

    def begin_anew(self) -> UntanglingStep:
        """Puts all free nodes to the mean of their neighbours, all at once: long folds are gone then.

        Conjugate gradients on the Laplacian of the edges, with the held nodes as they are.
        """
        self.reach.need_all()
        topology = self.topology
        free = np.flatnonzero(topology.near_free)
        number = np.full(len(self.points), -1)
        number[free] = np.arange(len(free))
        count = np.diff(topology.ring_start)[free]
        row = np.repeat(np.arange(len(free)), count)
        begin = np.repeat(topology.ring_start[free] - np.append(0, np.cumsum(count)[:-1]), count)
        other = topology.ring[begin + np.arange(len(row))]
        inner = number[other] >= 0
        laplacian = scipy.sparse.diags_array(count.astype(np.float64)) - scipy.sparse.csr_array(
            (np.ones(int(inner.sum())), (row[inner], number[other[inner]])), shape=(len(free), len(free))
        )
        jacobi = scipy.sparse.diags_array(1.0 / count)
        beside = self.points[other[~inner]]
        middle = beside.mean(axis=0) if len(beside) else np.zeros(4)  # else a mesh far from the origin loses its digits
        for axis in range(3):
            held = np.bincount(row[~inner], beside[:, axis] - middle[axis], minlength=len(free))
            found, _ = scipy.sparse.linalg.cg(laplacian, held, rtol=HARMONIC, maxiter=ITERATIONS, M=jacobi)
            found += middle[axis]
            self.points[free, axis] = np.float32(found) if self.precision.single else found
        self.look()
        return UntanglingStep("all nodes to the means of their neighbours", len(free), 1, self.left)

    def _determinants(self, rows: NDArray[np.int32]) -> Floats:
        near = self.topology.near[rows]
        a, b, c = (self.points[near[:, k], :3] - self.points[near[:, 0], :3] for k in (1, 2, 3))
        found: Floats = np.einsum("ij,ij->i", a, np.cross(b, c))
        return found

    def give_back(self) -> int:
        """Takes nodes back until both promises are kept; returns how many cells broke one at first.

        What was not certainly inverted counts as positive: it is to be certified, or to stay as it was.
        """
        worst, first = float(self.was.min(initial=np.inf)), 0
        while True:
            broken = self.bad & (~self.was_inverted | (self.ratio < np.minimum(self.was, worst)))
            back = np.zeros(len(self.points), dtype=bool)
            back[self.topology.near[broken]] = True
            back &= self.moved
            if not back.any():
                return first
            first = first or int(np.count_nonzero(broken))
            self.points[back] = self.start[back]
            self.look()


def rows_at(near: NDArray[np.int32], chosen: Flags) -> NDArray[np.int32]:
    """The rows of the cells (T, 4) that have a chosen node."""
    return np.flatnonzero(chosen[near].any(axis=1)).astype(np.int32)


def _from_the_means(attempt: Attempt) -> list[UntanglingStep]:
    """Once more from another start, for folds as long as the mesh; what was there stays where this does not help."""
    before, left = attempt.points.copy(), attempt.left
    steps = [attempt.begin_anew()]
    for rings, most in zip(RINGS, SWEEPS, strict=True):
        if attempt.left:
            steps.append(attempt.sweeps(rings, most))
    if attempt.left >= left:
        attempt.points[:] = before
        attempt.look()
    return steps


def _take_best(attempt: Attempt, places: list[Floats]) -> list[UntanglingStep]:
    """Takes those of the places on the way, or those as they are, at which the fewest cells are bad in the end; then
    tries once more close around what is left.

    Where some cells cannot be mended, what was done far around them would take all others back.
    """
    best, left, steps = attempt.points.copy(), attempt.left, list[UntanglingStep]()

    def settle() -> None:
        nonlocal best, left
        attempt.give_back()
        if attempt.left < left:
            best, left = attempt.points.copy(), attempt.left
        attempt.points[:] = best
        attempt.look()

    for points in places:
        attempt.points[:] = points
        attempt.look()
        settle()
    for rings in CLOSE:
        if attempt.left:
            steps.append(attempt.sweeps(rings, SWEEPS[0]))
            settle()
    return steps


def untangle_volume(
    points: Floats, topology: Volume, precision: Precision, executor: Executor, before: int | None = None,
    reach: Reach | None = None,
) -> Untangled:  # fmt: skip
    """Moves free nodes until no cell is inverted, or as few as can be; held nodes and what is far off keep their bits.

    points: (N, 4) by places in memory; not changed. before: how many are inverted, where that is known. reach: as
    ``untangle`` of cells in a plane.
    """
    attempt, places = Attempt(points, topology, precision, executor, reach), list[Floats]()
    before = _inverted(attempt, np.flatnonzero(attempt.bad)) if before is None else before
    steps: list[UntanglingStep] = []
    for rounds, (rings, most) in enumerate(zip(RINGS, SWEEPS, strict=True)):
        if not attempt.left or (rounds == EARLY and attempt.left > MANY * len(topology.near)):
            break
        steps.append(attempt.sweeps(rings, most))
        places.append(attempt.points.copy())
    if attempt.left and len(topology.free):
        steps += _from_the_means(attempt)
    for rings in LAST:
        if not 0 < attempt.left <= FEW * before:
            break
        steps.append(attempt.sweeps(rings, SWEEPS[-1]))
    broken = attempt.give_back()
    if attempt.left:
        steps += _take_best(attempt, places)
    tried, moved = any(step.nodes for step in steps), attempt.moved.any()
    why = f"{broken} cells that were positive, or better, would have been inverted" if broken else ""
    if not tried:
        why = "no inverted cell has a node that may move"
    elif not moved and not why:
        why = "no cell was untangled"
    taken = NOTHING if not moved else PART if attempt.left else ALL
    left = np.flatnonzero(attempt.bad)
    simplices, sweeps = topology.simplices, sum(step.sweeps for step in steps)
    corners = whole = topology.near[left]
    if simplices.solids is not None and simplices.cells is not None:
        whole = simplices.solids.nodes[simplices.cells[left]]
    fixed, corner = (np.all(~topology.near_free[nodes], axis=1) for nodes in (whole, corners))
    reasons = np.where(fixed, HELD, np.where(corner, CORNER_HELD, f"not untangled within {sweeps} sweeps"))
    unmended = tuple(
        StillInverted(int(row), reason, (float(x), float(y))) for row, reason, (x, y) in zip(
            left, reasons.tolist(),
            attempt.points[corners].mean(axis=1)[:, :2], strict=True,
        )
    )  # fmt: skip
    made = tuple(step for step in steps if step.nodes)
    return Untangled(attempt.points, before, _inverted(attempt, left), taken, why, made, unmended)


def _inverted(attempt: Attempt, bad: NDArray[np.int64]) -> int:
    """How many cells are, of those with these rows that are not certainly valid."""
    topology, cells = attempt.topology, attempt.topology.simplices.cells
    if cells is not None:  # exact signs of their corners do not tell
        return len(sorted_unique(cells[bad]))
    return int((exact_signs3(attempt.points, topology.near[bad], topology.near_orientation[bad]) <= 0).sum())
