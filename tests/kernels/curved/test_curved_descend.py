"""Descent of single nodes: least quality never falls, and the fit is the polynomial."""

from __future__ import annotations

import numpy as np
import pytest
from support import curved_meshes

from gmsnet.kernels.curved.descend import improve_nodes
from gmsnet.kernels.star.guard import MeshGuard
from gmsnet.measure.curved import judge_curved
from gmsnet.methods.planar_cells import PlanarCells
from gmsnet.untangle.curved import untangle_curved

VALID = MeshGuard(2.0**-53, 0.0, False, -np.inf)


def qualities(points, mesh):
    return judge_curved(points, mesh.cells, mesh.kinds)


@pytest.mark.parametrize("seed", range(20))
def test_the_least_quality_never_falls_and_all_cells_stay_valid(seed):
    points, mesh, free = curved_meshes.tables(curved_meshes.thrown(seed))
    assert untangle_curved(PlanarCells(points, mesh, free)).after == 0
    before, nodes = points.copy(), np.flatnonzero(PlanarCells(points, mesh, free).inner)
    least = qualities(points, mesh)[1].min()
    for _ in range(3):
        tally = np.zeros(3, dtype=np.int64)
        improve_nodes(points, mesh, nodes, 0.9, VALID, tally)
        sign, quality = qualities(points, mesh)
        assert (sign == 1).all()
        assert quality.min() >= least
        least = quality.min()
    others = np.setdiff1d(np.arange(len(points)), nodes)
    np.testing.assert_array_equal(points[others], before[others])


def test_cells_above_the_threshold_are_left_alone():
    points, mesh, free = curved_meshes.tables(curved_meshes.known_valid(1))
    before = points.copy()
    tally = np.zeros(3, dtype=np.int64)
    improve_nodes(
        points,
        mesh,
        np.flatnonzero(PlanarCells(points, mesh, free).inner),
        qualities(points, mesh)[1].min(),
        VALID,
        tally,
    )
    np.testing.assert_array_equal(points, before)
    assert not tally.any()


def test_a_bent_edge_between_straight_ones_becomes_nearly_straight():
    made = curved_meshes.second_order(curved_meshes.quad_grid(2), quads="quad9")
    points, mesh, free = curved_meshes.tables(made)
    e = int(np.flatnonzero(mesh.dragged)[0])
    m = mesh.edges[e, 2]
    straight = points[m].copy()
    points[m] += [0.05, 0.05]
    for _ in range(10):
        improve_nodes(
            points,
            mesh,
            np.flatnonzero(PlanarCells(points, mesh, free).inner),
            0.99,
            VALID,
            np.zeros(3, dtype=np.int64),
        )
    assert np.abs(points[m] - straight).max() < 0.01


@pytest.mark.parametrize("seed", range(4))
def test_valid_cells_get_room_though_some_of_their_coefficients_are_negative(seed):
    """Logarithms of these are infinite: the nodes around did not move, and the least stayed at .11 to .19."""
    bend = 0.2 if seed == 3 else 0.15
    made = curved_meshes.second_order(curved_meshes.quad_grid(4), quads="quad9", bend=bend, seed=seed)
    points, mesh, free = curved_meshes.tables(made)
    sign, quality = qualities(points, mesh)
    assert (sign == 1).all()
    assert quality.min() < 0.2
    for _ in range(10):
        nodes = np.flatnonzero(PlanarCells(points, mesh, free).inner)
        improve_nodes(points, mesh, nodes, 0.9, VALID, np.zeros(3, dtype=np.int64))
    sign, quality = qualities(points, mesh)
    assert (sign == 1).all()
    assert quality.min() > 0.85
