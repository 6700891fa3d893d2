"""One node after the other: the model of a star is that of matrices and differences, and a node ends at its minimum."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from support import naive_metric as naive

from gmsnet.generate import disturb, random_quad_mesh, structured_mesh
from gmsnet.kernels.metric import nodes, places
from gmsnet.kernels.metric.nodes import Around, Term
from gmsnet.metric.conformity import oriented
from gmsnet.metric.field import Metric
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

TERMS = [Term(0.0, 0, 1.0), Term(0.1, 0, 1.0), Term(0.0, 3, 2.0)]
SLOPES = np.array([[2.0, -3.0], [1.5, 0.2], [-0.4, 1.9]])


class Case:
    """A thrown mesh in a metric that changes from place to place, its free nodes and their simplices."""

    def __init__(self, mesh):
        topology = Topology.of(mesh)
        self.points = near_points(mesh, topology)
        scale = np.ptp(self.points, axis=0).max()
        self.cells, self.table = oriented(topology.simplices)
        logs = self.points @ SLOPES.T / scale + np.array([-2.0 * np.log(0.15 * scale), 0.1, -0.2])
        metric = Metric.at_nodes(topology, self.points.copy(), logs)
        self.background, self.where = metric.given, metric.first.copy()
        self.moved = np.flatnonzero(topology.near_free)
        number = np.full(len(self.points), -1, dtype=np.int32)
        number[self.moved] = np.arange(len(self.moved))
        self.star = Around(self.cells, self.table, *nodes.around(self.cells, number, len(self.moved)))
        self.logs, self.slopes = np.empty((len(self.points), 3)), np.empty((len(self.points), 3, 2))
        places.evaluate(self.background, self.points, self.where, self.logs, self.slopes)

    def log_at(self, i, x):
        logs = np.empty((1, 3))
        places.evaluate(self.background, np.array([x]), self.where[[i]], logs, np.empty((1, 3, 2)))
        return logs[0]

    def naive(self, row, x, term, log=None):
        """The sum over the star of a node at x."""
        i = self.moved[row]
        points, logs = self.points.copy(), self.logs.copy()
        points[i], logs[i] = x, self.log_at(i, x) if log is None else log
        total = 0.0
        for entry in self.star.entries[self.star.start[row] : self.star.start[row + 1]]:
            t = entry // 3
            square = self.table is not None and self.table[t, 2] == 0.0
            quality = naive.quality(points[self.cells[t]], logs[self.cells[t]], "square" if square else "equilateral")
            if quality <= term.floor:
                return np.inf
            total += (1.0 / (quality - term.floor) / term.top) ** 2**term.doublings
        return total

    def sweep(self, term, awake, rows=None):
        chosen = self.moved if rows is None else self.moved[rows]
        number = np.full(len(self.points), -1, dtype=np.int32)
        number[chosen] = np.arange(len(chosen))
        star = Around(self.cells, self.table, *nodes.around(self.cells, number, len(chosen)))
        return nodes.sweep(self.points, chosen, star, term, self.background, self.where, self.logs, self.slopes, awake)


def triangles():
    mesh = structured_mesh(6, 6)
    return Case(disturb(mesh, Topology.of(mesh).free, 0.3, seed=3))


def quads():
    return Case(random_quad_mesh(20, seed=1))


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("make", [triangles, quads])
def test_the_model_is_that_of_matrices_and_of_differences(make, term):
    case = make()
    for row in range(0, len(case.moved), 4):
        i = case.moved[row]
        x, log = case.points[i].copy(), case.logs[i].copy()
        total, gx, gy, *_, spokes = nodes.model(case.star, term, row, case.points, case.logs, case.slopes, i)
        wanted = case.naive(row, x, term)
        if not np.isfinite(wanted):
            assert not np.isfinite(total)
            continue
        assert total == pytest.approx(wanted, rel=1e-8)
        step = 1e-5 * np.sqrt(spokes)
        ways = step * np.eye(2)

        def along(way, row=row, x=x, log=log, i=i):
            return case.naive(row, x + way, term, log + case.slopes[i] @ way)

        difference = [(along(way) - along(-way)) / (2.0 * step) for way in ways]
        np.testing.assert_allclose(
            [gx, gy], difference, rtol=1e-3, atol=1e-4 * abs(gx) + 1e-4 * abs(gy) + 1e-5 * total / np.sqrt(spokes)
        )

        def still(way, row=row, x=x, log=log):
            return case.naive(row, x + 1e2 * way, term, log)

        if total > 1e4:  # differences are too coarse for it
            continue
        # in the metric as it is here: the model takes it as constant in its second derivative
        bent = (
            np.array([[still(p + q) - still(p - q) - still(q - p) + still(-p - q) for q in ways] for p in ways])
            / (2e2 * step) ** 2
        )
        flat = np.zeros_like(case.slopes)
        found = nodes.model(case.star, term, row, case.points, case.logs, flat, i)
        whole = np.array([[found[3] + found[6], found[4] + found[7]], [found[4] + found[7], found[5] + found[8]]])
        assert np.abs(whole - bent).max() < 1e-2 * np.abs(bent).max()
        assert found[3] > 0.0
        assert found[3] * found[5] > found[4] ** 2


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("make", [triangles, quads])
def test_a_node_alone_ends_at_its_minimum_and_the_fall_is_as_told(make, term):
    case = make()
    checked = 0
    for row in range(0, len(case.moved), 5):
        i = case.moved[row]
        before = case.naive(row, case.points[i], term)
        if not np.isfinite(before):
            continue
        start, awake, fallen = case.points[i].copy(), np.ones(len(case.points), dtype=bool), 0.0
        for _ in range(60):
            awake[:] = True
            fallen += case.sweep(term, awake, rows=[row])
        after = case.naive(row, case.points[i], term)
        assert fallen == pytest.approx(before - after, rel=1e-6, abs=1e-9 * before)
        size = np.abs(start).max()
        best = minimize(
            lambda x, row=row, size=size: case.naive(row, x * size, term), case.points[i] / size, method="Nelder-Mead",
            options={"xatol": 1e-9, "fatol": 1e-12},
        )  # fmt: skip
        assert after == pytest.approx(min(best.fun, after), rel=1e-4)
        checked += 1
    assert checked > 2


def test_nodes_sleep_once_nothing_moves_around_them_and_others_do_not_stir():
    case = triangles()
    awake, term = np.ones(len(case.points), dtype=bool), TERMS[0]
    chosen, before = np.arange(0, len(case.moved), 2), case.points.copy()
    assert case.sweep(term, awake, rows=chosen) > 0.0
    others = np.setdiff1d(np.arange(len(case.points)), case.moved[chosen])
    assert (case.points[others] == before[others]).all()
    awake[:] = True
    for _ in range(100):
        case.sweep(term, awake)
    assert not awake[case.moved].any()
    before = case.points.copy()
    assert case.sweep(term, awake) == 0.0
    assert (case.points == before).all()
