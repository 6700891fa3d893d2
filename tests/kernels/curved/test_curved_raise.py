"""Bounds of ten-node tetrahedra are raised as a slow twin raises them: one node after the other, by SciPy and NumPy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.optimize import least_squares
from support import solid
from support.curved_kernels import descend_to

from gmsnet.generate import disturb, lattice_volume
from gmsnet.generate.curved_volumes import second_order_volume
from gmsnet.kernels.curved.descend import UNTANGLE
from gmsnet.kernels.curved.descend3 import STRAIGHTENING3
from gmsnet.kernels.curved.raise3 import FALL, raise_nodes3
from gmsnet.kernels.star.guard import MeshGuard
from gmsnet.kernels.star.truncation import HALVINGS
from gmsnet.measure.report import connectivity_of
from gmsnet.methods.solid_cells import SolidCells
from gmsnet.topology.curved_solids import curved_solids, on_rim, table_of

VALID = MeshGuard(2.0**-53, 0.0, False, -np.inf)
POWERS = [p for p in itertools.product(range(4), repeat=3) if sum(p) <= 3]
LATTICE = np.array(POWERS) / 3.0
FACTORIALS = np.array([1.0, 1.0, 2.0, 6.0])


def bernstein_at(places):
    """(P, 20) the cubic Bernstein polynomials of the tetrahedron."""
    last = 1.0 - places.sum(axis=1)
    return np.array([
        6.0 / np.prod(FACTORIALS[[*p, 3 - sum(p)]]) * np.prod(places ** np.array(p), axis=1) * last ** (3 - sum(p))
        for p in POWERS
    ]).T  # fmt: skip


def slopes_at(places):
    """(P, 3, 10) the derivatives of the shape functions."""
    quadratic = [p for p in POWERS if sum(p) <= 2]
    at_nodes = np.array([[np.prod(x ** np.array(p)) for p in quadratic] for x in solid.reference_nodes("tetra10")])
    slopes = np.zeros((len(places), 3, len(quadratic)))
    for k, p in enumerate(quadratic):
        for axis in range(3):
            lower = np.array(p) - np.eye(3, dtype=int)[axis]
            if p[axis]:
                slopes[:, axis, k] = p[axis] * np.prod(places**lower, axis=1)
    return slopes @ np.linalg.inv(at_nodes.astype(float))


TO_BERNSTEIN, SLOPES = np.linalg.inv(bernstein_at(LATTICE)), slopes_at(LATTICE)


def coefficients(nodes):
    """The 20 of det J of a cell with these nodes (10, 3)."""
    return TO_BERNSTEIN @ np.linalg.det(SLOPES @ nodes)


class Twin:
    """The rule of ``raise_nodes3`` for one node."""

    def __init__(self, cells, threshold, room):
        self.cells, self.threshold, self.room = cells, threshold, room

    def around(self, i):
        return np.flatnonzero((self.cells.mesh.cells == i).any(axis=1))

    def figures(self, points, i):
        """The objective, and the least bound around the node."""
        bounds = self.cells._replace(points=points).bounds(self.around(i), self.threshold)
        return (np.maximum(self.threshold - bounds, 0.0) ** 2).sum(), bounds.min()

    def moved(self, points, i):
        """The points after the node's turn."""
        before, least = self.figures(points, i)
        if before == 0.0 or least <= 0.0:
            return points
        start, around = points[i, :3].copy(), self.around(i)
        target = np.array(descend_to(points, self.cells.mesh, i, UNTANGLE, self.threshold)[:3])
        for halving in range(HALVINGS):
            after = points.copy()
            after[i, :3] = start + 0.5**halving * (target - start)
            if (self.cells._replace(points=after).signs(around) == 1).all():
                now, least = self.figures(after, i)
                return after if now < FALL * before and least >= self.room else points
        return points

    def descent(self, points, i):
        """The objective of a step by the node's place, and where it is least."""
        mesh = self.cells.mesh
        rows = [mesh.cells[c, :10] for c in self.around(i)]
        corners = points[np.concatenate([row[:4] for row in rows]), :3].reshape(-1, 4, 3)
        size = np.abs(corners - corners[:, :1]).max()
        scales = [1.0 / np.abs(coefficients(points[row, :3])).mean() for row in rows]
        straight = points[mesh.frame[mesh.number[i], :2], :3].mean(axis=0)

        def short(place):
            moved = points[:, :3].copy()
            moved[i] = place
            values = np.concatenate([s * coefficients(moved[row]) for s, row in zip(scales, rows, strict=True)])
            pull = STRAIGHTENING3**0.5 * (place - straight) / size
            return np.concatenate([np.maximum(self.threshold - values, 0.0), pull])

        found = least_squares(short, points[i, :3], jac="3-point", x_scale=size, xtol=1e-14, ftol=1e-14, gtol=1e-14)
        return (lambda place: (short(place) ** 2).sum()), found.x


def bent(seed):
    """Tetrahedra of which some have low bounds, and the middles that may move."""
    base = lattice_volume(3)
    made = second_order_volume(disturb(base, connectivity_of(base).free, 0.1, seed=seed), bend=0.1, seed=seed)
    cells, kinds, _, _ = table_of(made)
    held = on_rim(cells, kinds, np.zeros(len(cells), dtype=np.int64), len(made.points))
    points = np.column_stack([made.points, np.zeros(len(made.points))])
    return SolidCells(points, curved_solids(points, cells, kinds, held), ~held)


@pytest.mark.parametrize("seed", range(3))
def test_a_step_ends_where_the_objective_is_least(seed):
    cells = bent(seed)
    twin, fell = Twin(cells, 0.5, 0.0), 0
    for i in np.flatnonzero(cells.inner)[:40]:
        objective, best = twin.descent(cells.points, i)
        *place, moves = descend_to(cells.points, cells.mesh, i, UNTANGLE, 0.5)
        assert objective(np.array(place)) <= objective(best) + 0.5 * STRAIGHTENING3
        fell += moves and objective(np.array(place)) < 0.5 * objective(cells.points[i, :3])
    assert fell > 5


@pytest.mark.parametrize("room", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_nodes_go_where_the_slow_twin_puts_them(seed, room):
    cells = bent(seed)
    twin, went, stayed = Twin(cells, 0.5, room), 0, 0
    for i in np.flatnonzero(cells.inner)[:40]:
        expected, before = twin.moved(cells.points.copy(), i), cells.points.copy()
        tally = np.zeros(3, dtype=np.int64)
        raise_nodes3(cells.points, cells.mesh, np.array([i]), 0.5, room, VALID, tally)
        np.testing.assert_allclose(cells.points, expected, atol=1e-12)
        moved = (expected != before).any()
        assert tally[0] == moved
        went, stayed = went + moved, stayed + (not moved)
    assert went > 5
    assert stayed > 0


def test_no_bound_comes_below_the_room_and_what_is_taken_back_has_its_bits():
    cells = bent(1)
    every = np.arange(len(cells.mesh.cells))
    room = cells.bounds(every, 1.0).min()
    before, tally = cells.points.copy(), np.zeros(3, dtype=np.int64)
    raise_nodes3(cells.points, cells.mesh, np.flatnonzero(cells.inner), 0.9, room, VALID, tally)
    assert cells.bounds(every, 1.0).min() >= room
    changed = (cells.points != before).any(axis=1)
    assert changed.sum() == tally[0] > 0
    assert tally[2] > 0
    np.testing.assert_array_equal(changed & ~cells.inner, False)
