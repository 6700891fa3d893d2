"""Invalid second-order cells become valid where a valid mesh is known, on generated meshes and real ones."""

from __future__ import annotations

import numpy as np
import pytest
from support import curved_meshes

from gmsnet.kernels.curved.stars import curved_mesh
from gmsnet.kernels.star.guard import Precision
from gmsnet.measure.curved import judge_curved
from gmsnet.methods.planar_cells import PlanarCells
from gmsnet.untangle.curved import untangle_curved


@pytest.mark.parametrize("seed", range(100))
def test_a_hundred_thrown_meshes_are_valid_afterwards(seed):
    mesh = curved_meshes.thrown(seed)
    points, tables, free = curved_meshes.tables(mesh)
    score = untangle_curved(PlanarCells(points, tables, free))
    assert score.before > 0
    assert score.after == 0
    assert (judge_curved(points, tables.cells, tables.kinds)[0] == 1).all()
    np.testing.assert_array_equal(points[~free], mesh.points[~free])


@pytest.mark.parametrize("seed", range(100, 200))
def test_a_hundred_valid_meshes_stay_as_they_are(seed):
    mesh = curved_meshes.known_valid(seed)
    points, tables, free = curved_meshes.tables(mesh)
    score = untangle_curved(PlanarCells(points, tables, free))
    assert (score.before, score.after) == (0, 0)
    assert not score.for_good.any()
    np.testing.assert_array_equal(points, mesh.points)


def test_what_cannot_be_mended_is_left_and_no_valid_cell_is_lost():
    """Boundary middles beyond the opposite corner: their cells stay invalid, others are mended."""
    mesh = curved_meshes.thrown(2)
    points = mesh.points.copy()
    lines = next(block.nodes for block in mesh.cells if block.dimension == 1)
    points[lines[0, 2]] = points.mean(axis=0) + 3 * (points.mean(axis=0) - points[lines[0, 2]])
    mesh = mesh.with_points(points)
    points, tables, free = curved_meshes.tables(mesh)
    before = judge_curved(points, tables.cells, tables.kinds)[0]
    score = untangle_curved(PlanarCells(points, tables, free))
    after = judge_curved(points, tables.cells, tables.kinds)[0]
    assert 1 <= score.after < score.before
    assert (after[before == 1] == 1).all()


@pytest.mark.parametrize(("seed", "held", "most"), [(0, 6, 10), (6, 3, 3), (10, 6, 4)])
def test_held_middles_that_are_wrong_cost_only_cells_around_them(seed, held, most):
    mesh, rng = curved_meshes.thrown(seed), np.random.default_rng(seed)
    points, tables, free = curved_meshes.tables(mesh)
    wrong = rng.choice(np.flatnonzero(PlanarCells(points, tables, free).inner), held, replace=False)
    points[wrong] += 0.3 * rng.normal(size=(held, 2))
    free[wrong] = False
    first, tables = points.copy(), curved_mesh(points, tables.cells, tables.kinds, ~free)
    before = judge_curved(points, tables.cells, tables.kinds)[0]
    score = untangle_curved(PlanarCells(points, tables, free))
    after = judge_curved(points, tables.cells, tables.kinds)[0]
    assert score.after == (after != 1).sum() <= most < score.before
    assert (after[before == 1] == 1).all()
    np.testing.assert_array_equal(points[~free], first[~free])


def test_in_single_precision_the_result_is_valid_as_the_file_keeps_it():
    mesh = curved_meshes.thrown(7)
    mesh = mesh.with_points(np.float64(np.float32(mesh.points)))
    points, tables, free = curved_meshes.tables(mesh)
    assert untangle_curved(PlanarCells(points, tables, free, Precision.of(single=True, exponent=0))).after == 0
    np.testing.assert_array_equal(points, np.float32(points))


def test_guarded_moves_that_mend_nothing_are_taken_back(monkeypatch):
    """Boundary middles that are off spoil cells of valid meshes: nothing moves where none can be mended."""
    swept, sweep = [], PlanarCells.guarded_sweep

    def guarded_sweep(self, *others):
        swept.append(sweep(self, *others))
        return swept[-1]

    monkeypatch.setattr(PlanarCells, "guarded_sweep", guarded_sweep)
    in_vain = 0
    for seed in range(100, 120):
        mesh = curved_meshes.known_valid(seed)
        first = mesh.points.copy()
        line = next(block.nodes for block in mesh.cells if block.dimension == 1)[0]
        first[line[2]] += 1.5 * (first.mean(axis=0) - first[line[2]])
        points, tables, free = curved_meshes.tables(mesh.with_points(first))
        score = untangle_curved(PlanarCells(points, tables, free))
        if score.after == score.before > 0:
            in_vain += 1
            np.testing.assert_array_equal(points, first)
    assert in_vain
    assert any(swept)
