"""GETMe, the geometric element transformation method. The formulas stand in kernels/methods/getme_elements.py.

The paper runs the sequential variant with θ = π/3, λ = 0, ρ = 1. The book's setting for triangles is θ = π/4, λ = ½;
with ρ = 0.01 in the sequential variant, where the worst elements' neighbours are easily broken, and with ρ = 1 and
η = 0 in the simultaneous one (with ρ = 0.01 a hundred sweeps of it end at a mean 1/q of 0.78 instead of 0.89 on random
squares). The simultaneous variant with the paper's θ and λ is not in the paper: η = 2 was chosen for it among 0 to 3,
which raises q̂ by 0.05 to 0.1 over η = 0 and costs 0.01 of the mean 1/q; with the book's θ and λ, which transform more
at once, η = 2 lowers q̂.

Tetrahedra have the simultaneous variant (kernels/methods/getme3.py), with σ = ½ and weights (1 − η)². Of σ = ½, 1, 2
and 4 and the powers 0 to 3 that ends with the best worst cell by far: after thirty sweeps of a random cube at a least η
of 0.051 and a mean of 0.724, with the power 0 at 0.015 and 0.738.

Hexahedra, wedges, pyramids and tetrahedra beside them have it, too (kernels/methods/getme_solids.py), with the weights
1 − η: of the powers 0 to 3 that ends a paved block at a least η of 0.588, and the others at 0.515, 0.566 and 0.455.

Quads have a θ and a λ of their own in all variants: π/4 and ½. The paper knows triangles alone, and with its setting no
quad becomes a square.

The book lowers the penalty of an element that was transformed. What the paper's rows would be had it been raised is
measured by ``benchmarks/getme_penalties.py``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells import table
from gmsnet.cells.dual import facets_around, regularising
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import getme as kernels
from gmsnet.kernels.methods import getme3, getme_simultaneous, getme_solids
from gmsnet.kernels.methods.getme import Queue
from gmsnet.kernels.methods.getme_elements import Elements, Transformation
from gmsnet.kernels.methods.getme_solids import NONE, Duals
from gmsnet.kernels.simplex.mean_ratio2 import SQUARE, Simplices
from gmsnet.kernels.star.block import MOVED, Blocks
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.methods.base import ALL_CELLS, CELLS, Field, Method, MethodOptions, Smoother, Tally, by_colour, over_stars
from gmsnet.parallel.executor import Executor
from gmsnet.topology.solids import KINDS, tables
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

SIGMA, POWER = 0.5, 2  # of tetrahedra: how far nodes go, in roots of faces, and the power of their weights
SIGMA_OF_SOLIDS, POWER_OF_SOLIDS = 1.0, 1  # of hexahedra and tetrahedra beside them; other kinds have a σ of their own
PERIOD = 100  # steps between tests
PERIODS = 10  # of a sweep, at maximum: on large meshes a test after each hundred steps would be most of the work
PATIENCE = 20  # tests without gain after which it has settled

TRANSFORMATIONS = {  # θ, λ, ρ, η
    "sequential": Transformation.of(math.pi / 3.0, 0.0, 1.0),
    "simultaneous": Transformation.of(math.pi / 3.0, 0.0, 1.0, 2),
    "sequential-book": Transformation.of(math.pi / 4.0, 0.5, 0.01),
    "simultaneous-book": Transformation.of(math.pi / 4.0, 0.5, 1.0),
}


class SequentialGetme(Smoother):
    """The worst element first.

    A sweep makes as many steps as there are free nodes, rounded to whole periods between tests, one at least. A period
    is PERIOD steps, or the PERIODS-th part of a sweep if that is more. A sweep in which every element was put back goes
    on, for penalties have changed, until a node moves or the method has settled.
    """

    converged: bool
    without_gain: int

    def __init__(self, transformation: Transformation) -> None:
        self.transformation = transformation
        self.converged = False
        self.without_gain = 0
        self.state: tuple[Elements, Queue] | None = None

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother. The steps depend on each other, so that they are made on one thread."""
        if self.state is None:
            elements = elements_of(field.planar)
            self.state = elements, queue_of(field.points, elements)
        elements, queue = self.state
        nodes, tally = len(field.topology.free), np.zeros(3, dtype=np.int64)
        period = max(PERIOD, nodes // PERIODS)
        left = max(1, round(nodes / period))
        while not self.converged and (left > 0 or tally[MOVED] == 0):
            kernels.steps(field.points, elements, queue, self.transformation, field.guard(executor), period, tally)
            self.without_gain = 0 if test() else self.without_gain + 1
            self.converged = self.without_gain == PATIENCE
            left -= 1
        return tally


class SimultaneousGetme(Smoother):
    """All elements at once; then the guard moves the nodes, colour by colour."""

    shared_out = True

    def __init__(self, transformation: Transformation) -> None:
        self.transformation = transformation

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        if isinstance(field.topology, Volume):
            return _in_space(field, executor)
        stars, guard = field.topology.stars, field.guard(executor)
        points, blocks = field.points, stars.blocks
        assert isinstance(blocks, Blocks)
        shifts = np.empty((len(blocks.filled), 2 * LANES))

        def plan(first: int, last: int) -> None:
            getme_simultaneous.plan(points, blocks, first, last, self.transformation, shifts)

        def carry_out(first: int, last: int) -> Tally:
            counts = np.zeros(3, dtype=np.int64)
            getme_simultaneous.carry_out(points, blocks, first, last, guard, shifts, counts)
            return counts

        executor.map(plan, 0, len(shifts))
        return by_colour(executor, carry_out, stars, points)


def _in_space(field: Field, executor: Executor) -> Tally:
    """One sweep over volumes."""
    stars, guard, points = field.topology.stars, field.guard(executor), field.points
    blocks = stars.blocks
    assert isinstance(blocks, SpaceBlocks)
    shifts = np.zeros((len(blocks.centre), 3))

    def plan(first: int, last: int) -> None:
        if blocks.mixture is None:
            getme3.plan(points, blocks, first, last, SIGMA, POWER, shifts)
        else:
            getme_solids.plan(points, blocks, first, last, duals(), POWER_OF_SOLIDS, shifts)

    def carry_out(blocks: SpaceBlocks, first: int, last: int, counts: Tally) -> None:
        getme3.carry_out(points, blocks, first, last, guard, shifts, counts)

    executor.map(plan, 0, len(blocks.filled))
    tally = over_stars(carry_out, stars, points, executor)
    field.floor.swept(tally)
    return tally


@cache
def duals() -> Duals:
    """The facets of the kinds of volumes, as getme_solids reads them."""
    kinds, known = [table.CELLS[name] for name in KINDS], tables()
    around = np.full((len(KINDS), 8, 4), NONE, dtype=np.int32)
    for number, kind in enumerate(kinds):
        for corner, facets in enumerate(facets_around(kind)):
            around[number, corner, : len(facets)] = facets
    corners = np.array([kind.corners for kind in kinds], dtype=np.int32)
    sigma = np.array([regularising(kind, SIGMA_OF_SOLIDS) for kind in kinds])
    return Duals(corners, known.facets, around, known.simplices, sigma)


def elements_of(topology: Topology) -> Elements:
    """The cells that have a free node, in an order that does not depend on how they stand in the file.

    Each starts with its lowest place in memory and goes counter-clockwise; they are sorted by their places.
    """
    free, simplices = topology.near_free, topology.simplices
    corners = simplices.rows.copy()
    backwards = simplices.orientation < 0
    corners[backwards] = corners[backwards, ::-1]
    if simplices.cells is not None:
        corners = _cells_of(simplices._replace(rows=corners))
    there = corners >= 0
    corners = corners[(free[corners] & there).any(axis=1)]
    there = corners >= 0
    sides = there.sum(axis=1)
    first = np.where(there, corners, len(free)).argmin(axis=1)
    turned = (first[:, None] + np.arange(corners.shape[1])) % sides[:, None]
    corners = np.where(there, np.take_along_axis(corners, turned, axis=1), -1)
    corners = np.ascontiguousarray(corners[np.lexsort(corners.T[::-1])], dtype=np.int32)
    of_corner = corners.ravel()
    start = np.zeros(len(free) + 1, dtype=np.int32)
    np.cumsum(np.bincount(of_corner[of_corner >= 0], minlength=len(free)), out=start[1:])
    order = np.argsort(of_corner, kind="stable")[np.count_nonzero(of_corner < 0) :]
    around = (order // corners.shape[1]).astype(np.int32)
    quad = None if simplices.cells is None else corners[:, 3] >= 0
    return Elements(corners, free, start, around, quad)


def _cells_of(simplices: Simplices) -> NDArray[np.int32]:
    """(C, 4) the corners of the cells that corner simplices belong to, counter-clockwise; −1 where there is no fourth.

    Of a quad at least two simplices are there; each has another node than the one before it.
    """
    rows, cells, shapes = simplices.rows, simplices.cells, simplices.shapes
    assert cells is not None
    assert shapes is not None
    one = np.flatnonzero(np.diff(cells, prepend=-1))
    corners = np.full((len(one), 4), -1, dtype=np.int32)
    corners[:, :3] = rows[one]
    quad = np.flatnonzero(shapes[one] == SQUARE)
    own, others = rows[one[quad]], rows[one[quad] + 1]
    new = (others[:, :, None] != own[:, None, :]).all(axis=2)
    corners[quad, 2], corners[quad, 3] = others[new], own[:, 2]
    return corners


def queue_of(points: NDArray[np.float64], elements: Elements) -> Queue:
    """The elements arranged by their quality, without penalties."""
    count = len(elements.corners)
    heap, place = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
    key, shape, penalty = np.empty(count), np.empty(count), np.empty(count)
    queue = Queue(heap, place, key, shape, penalty, np.empty(2, dtype=np.int64))
    kernels.fill(queue, points, elements)
    return queue


def create(options: MethodOptions) -> Smoother:
    """The variant that the options name."""
    engine = SequentialGetme if options.variant.startswith("sequential") else SimultaneousGetme
    return engine(TRANSFORMATIONS[options.variant])


METHOD = Method(
    name="getme",
    summary="geometric element transformation: the worst element first (or all at once) is made more regular",
    source="Vartziotis, Wipper: The GETMe Mesh Smoothing Framework (2018); of volumes (2009, 2012)",
    create=create,
    variants=tuple(TRANSFORMATIONS),
    cells=ALL_CELLS,
    limits=dict.fromkeys((name for name in TRANSFORMATIONS if name != "simultaneous"), CELLS),
)
