"""No mesh is better than its bounds; single stars come as near to them as one likes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial import Delaunay

import gmsnet
from gmsnet.generate import disturb
from gmsnet.measure.bounds import apexes
from gmsnet.measure.bounds.bounds import limits
from gmsnet.measure.bounds.groups import CORNER, FREE_CORNER, HELD, RING, best_with_corner
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology

ROUNDING = 1e-9


def mesh_of(points, triangles):
    triangles = np.asarray(triangles)
    return Mesh(
        np.asarray(points, dtype=float), (CellBlock("triangle", triangles, np.zeros(len(triangles), dtype=int)),)
    )


def bounds(mesh, held=None, below=1.0):
    return limits(mesh, Topology.of(mesh, held), below)


def fan(ring, centre=(0.0, 0.0)):
    n = len(ring)
    return mesh_of(np.vstack([[centre], ring]), [(0, 1 + i, 1 + (i + 1) % n) for i in range(n)])


def polygon(n):
    turn = 2.0 * np.pi * np.arange(n) / n
    return np.column_stack([np.cos(turn), np.sin(turn)])


def reached(mesh, node, rows):
    """The largest minimum 1/q of some triangles that any place of a node has been found to give."""
    triangles = mesh.cells[0].nodes[rows]
    points = mesh.points.copy()

    def worst(place):
        points[node] = place
        a, b, c = (points[triangles[:, k]] for k in range(3))
        u, v = b - a, c - a
        double = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        sides = (u**2).sum(1) + (v**2).sum(1) + ((u - v) ** 2).sum(1)
        return -(2.0 * np.sqrt(3.0) * double / sides).min()

    ring = mesh.points[np.setdiff1d(triangles, node)]
    starts = [ring.mean(axis=0), mesh.points[node], *ring[:3] * 0.5 + ring.mean(axis=0) * 0.5]
    options = {"xatol": 1e-10, "fatol": 1e-12, "maxiter": 2000}
    return max(-minimize(worst, x, method="Nelder-Mead", options=options).fun for x in starts)


def test_the_best_triangle_with_a_corner():
    """Against all pairs of sides; a right angle allows √3/2, 60° allows 1, 180° nothing."""
    ratio = np.geomspace(0.01, 100.0, 2001)
    for angle in np.radians([1.0, 30.0, 60.0, 90.0, 120.0, 179.0]):
        shape = 2.0 * np.sqrt(3.0) * ratio * np.sin(angle) / (2.0 * (1.0 + ratio**2 - ratio * np.cos(angle)))
        assert shape.max() == pytest.approx(best_with_corner(angle), abs=1e-12)
    assert best_with_corner(np.pi / 2) == pytest.approx(np.sqrt(0.75))
    assert best_with_corner(np.pi / 3) == pytest.approx(1.0)
    assert best_with_corner(np.pi) == 0.0
    assert best_with_corner(4.0) == 0.0


@pytest.mark.parametrize("n", [3, 4, 5, 7, 9, 20])
def test_regular_fans_are_as_good_as_their_bounds(n):
    found = bounds(fan(polygon(n), centre=(0.2, -0.1)))
    for kind in (FREE_CORNER, RING):
        (group,) = np.flatnonzero(found.kind == kind)
        assert found.bound[group] == pytest.approx(best_with_corner(2 * np.pi / n), abs=2e-6)
        assert sorted(found.cells(group).tolist()) == list(range(n))
    inner = np.pi * (n - 2) / n / 2  # each corner of the polygon is shared by two cells
    np.testing.assert_allclose(found.bound[found.kind == CORNER], best_with_corner(inner), atol=2e-6)
    assert (found.kind == CORNER).sum() == n
    assert found.ceiling == found.bound.min()


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(3, 12))
@settings(max_examples=60)
def test_held_rings_are_tight(seed, n):
    """The discs of all edges of a held ring: an optimiser comes to the bound, and not beyond it."""
    mesh = fan(ring_of(np.random.default_rng(seed), n))
    found = bounds(mesh)
    (group,) = np.flatnonzero(found.kind == RING)
    best = reached(mesh, 0, found.cells(group))
    assert best <= found.bound[group] + ROUNDING
    assert best >= found.bound[group] - 1e-4 or found.bound[group] < 2e-4


def ring_of(rng, n):
    """A star-shaped polygon of unequal edges."""
    turn = 2.0 * np.pi * (np.arange(n) + 0.8 * rng.random(n)) / n
    return (0.3 + rng.random(n))[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])


def edges_of(ring):
    along = np.roll(ring, -1, axis=0) - ring
    return ring + 0.5 * along, np.column_stack([-along[:, 1], along[:, 0]])


@given(seed=st.integers(0, 2**32 - 1), numbers=st.lists(st.integers(1, 14), min_size=1, max_size=6))
@settings(max_examples=60)
def test_a_few_edges_at_a_time_give_the_bound_of_all(seed, numbers):
    """Against all pairs of discs, for rings of any numbers of edges at once; no bound is below the true one."""
    rng = np.random.default_rng(seed)
    rings = [edges_of(ring_of(rng, n)) for n in numbers]
    middle, upright = (np.concatenate([ring[k] for ring in rings]) for k in range(2))
    bound = apexes.best_apex_of_many(middle, upright, apexes.starts(np.array(numbers)), 1.0)
    every = np.array([apexes.best_apex(m[None], u[None])[0] for m, u in rings])
    assert (bound >= every - ROUNDING).all()
    np.testing.assert_allclose(bound, every, atol=1e-6)


def test_the_work_on_a_hub_does_not_grow_with_the_square_of_its_degree(monkeypatch):
    """4,000 held edges around one free node: never are more than a few discs met with each other."""
    sizes = []
    meeting = apexes.common_point
    monkeypatch.setattr(apexes, "common_point", lambda m, u, t: sizes.append(m.shape[1]) or meeting(m, u, t))
    mesh = fan(polygon(4000) * (1.0 + 1e-4 * np.random.default_rng(0).random((4000, 1))))
    found = bounds(mesh)
    assert 0 < max(sizes) <= apexes.FEW
    assert len(sizes) <= apexes.ROUNDS * (apexes.BISECTIONS + 2)
    (group,) = np.flatnonzero(found.kind == RING)
    assert len(found.cells(group)) == 4000
    assert 0.0 < gmsnet.quality(mesh).shape.min() <= found.bound[group] < 0.01


def test_edges_of_no_length_bound_nothing():
    ring = np.repeat(polygon(8), 2, axis=0)
    middle, upright = edges_of(ring)
    whole, twice = (
        apexes.best_apex_of_many(m, u, np.array([0, len(m)]), 1.0) for m, u in (edges_of(polygon(8)), (middle, upright))
    )
    assert twice[0] == pytest.approx(whole[0], abs=1e-6)
    assert twice[0] == pytest.approx(best_with_corner(np.pi / 4), abs=1e-6)


@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(5, 60), share=st.sampled_from([0.0, 0.2, 0.6]))
@settings(max_examples=60)
def test_no_valid_mesh_exceeds_a_bound(seed, nodes, share):
    """Smoothed by what is best for the worst cells, and thrown about: some cell of each group stays below its bound."""
    rng = np.random.default_rng(seed)
    points = rng.random((nodes, 2))
    triangles = np.array([t[:: rng.choice([1, -1])] for t in Delaunay(points).simplices])
    mesh = mesh_of(points, triangles)
    held = rng.random(nodes) < share
    found = bounds(mesh, held)
    topology = Topology.of(mesh, held)
    options = {"method": "optimize", "variant": "newton", "objective": "q2", "preserve": "none", "fixed": held}
    states = [gmsnet.smooth(mesh, **options, max_sweeps=k).mesh for k in (1, 30)]
    states += [disturb(s, topology.free, 0.5, seed=seed % 1000) for s in states]
    for state in [mesh, *states]:
        report = gmsnet.quality(state)
        if report.inverted:
            continue
        for group in range(len(found.bound)):
            assert report.shape[found.cells(group)].min() <= found.bound[group] + ROUNDING
        assert report.shape.min() <= found.ceiling + ROUNDING


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_where_it_lies_and_how_it_is_numbered_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    points = rng.random((30, 2))
    triangles = Delaunay(points).simplices
    held = rng.random(30) < 0.4
    one = bounds(mesh_of(points, triangles), held)
    cosine, sine = np.cos(0.7), np.sin(0.7)
    for matrix in ([[cosine, sine], [-sine, cosine]], [[1e5, 0.0], [0.0, -1e5]]):
        order = rng.permutation(30)
        mixed = np.argsort(order)[rng.permutation(triangles)]
        other = bounds(mesh_of(points[order] @ matrix, mixed), held[order])
        assert sorted(other.kind.tolist()) == sorted(one.kind.tolist())
        np.testing.assert_allclose(other.bound, one.bound, atol=1e-6)


def test_only_free_nodes_may_move_a_bound():
    mesh = gmsnet.random_mesh(200, seed=0)
    topology = Topology.of(mesh)
    one, other = (limits(m, topology, 1.0) for m in (mesh, disturb(mesh, topology.free, 2.0, keep_valid=False)))
    assert one.bound.tolist() == other.bound.tolist()
    assert one.rows.tolist() == other.rows.tolist()


def test_a_corner_between_held_edges():
    """A corner of 270° with two cells: 135° each at best."""
    mesh = mesh_of([[0, 0], [1, 0], [-1, 1.5], [0, -1]], [[0, 1, 2], [0, 2, 3]])
    outer = mesh_of(
        [[0, 0], [1, 0], [-0.6, 0.5], [0, -1], [1, 2], [-2, 1.5], [-1.5, -1]],
        [[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 5], [2, 5, 6], [2, 6, 3]],
    )
    assert bounds(mesh).kind.tolist() == [HELD, HELD]
    found = bounds(outer)
    (corner,) = np.flatnonzero((found.kind == CORNER) & (found.node == 0))
    assert found.angle[corner] == pytest.approx(270.0)
    assert found.bound[corner] == pytest.approx(best_with_corner(np.radians(135.0)), abs=2e-6)
    assert sorted(found.cells(corner).tolist()) == [0, 1]
    text = found.describe(corner)
    assert text.startswith("cells 0, 1 at node 0 (0, 0): 2 cells share a corner of 270° between held edges")


def test_a_node_held_by_the_user_within_free_ones():
    ring = polygon(5)
    points = np.vstack([[[0.1, 0.0]], ring, 2.0 * ring])
    triangles = [(0, 1 + i, 1 + (i + 1) % 5) for i in range(5)]
    triangles += [(1 + i, 6 + i, 6 + (i + 1) % 5) for i in range(5)]
    triangles += [(1 + i, 6 + (i + 1) % 5, 1 + (i + 1) % 5) for i in range(5)]
    held = np.zeros(11, dtype=bool)
    held[0] = True
    found = bounds(mesh_of(points, triangles), held)
    (group,) = np.flatnonzero((found.kind == CORNER) & (found.node == 0))
    assert found.angle[group] == pytest.approx(360.0)
    assert found.bound[group] == pytest.approx(best_with_corner(np.radians(72.0)), abs=2e-6)


def test_reasons():
    mesh = fan(polygon(3), centre=(0.3, 0.0))
    found = bounds(mesh)
    assert "cannot all exceed 0.6" in found.reasons([0, 2], 0.7)[0]
    assert found.reasons([0], 0.3) == {0: "no bound known"}
    wide = bounds(mesh_of([[0, 0], [1, 0], [0, 0.05]], [[0, 1, 2]]))
    (text,) = wide.reasons(np.array([0]), 0.5).values()
    assert text == f"all its nodes are held, so its 1/q stays {wide.bound[0]:.3g}"
    assert wide.describe(0) == f"cell 0: {text}"
    assert wide.reasons([0], 0.01) == {0: "all its nodes are held, so it stays as it is"}
    many = bounds(gmsnet.random_mesh(500, seed=0))
    told = many.reasons(np.arange(len(many.cell)), 0.8)
    assert sum("poor connectivity, the node has only 3 neighbours" in text for text in told.values()) >= 3
    assert any("and 5 more" in many.describe(group) for group in range(len(many.bound)))


def test_below():
    mesh = gmsnet.random_mesh(500, seed=0)
    every, few = bounds(mesh), bounds(mesh, below=0.7)
    assert few.bound.tolist() == every.bound[every.bound < 0.7].tolist()
    assert bounds(mesh, below=0.1).ceiling == 1.0


def test_real_meshes_end_at_their_ceilings(real_meshes):
    """The best of them is known to five digits where a held cell or ring sets it."""
    for name in ("japan_sea.msh", "osteonT1_11.mesh", "helmholtz_apartment.vtk", "internal.msh"):
        mesh = gmsnet.read(real_meshes / name)
        options = {"method": "optimize", "variant": "newton", "objective": "q2", "preserve": "none"}
        result = gmsnet.smooth(mesh, **options, max_sweeps=40)
        assert result.after.shape.min() == pytest.approx(bounds(mesh).ceiling, abs=1e-5)
        assert result.after.shape.min() <= bounds(mesh).ceiling + ROUNDING


@pytest.mark.parametrize("triangles", [
    [[0, 1, 2], [0, 3, 4]],  # two fans at one node
    [[0, 1, 2], [0, 1, 3], [0, 1, 4]],  # an edge of three cells
    [],
])  # fmt: skip
def test_what_is_no_simple_fan_is_left_alone(triangles):
    points = np.random.default_rng(0).random((6, 2))
    mesh = mesh_of(points, np.array(triangles, dtype=int).reshape(-1, 3))
    assert (bounds(mesh).kind == HELD).all()
