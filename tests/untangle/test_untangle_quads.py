"""Untangling of quads and of triangles and quads together: what it must keep, and what it must mend."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive
from support.tangles import moved, prepared, quad_grid, thrown, untangled

import gmsnet
from gmsnet.kernels.simplex.mean_ratio2 import SQUARE, WEIGHTS
from gmsnet.kernels.untangle import barrier
from gmsnet.topology.topology import Topology
from gmsnet.untangle import ALL, NOTHING, untangle
from gmsnet.untangle.harmonic import harmonic
from gmsnet.untangle.patch import Patch, in_order
from gmsnet.untangle.reasons import CROSSING, EMPTY, HELD

N = 12


def cells_of(mesh):
    """Corner lists of all cells, counter-clockwise in the grid that they come from."""
    grid = mesh.with_points(np.column_stack(np.divmod(np.arange(len(mesh.points)), round(len(mesh.points) ** 0.5))))
    found = []
    for block in mesh.cells:
        for cell in block.nodes.tolist():
            x, y = grid.points[cell, :2].T
            area = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
            found.append(cell if area > 0 else cell[::-1])
    return found


def is_valid(points, cell):
    """Are all corners of a cell positive, in fractions?"""
    n = len(cell)
    return all(
        naive.exact_area_sign(*(points[cell[(k + step) % n]].tolist() for step in (0, 1, n - 1))) > 0 for k in range(n)
    )


def valid(mesh, near, topology):
    """(C,) of each cell in the order of the mesh, at points in memory order."""
    points = np.empty_like(near)
    points[topology.memory] = near
    return np.array([is_valid(points, cell) for cell in cells_of(mesh)])


def check(mesh, topology=None):
    result, points, topology, _ = untangled(mesh, topology)
    before, after = valid(mesh, points, topology), valid(mesh, result.points, topology)
    held = ~topology.near_free
    assert result.points[held].tobytes() == points[held].tobytes()
    assert after[before].all()
    assert (result.before, result.after) == ((~before).sum(), (~after).sum())
    assert result.after <= result.before
    assert (result.taken == NOTHING) == (result.before > 0 and (result.points == points).all())
    unmended = topology.cells_of(np.array([row.row for row in result.unmended], dtype=np.intp))
    assert len(set(unmended.tolist())) == len(unmended)
    assert set(np.flatnonzero(~after)) <= set(unmended.tolist())
    assert all(row.reason and np.isfinite(row.place).all() for row in result.unmended)
    return result


@pytest.mark.parametrize("triangles", [0.0, 0.3])
@pytest.mark.parametrize("share", [0.1, 1.0])
@pytest.mark.parametrize("length", [1.0, 3.0])
def test_nodes_thrown_by_edges_are_mended(triangles, share, length):
    mesh = quad_grid(N, triangles)
    free = Topology.of(mesh).free
    chosen = np.random.default_rng(3).choice(free, int(share * len(free)), replace=False)
    tangled = thrown(mesh, chosen, length / N, seed=4)
    result = check(tangled, Topology.of(mesh))
    assert result.before > 0
    assert (result.after, result.taken, result.unmended) == (0, ALL, ())


@given(
    seed=st.integers(0, 2**32 - 1), triangles=st.sampled_from([0.0, 0.5]), length=st.sampled_from([0.3, 1.0, 3.0]),
    whole=st.booleans(),
)  # fmt: skip
@settings(max_examples=40)
def test_whatever_is_thrown_and_held_no_valid_cell_is_lost(seed, triangles, length, whole):
    rng = np.random.default_rng(seed)
    mesh = quad_grid(6, triangles, seed)
    nodes = len(mesh.points)
    topology = Topology.of(mesh, rng.random(nodes) < 0.3)
    chosen = np.arange(nodes) if whole else rng.choice(topology.free, len(topology.free) // 3)
    result = check(thrown(mesh, chosen, length / 6, seed), topology)
    points, topology, precision = prepared(thrown(mesh, chosen, length / 6, seed), topology)
    assert untangle(points, topology, precision).points.tobytes() == result.points.tobytes()


def test_a_bow_tie_whose_nodes_are_held_is_one_cell_with_a_reason():
    """Two nodes of one side of a corner quad change places: all of it is boundary but one node, which is fixed."""
    mesh = quad_grid(4)
    places = mesh.points[[0, 1], :2][::-1]
    fixed = np.ones(25, dtype=bool)
    result = check(moved(mesh, [0, 1], places), Topology.of(mesh, fixed))
    assert [row.reason for row in result.unmended] == [HELD] * result.after
    assert result.after == result.before > 0


def test_a_free_node_between_held_ones_that_has_no_place():
    """Two opposite neighbours of it are past each other, and all eight nodes around it are fixed."""
    mesh = quad_grid(6)
    fixed = np.zeros(49, dtype=bool)
    fixed[[16, 17, 18, 23, 25, 30, 31, 32]] = True
    crossed = moved(mesh, [17, 31], [[0.7, 0.5], [0.3, 0.5]])
    result = check(crossed, Topology.of(mesh, fixed))
    assert result.taken == NOTHING
    assert result.after == result.before == 4
    assert [row.reason for row in result.unmended] == [EMPTY] * 4


def test_a_boundary_that_crosses_itself_is_named():
    mesh = quad_grid(2)
    result = check(moved(mesh, [3, 5], mesh.points[[5, 3], :2]))
    assert result.taken == NOTHING
    assert [row.reason for row in result.unmended] == [CROSSING] * 4


def test_the_run_names_the_cells_that_stay_inverted():
    mesh = quad_grid(4, 0.4, seed=2)
    crossed = moved(mesh, [0, 1], mesh.points[[1, 0], :2])
    result = gmsnet.smooth(crossed, max_sweeps=2)
    inverted = result.after.cell[result.after.valid <= 0].tolist()
    assert [cell.cell for cell in result.unmended] == inverted != []
    assert result.after.inverted == len(inverted) <= result.before.inverted


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 0.4, 1.0]), st.sampled_from([0.0, 0.4, 1.0]))
@settings(max_examples=30)
def test_a_patch_has_the_corner_simplices_of_its_nodes_with_their_weights(seed, part, triangles):
    mesh = quad_grid(6, triangles, seed % 7)
    _, topology, _ = prepared(mesh)
    topology = topology.with_rings_of_free_nodes()
    chosen = topology.near_free & (np.random.default_rng(seed).random(len(topology.memory)) < part)
    patch = Patch.of(topology, in_order(topology, chosen))
    place = topology.places
    expected = {}
    for cell in cells_of(mesh):
        n = len(cell)
        for k in range(n if n == 4 else 1):
            row = [int(place[cell[(k + step) % n]]) for step in (0, 1, n - 1)]
            if chosen[row].any():
                expected[frozenset(row)] = (row, n)
    found = patch.every[patch.cells]
    assert len(found) == len(expected)
    for t, row in enumerate(found.tolist()):
        corner_first, n = expected[frozenset(row)]
        turn = row.index(corner_first[0])
        assert row[turn:] + row[:turn] == corner_first
        assert patch.cells[t, 0] < patch.count
        if patch.weights is None:
            assert n == 3
            continue
        squared = np.ones((3, 3))
        if n == 4:
            w = WEIGHTS[SQUARE]
            for (i, j), weight in zip(((0, 1), (0, 2), (1, 2)), w, strict=True):
                squared[i, j] = squared[j, i] = weight
        where = [corner_first.index(node) for node in row]
        assert patch.weights[t].tolist() == [squared[where[i], where[j]] for i, j in ((0, 1), (0, 2), (1, 2))]
        assert len({int(patch.part[v]) for v in patch.cells[t] if v < patch.count}) == 1


@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 0.1]), st.sampled_from([0.0, 0.4]))
@settings(max_examples=20)
def test_the_energy_with_weights_and_its_slopes(seed, epsilon, triangles):
    mesh = quad_grid(4, triangles, seed % 5)
    points, topology, _ = prepared(thrown(mesh, Topology.of(mesh).free, 0.15, seed))
    topology = topology.with_rings_of_free_nodes()
    patch = Patch.of(topology, in_order(topology, topology.near_free))
    points = points[patch.every]
    scale = 0.5 + np.random.default_rng(seed).random(len(points))

    def twin(points):
        total = 0.0
        for (i, j, k), (wa, wb, wo) in zip(patch.cells, patch.weights, strict=True):
            a, b = points[j] - points[i], points[k] - points[i]
            d, e = a[0] * b[1] - a[1] * b[0], epsilon * (scale[i] + scale[j] + scale[k]) / 3
            square = wa * a @ a + wb * b @ b + wo * (b - a) @ (b - a)
            total += square / np.sqrt(3) / (d + np.sqrt(e**2 + d**2))
        return total

    gradient = np.empty_like(points)
    value = barrier.energy(points, patch.cells, patch.weights, scale, epsilon, gradient)
    assert value == pytest.approx(twin(points), rel=1e-9)
    numeric, h = np.empty_like(points), 1e-6
    for k in range(points.size):
        there, back = points.copy(), points.copy()
        there.flat[k] += h
        back.flat[k] -= h
        numeric.flat[k] = (twin(there) - twin(back)) / (2 * h)
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-5 * np.abs(numeric).max())
    for v in range(patch.count):
        _, gx, gy, xx, xy, yy = barrier.star(points, *points[v], v, patch.stars, scale, epsilon)
        np.testing.assert_allclose([gx, gy], gradient[v], rtol=1e-6, atol=1e-9 * abs(value))
        assert min(xx, yy) >= 0
        assert xx * yy - xy * xy >= -1e-9 * (xx + yy) ** 2


@pytest.mark.parametrize("triangles", [0.0, 0.4])
def test_harmonic_places_of_quads_are_the_means_of_their_edge_neighbours(triangles):
    mesh = quad_grid(8, triangles, 1)
    points, topology, _ = prepared(thrown(mesh, Topology.of(mesh).free, 3.0, seed=1), Topology.of(mesh))
    topology = topology.with_rings_of_free_nodes()
    patch = Patch.of(topology, in_order(topology, topology.near_free))
    new = points.copy()
    new[patch.every] = harmonic(points[patch.every], patch)
    neighbours: dict[int, set[int]] = {}
    for cell in cells_of(mesh):
        for one, other in zip(cell, cell[1:] + cell[:1], strict=True):
            neighbours.setdefault(one, set()).add(other)
            neighbours.setdefault(other, set()).add(one)
    for v in topology.free.tolist():
        mean = new[topology.places[sorted(neighbours[v])]].mean(axis=0)
        np.testing.assert_allclose(new[topology.places[v]], mean, rtol=0, atol=1e-12)
    assert valid(mesh, new, topology).all()
