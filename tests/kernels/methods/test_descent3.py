"""Descent of a node in space against slow twins: SciPy's minimum of the naive sums, and Adam as it is written."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from support import volumes
from support.naive_objectives3 import value_of

from gmsnet.kernels.methods import adam, descent3
from gmsnet.kernels.simplex.objectives3 import DIHEDRAL, NAMES, Aim3
from gmsnet.kernels.star.guard import MeshGuard, Precision, plain_guard
from gmsnet.methods.optimize import step_sizes
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume

NO_SIZES = np.empty(0)


class Star:
    """A mesh of one free node, its neighbours as they are seen from it, and the radius of its star."""

    def __init__(self, seed, around=12):
        points, cells = volumes.ball(np.random.default_rng(seed), around, off=0.5)
        mesh = volumes.mesh_of(points, cells)
        topology = Volume.of(mesh)
        self.points, self.blocks = space_points(mesh)[topology.memory], topology.stars.blocks
        self.node = int(np.flatnonzero(topology.near_free)[0])
        rows = topology.near.tolist()
        self.ends = np.array([self.points[outwards(row, self.node)][:, :3] for row in rows])
        self.ends[topology.near_orientation < 0] = self.ends[topology.near_orientation < 0][:, [0, 2, 1]]
        self.radius = float(np.sqrt(np.mean(np.sum((self.ends - self.points[self.node, :3]) ** 2, axis=2))))

    def visited(self, aim, steps, sizes, guard=None):
        """Where the node goes, and the tally."""
        points, tally = self.points.copy(), np.zeros(3, dtype=np.int64)
        guard = plain_guard(Precision()) if guard is None else guard
        descent3.sweep3(points, self.blocks, 0, len(self.blocks.filled), guard, aim, steps, sizes, tally)
        return points[self.node, :3], tally.tolist()

    def value(self, name, at, aim=None, scale=1.0):
        if min(np.linalg.det(corners - at) for corners in self.ends) <= 0:
            return np.inf
        return value_of(name, self.ends, at, aim, scale)[0]


def outwards(row, node):
    """The other nodes of a tetrahedron, in the order in which its volume is positive from the node."""
    k = row.index(node)
    a, b, c = row[:k] + row[k + 1 :]
    return [a, c, b] if k % 2 else [a, b, c]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(6))
def test_newton_ends_at_the_minimum(name, seed):
    star = Star(seed)
    start = star.points[star.node, :3]
    place, tally = star.visited(Aim3(NAMES.index(name)), 40, NO_SIZES)
    options = {"xatol": 1e-7, "fatol": 1e-12, "maxiter": 2000, "initial_simplex": start + 0.02 * np.vstack(
        [np.zeros(3), np.eye(3)]
    )}  # fmt: skip
    found = scipy.optimize.minimize(
        lambda at: min(star.value(name, at), 1e12), start, method="Nelder-Mead", options=options
    )
    assert star.value(name, place) <= found.fun * (1 + 1e-6) + 1e-6
    assert tally[0] == 1


@pytest.mark.parametrize("name", NAMES)
def test_adam_goes_where_a_slow_twin_goes(name):
    star, sizes = Star(3), step_sizes()
    start = star.points[star.node, :3]

    def value(at):
        return star.value(name, start + star.radius * at)

    def slope(at):
        return [(value(at + s) - value(at - s)) / 2e-6 for s in 1e-6 * np.eye(3)]

    at, m, v, best, least = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), value(np.zeros(3))
    for t, size in enumerate(sizes, 1):
        g = np.array(slope(at))
        m, v = adam.BETA_1 * m + (1 - adam.BETA_1) * g, adam.BETA_2 * v + (1 - adam.BETA_2) * g * g
        at = at - size * (m / (1 - adam.BETA_1**t)) / (np.sqrt(v / (1 - adam.BETA_2**t)) + adam.EPSILON)
        assert value(at) < np.inf  # else another rule begins
        if value(at) < least:
            best, least = at, value(at)
    place, _ = star.visited(Aim3(NAMES.index(name)), 0, sizes)
    np.testing.assert_allclose(place, start + star.radius * best, atol=1e-5)


@pytest.mark.parametrize("seed", range(10))
def test_the_smallest_angle_of_a_star_gains(seed):
    star = Star(seed)

    def angle():
        return value_of("", star.ends, star.points[star.node, :3], Aim3(DIHEDRAL), 1.0)[1]

    before = [angle()]
    enough = Aim3(DIHEDRAL, 4, enough=0.99 * before[0])
    assert star.visited(enough, 10, NO_SIZES)[1] == [0, 0, 0]
    for doublings in (3, 4, 5, 6):  # the smallest angle counts ever more
        star.points[star.node, :3], _ = star.visited(Aim3(DIHEDRAL, doublings), 10, NO_SIZES)
        before.append(angle())
    assert before[1] > before[0]
    assert before[4] > 0.999 * max(before)


def test_a_floor_is_kept_and_gone_along():
    star = Star(4)
    least = min(np.linalg.det(e - star.points[star.node, :3]) for e in star.ends)
    free, _ = star.visited(Aim3(DIHEDRAL, 5), 10, NO_SIZES)
    floor = 0.999 * min(ratio(star, star.points[star.node, :3]))
    guard = MeshGuard(*Precision(), floor, None)
    kept, tally = star.visited(Aim3(DIHEDRAL, 5, bound=floor), 10, NO_SIZES, guard)
    assert min(ratio(star, kept)) > floor
    assert tally[0] == 1
    assert least > 0
    assert not np.array_equal(free, kept)


def ratio(star, at):
    """D/S^(3/2) of each simplex."""
    return [volumes_of(np.vstack([at, corners])) for corners in star.ends]


def volumes_of(corners):
    lengths = sum(np.sum((corners[i] - corners[j]) ** 2) for i in range(4) for j in range(i))
    return np.linalg.det(corners[1:] - corners[0]) / lengths**1.5


def test_a_tangled_star_and_one_without_extent_stay():
    star = Star(5)
    for at in (star.points[star.node] + 10, star.points[star.node - 1]):
        points = star.points.copy()
        points[star.node] = at
        before, star.points = star.points, points
        for kind in range(4):
            assert star.visited(Aim3(kind, 4), 10, NO_SIZES)[1] == [0, 0, 0]
            assert star.visited(Aim3(kind, 4), 0, step_sizes())[1] == [0, 0, 0]
        star.points = before
