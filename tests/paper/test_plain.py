"""The plain methods against what their definitions say: they are what everything else is compared with."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive
from support.random_stars import star

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.generate import disturb
from gmsnet.paper import plain
from gmsnet.topology.topology import Topology

MOVES = [
    plain.laplacian,
    plain.smart_laplacian,
    plain.inverse_length_laplacian,
    plain.area_laplacian,
    plain.angle,
    plain.cvt,
    plain.cpt,
]
every_move = pytest.mark.parametrize("move", MOVES, ids=[move.__name__ for move in MOVES])
SQUARE = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]


def points_of(centre, ring):
    return tuple(map(float, centre)), [tuple(map(float, p)) for p in ring]


def stars(seed, count=50, degrees=range(3, 13)):
    rng = np.random.default_rng(seed)
    return [points_of(*star(rng, int(rng.choice(degrees)))) for _ in range(count)]


def valid_stars(seed, count=50):
    """Those of which all triangles are positive."""
    return [(x, ring) for x, ring in stars(seed, count) if min(plain.area(x, a, b) for a, b in plain.edges(ring)) > 0]


def valid_places(x, ring, rng, count=5):
    """Places of the free node at which all triangles of the star are positive."""
    found = [x]
    while len(found) < count:
        place = (x[0] + rng.normal(0, 0.1), x[1] + rng.normal(0, 0.1))
        if min(plain.area(place, a, b) for a, b in plain.edges(ring)) > 1e-3:
            found.append(place)
    return found


# ---- the moves


@every_move
@pytest.mark.parametrize("degree", [3, 4, 6, 11])
def test_the_centre_of_a_regular_polygon_stays(move, degree):
    ring = [(math.cos(2 * math.pi * k / degree), math.sin(2 * math.pi * k / degree)) for k in range(degree)]
    assert move((0.0, 0.0), ring) == pytest.approx((0.0, 0.0), abs=1e-15)


@every_move
def test_a_node_off_the_centre_of_a_square_comes_nearer(move):
    x = (0.4, 0.1)
    target = move(x, SQUARE)
    assert math.hypot(*target) < math.hypot(*x)


def test_means_by_hand():
    x, ring = (0.5, 0.0), [(2.0, 0.0), (0.5, 3.0), (-0.5, 0.0), (0.5, -1.0)]
    assert plain.laplacian(x, ring) == pytest.approx((2.5 / 4, 2.0 / 4))
    weights = [1 / 1.5, 1 / 3, 1.0, 1.0]
    wanted = np.average(ring, axis=0, weights=weights)
    assert plain.inverse_length_laplacian(x, ring) == pytest.approx(tuple(wanted))
    areas = [1.5 * 3 / 2, 3 * 1 / 2, 1 * 1 / 2, 1 * 1.5 / 2]  # right triangles
    by_areas = [areas[j - 1] + areas[j] for j in range(4)]
    assert plain.area_laplacian(x, ring) == pytest.approx(tuple(np.average(ring, axis=0, weights=by_areas)))


def test_smart_takes_the_mean_where_the_mean_q_falls_and_nothing_is_inverted():
    taken = 0
    for x, ring in valid_stars(1, 300):
        full, smart = plain.laplacian(x, ring), plain.smart_laplacian(x, ring)
        before, after = ([naive.quality(at, a, b)[2] for a, b in plain.edges(ring)] for at in (x, full))
        better = min(after) > 0 and sum(1 / s for s in after) < sum(1 / s for s in before)
        assert smart == (full if better else x)
        taken += better
    assert 50 < taken < 250


def test_smart_takes_a_tangled_star_to_the_mean_unless_something_becomes_worse():
    assert plain.smart_laplacian((3.0, 0.5), SQUARE) == (0.0, 0.0)
    bent = [(3.0, 0.0), (-1.0, 4.0), (-0.9, 0.1), (-1.0, -4.0)]  # the mean is within; x is beyond the dent
    x = (-2.0, 0.0)
    assert plain.star_aspect_ratio(x, bent) == math.inf
    assert plain.smart_laplacian(x, bent) == plain.laplacian(x, bent)
    crossed = [SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]
    x = (0.5, 0.9)
    assert plain.inverts(x, plain.laplacian(x, crossed), crossed)
    assert plain.smart_laplacian(x, crossed) == x


def test_aspect_ratios_are_those_of_the_definition():
    for x, ring in valid_stars(8):
        shapes = [naive.quality(x, a, b)[2] for a, b in plain.edges(ring)]
        assert plain.star_shape(x, ring) == pytest.approx(np.mean(shapes))
        assert plain.star_aspect_ratio(x, ring) == pytest.approx(np.mean([1 / s for s in shapes]))
    assert plain.star_aspect_ratio((2.0, 0.0), SQUARE) == math.inf
    assert plain.star_shape((0.0, 0.0), [(0.0, 0.0)] * 3) == 0.0


def test_turning_halves_the_angle_and_keeps_the_distance():
    for x, ring in valid_stars(2):
        for j in range(len(ring)):
            before, node, after = ring[j - 1], ring[j], ring[(j + 1) % len(ring)]
            turned = plain.onto_bisector(x, before, node, after)
            v = (turned[0] - node[0], turned[1] - node[1])
            assert math.dist(turned, node) == pytest.approx(math.dist(x, node))
            assert plain.angle_between(v, node, before) == pytest.approx(plain.angle_between(v, node, after))


def test_the_angle_move_is_the_mean_of_the_turned_ones():
    for x, ring in stars(3):
        turned = [plain.onto_bisector(x, ring[j - 1], ring[j], (ring + ring)[j + 1]) for j in range(len(ring))]
        assert plain.angle(x, ring) == pytest.approx(tuple(np.mean(turned, axis=0)))


def exact_product(x, a, b):
    """|T|·(C − x) with the circumcentre as the point of equal distances, in rational arithmetic."""
    (ax, ay), (bx, by) = ([Fraction(p[0]) - Fraction(x[0]), Fraction(p[1]) - Fraction(x[1])] for p in (a, b))
    twice = ax * by - ay * bx  # 2a·C = |a|², 2b·C = |b|², by Cramer's rule
    aa, bb = (ax * ax + ay * ay) / 2, (bx * bx + by * by) / 2
    cx, cy = (aa * by - bb * ay) / twice, (ax * bb - bx * aa) / twice
    assert cx * cx + cy * cy == (cx - ax) ** 2 + (cy - ay) ** 2 == (cx - bx) ** 2 + (cy - by) ** 2
    return float(abs(twice) / 2 * cx), float(abs(twice) / 2 * cy)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 1e-3, 1e-9]))
@settings(max_examples=100)
def test_area_times_circumcentre_equals_the_exact_one(seed, flatness):
    rng = np.random.default_rng(seed)
    x, a, b = (tuple(map(float, rng.normal(size=2) * (1, flatness))) for _ in range(3))
    assert plain.area_times_circumcentre(x, a, b) == pytest.approx(exact_product(x, a, b), rel=1e-9, abs=1e-15)


def test_a_flat_triangle_counts_as_the_limit_of_positive_ones():
    x, a, b = (0.0, 0.0), (1.0, 0.0), (3.0, 0.0)
    limit = exact_product(x, a, (3.0, 1e-12))
    assert plain.area_times_circumcentre(x, a, b) == pytest.approx(limit, abs=1e-10)
    assert plain.area_times_circumcentre(x, a, (3.0, -1e-12)) == pytest.approx((-limit[0], -limit[1]), abs=1e-10)


@pytest.mark.parametrize("move", [plain.cvt, plain.cpt])
def test_where_the_node_stands_in_a_valid_star_does_not_matter_to_centres_by_areas(move):
    """Both depend on the ring alone: Chen's optimal node, and the polygon's centroid."""
    rng = np.random.default_rng(4)
    for x, ring in valid_stars(5):
        targets = [move(place, ring) for place in valid_places(x, ring, rng)]
        np.testing.assert_allclose(targets, targets[:1] * len(targets), rtol=0, atol=1e-9)


def test_cpt_goes_to_the_centroid_of_the_polygon():
    for x, ring in valid_stars(6):
        centroid, total = np.zeros(2), 0.0
        for a, b in plain.edges(ring):  # triangles from the origin, which need not be in the ring
            twice = a[0] * b[1] - a[1] * b[0]
            centroid += twice * (np.array(a) + b) / 3
            total += twice
        assert plain.cpt(x, ring) == pytest.approx(tuple(centroid / total), abs=1e-12)


@every_move
def test_without_a_value_the_target_is_no_number_or_the_place(move):
    x = (0.5, 0.0)
    for ring in ([x] * 4, [x, *SQUARE], [(1.0, 0.0), (0.0, 0.0), (2.0, 0.0)]):
        target = move(x, list(ring))
        assert all(map(math.isfinite, target)) or all(map(math.isnan, target))
        assert all(map(math.isfinite, plain.truncated(x, target, list(ring))))


# ---- truncation


def test_a_shift_is_halved_until_nothing_is_negative():
    assert plain.truncated((0.0, 0.0), (3.0, 0.0), SQUARE) == (0.75, 0.0)
    assert plain.truncated((0.0, 0.0), (0.9, 0.0), SQUARE) == (0.9, 0.0)
    assert plain.truncated((0.0, 0.0), (1.0, 0.0), SQUARE) == (0.5, 0.0)  # on the rim an area is zero


def test_a_shift_that_never_fits_is_dropped():
    assert plain.truncated((1.0, 0.0), (2.0, 0.0), SQUARE) == (1.0, 0.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_target_that_is_not_finite_is_none(bad):
    assert plain.truncated((0.1, 0.2), (bad, 0.0), SQUARE) == (0.1, 0.2)
    assert plain.truncated((0.1, 0.2), (0.0, bad), SQUARE) == (0.1, 0.2)


def test_what_is_negative_may_stay_so_but_not_become_worse():
    x = (2.0, 0.0)  # beyond the right edge
    assert plain.truncated(x, (1.5, 0.0), SQUARE) == (1.5, 0.0)
    assert plain.truncated(x, (3.0, 0.0), SQUARE) == x
    assert plain.truncated(x, (0.0, 0.0), SQUARE) == (0.0, 0.0)


# ---- meshes


def test_a_plain_mesh_holds_the_free_nodes_with_their_rings_counter_clockwise():
    mesh = gmsnet.random_mesh(100, seed=1)
    plain_mesh = plain.PlainMesh.of(mesh)
    assert plain_mesh.free == Topology.of(mesh).free.tolist() == list(plain_mesh.rings)
    assert plain_mesh.array().tobytes() == mesh.points.tobytes()
    cells = {frozenset(t) for t in next(b.nodes for b in mesh.cells if b.kind == "triangle").tolist()}
    for node, ring in plain_mesh.rings.items():
        assert {frozenset((node, a, b)) for a, b in plain.edges(ring)} == {t for t in cells if node in t}
        assert all(naive.exact_area_sign(mesh.points[node], *mesh.points[list(e)]) > 0 for e in plain.edges(ring))


def test_a_mesh_in_another_plane_is_seen_in_it():
    flat = gmsnet.random_mesh(50, seed=2)
    triangles = next(b for b in flat.cells if b.kind == "triangle")
    y, z = flat.points.T
    mesh = Mesh(
        np.column_stack([np.full(len(y), 2.0), y, z]), (CellBlock("triangle", triangles.nodes, triangles.regions),)
    )
    np.testing.assert_array_equal(plain.PlainMesh.of(mesh).array(), flat.points)


def test_nodes_fixed_by_a_given_topology_are_not_free():
    mesh = gmsnet.random_mesh(100, seed=3)
    free = Topology.of(mesh).free
    fixed = np.zeros(len(mesh.points), dtype=bool)
    fixed[free[::2]] = True
    plain_mesh = plain.PlainMesh.of(mesh, Topology.of(mesh, fixed))
    assert plain_mesh.free == free[1::2].tolist()
    plain.sweep(plain_mesh, plain.laplacian)
    still = np.delete(np.arange(len(mesh.points)), free[1::2])
    assert plain_mesh.array()[still].tobytes() == mesh.points[still].tobytes()


def test_a_sweep_updates_one_node_after_the_other():
    mesh = gmsnet.random_mesh(100, seed=4)
    swept, visited = plain.PlainMesh.of(mesh), plain.PlainMesh.of(mesh)
    order = swept.free[::-1]
    assert plain.sweep(swept, plain.angle, order) == sum(plain.visit(visited, v, plain.angle) for v in order)
    assert swept.points == visited.points
    other = plain.PlainMesh.of(mesh)
    plain.sweep(other, plain.angle)
    assert other.points != swept.points


def test_visiting_tells_whether_the_node_moved():
    mesh = plain.PlainMesh([*SQUARE, (0.25, 0.0)], [4], {4: [0, 1, 2, 3]})
    assert plain.visit(mesh, 4, plain.laplacian)
    assert mesh.points[4] == (0.0, 0.0)
    assert not plain.visit(mesh, 4, plain.laplacian)


@every_move
@pytest.mark.parametrize("tangle", [0.0, 0.7])
def test_no_valid_cell_becomes_invalid(move, tangle):
    mesh = gmsnet.random_mesh(150, seed=5)
    topology = Topology.of(mesh)
    if tangle:
        mesh = disturb(mesh, topology.free, tangle, seed=1, keep_valid=False)
    twin = plain.PlainMesh.of(mesh, topology)
    before = np.array(naive.signs(mesh.points, topology.triangles, topology.orientation))
    assert (before <= 0).any() == (tangle > 0)
    for _ in range(5):
        plain.sweep(twin, move)
    after = np.array(naive.signs(twin.array(), topology.triangles, topology.orientation))
    assert (after[before > 0] > 0).all()
    assert (after > 0).sum() >= (before > 0).sum()
