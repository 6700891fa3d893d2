"""The compiled classical methods against the plain ones of paper.plain, star by star and sweep by sweep."""

from __future__ import annotations

import numpy as np
import pytest
from support import naive
from support.random_stars import proposed, size, star

import gmsnet
from gmsnet.generate import disturb
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import angle, cvt, laplacian, laplacian_plain
from gmsnet.kernels.star import block
from gmsnet.kernels.star.guard import Precision
from gmsnet.methods import Field, smoother
from gmsnet.paper import plain
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

ROW = np.empty(laplacian.ROWS * LANES)


def plain_mean(local, n, shift):
    """The plain form knows no local coordinates: pairs that have their free node at the origin."""
    star = np.zeros((n + 1, LANES, 2))
    star[1:] = local.reshape(n, 2, LANES).swapaxes(1, 2)
    pairs = np.empty(2 * LANES)
    laplacian_plain.aim(star.ravel(), n, None, False, pairs, np.empty(block.FLOORS * LANES))
    shift[:] = pairs.reshape(LANES, 2).T.ravel()


TWINS = {  # method and variant → (compiled proposal, plain one)
    ("laplacian", "smart"): (
        lambda local, n, shift: laplacian.propose(local, n, None, laplacian.SMART, 0.0, ROW, shift),
        plain.smart_laplacian,
    ),
    ("laplacian", "plain"): (plain_mean, plain.laplacian),
    ("laplacian", "inverse-length"): (
        lambda local, n, shift: laplacian.propose(local, n, None, laplacian.INVERSE_LENGTH, 0.0, ROW, shift),
        plain.inverse_length_laplacian,
    ),
    ("laplacian", "area"): (
        lambda local, n, shift: laplacian.propose(local, n, None, laplacian.AREA, 0.0, ROW, shift),
        plain.area_laplacian,
    ),
    ("angle", None): (angle.propose, plain.angle),
    ("cvt", None): (lambda local, n, shift: cvt.circumcentres(local, n, ROW, shift), plain.cvt),
    ("cpt", None): (lambda local, n, shift: cvt.centroids(local, n, ROW, shift), plain.cpt),
}
every_method = pytest.mark.parametrize("method", TWINS, ids=["-".join(filter(None, name)) for name in TWINS])


def plain_shifts(stars, move):
    out = []
    for centre, ring in stars:
        x = tuple(map(float, centre))
        target = move(x, [tuple(map(float, p)) for p in ring])
        out.append((target[0] - x[0], target[1] - x[1]))
    return np.array(out)


def assert_equal_twins(method, stars):
    compiled, move = TWINS[method]
    sizes = np.array([size(*s) for s in stars])[:, None]
    found, wanted = proposed(stars, compiled), plain_shifts(stars, move)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found / sizes, wanted / sizes, rtol=0, atol=1e-9)
    return found / sizes


@every_method
def test_degrees_from_3_to_100(method):
    rng = np.random.default_rng(1)
    shifts = assert_equal_twins(method, [star(rng, degree) for degree in range(3, 101) for _ in range(5)])
    assert (shifts != 0).any(axis=1).mean() > 0.3  # a smart one stays where a fan of needles would suffer


@every_method
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e3, 1e5])
def test_sizes_and_places(method, scale, offset):
    rng = np.random.default_rng(2)
    assert_equal_twins(method, [star(rng, degree, scale, offset) for degree in range(3, 21) for _ in range(10)])


@every_method
def test_tangled_stars(method):
    """The free node outside of its ring, and rings that cross themselves."""
    rng = np.random.default_rng(3)
    stars = [star(rng, degree) for degree in range(3, 21) for _ in range(20)]
    stars = [(c + 2 * rng.normal(size=2), r) for c, r in stars]
    stars += [(c, r[rng.permutation(len(r))]) for c, r in stars]
    assert_equal_twins(method, stars)


@every_method
@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
def test_nearly_flat_triangles(method, gap):
    """The free node on a rim edge of its ring, or on the line through it, but for a gap to either side."""
    rng = np.random.default_rng(4)
    stars = []
    for degree in range(3, 21):
        for along in (-0.7, 0.2, 0.5, 1.6):
            for side in (-1, 1):
                _, ring = star(rng, degree)
                a, b = ring[0], ring[1]
                normal = np.array([a[1] - b[1], b[0] - a[0]])
                stars.append((a + along * (b - a) + side * gap * normal, ring))
    assert_equal_twins(method, stars)


@every_method
def test_exactly_flat_triangles_and_edges_without_length(method):
    square = np.array([(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
    stars = [
        (np.array([1.0, 0.5]), square),  # on a rim edge
        (np.array([2.0, -1.0]), square),  # on the line through one
        (np.array([0.0, 0.0]), np.repeat(square, 2, axis=0)),  # every other rim edge has no length
        (np.array([0.25, 0.0]), np.array([(1.0, 0.0), (2.0, 0.0), (0.5, 1.0), (-1.0, 0.0), (0.5, -1.0)])),
    ]
    assert_equal_twins(method, stars)


@every_method
def test_where_the_formula_has_no_value_none_is_proposed(method):
    """The free node on a neighbour, a star on one line, a star in one point: the proposal is zero or no number."""
    compiled, move = TWINS[method]
    on_neighbour = np.array([1.0, 0.0]), np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
    line = np.array([0.5, 0.0]), np.array([(1.0, 0.0), (0.0, 0.0), (2.0, 0.0), (-1.0, 0.0)])
    point = np.zeros(2), np.zeros((5, 2))
    stars = [on_neighbour, line, point]
    found, wanted = proposed(stars, compiled), plain_shifts(stars, move)
    np.testing.assert_array_equal(np.isfinite(found).all(axis=1), np.isfinite(wanted).all(axis=1))
    finite = np.isfinite(found).all(axis=1)
    np.testing.assert_allclose(found[finite], wanted[finite], rtol=0, atol=1e-9)
    assert (found[2][finite[2:].repeat(2)] == 0).all()


@every_method
def test_where_the_ring_begins_does_not_matter(method):
    rng = np.random.default_rng(5)
    compiled, _ = TWINS[method]
    for degree in (3, 6, 17):
        centre, ring = star(rng, degree)
        shifts = proposed([(centre, np.roll(ring, k, axis=0)) for k in range(degree)], compiled)
        np.testing.assert_allclose(shifts, shifts[:1].repeat(degree, axis=0), rtol=0, atol=1e-14)


@every_method
@pytest.mark.parametrize("tangle", [0.0, 0.7])
def test_a_sweep_is_the_plain_sweep_in_the_order_of_the_colours(method, tangle):
    """Guard, truncation and sequential updating included, on valid and on tangled meshes."""
    mesh = gmsnet.random_mesh(400, seed=9)
    topology = Topology.of(mesh)
    if tangle:
        mesh = disturb(mesh, topology.free, tangle, seed=1, keep_valid=False)
        assert gmsnet.quality(mesh).inverted > 5
    field = Field(planar_points(mesh)[topology.memory], topology, Precision())
    name, variant = method
    smoother(name, variant=variant).sweep(field, serial, lambda: True)
    compiled = np.empty_like(field.points)
    compiled[topology.memory] = np.ldexp(field.points, mesh.exponent)

    blocks = topology.stars.blocks
    lanes = [b * LANES + lane for b, filled in enumerate(blocks.filled) for lane in range(filled)]
    twin = plain.PlainMesh.of(mesh, topology)
    moved = plain.sweep(twin, TWINS[method][1], topology.memory[blocks.centre[lanes]].tolist())
    assert moved > 100
    np.testing.assert_allclose(compiled, twin.array(), rtol=0, atol=1e-9)


def test_smart_moves_lower_the_mean_q_of_their_star_and_invert_nothing():
    rng = np.random.default_rng(6)
    stars = [star(rng, degree) for degree in range(3, 13) for _ in range(50)]
    shifts = proposed(stars, TWINS["laplacian", "smart"][0])
    full = proposed(stars, TWINS["laplacian", "plain"][0])
    stays = (shifts == 0).all(axis=1)
    assert 0.02 < stays.mean() < 0.6
    np.testing.assert_array_equal(shifts[~stays], full[~stays])
    judged = 0
    for (centre, ring), shift, stay in zip(stars, full, stays, strict=True):

        def shapes(at, ring=ring):
            return [naive.quality(at, ring[j - 1], ring[j])[2] for j in range(len(ring))]

        before, after = shapes(centre), shapes(centre + shift)
        if min(before) > 0:
            judged += 1
            better = min(after) > 0 and sum(1 / s for s in after) < sum(1 / s for s in before)
            assert stay != better
    assert judged > 400


def test_a_tangled_star_takes_the_mean_that_untangles_it():
    ring = np.array([(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
    found = proposed([(np.array([3.0, 0.5]), ring)], TWINS["laplacian", "smart"][0])
    np.testing.assert_allclose(found, [[-3.0, -0.5]], rtol=1e-15)


def test_weights_by_area_are_centroids_with_half_as_much_again():
    rng = np.random.default_rng(7)
    stars = [star(rng, degree) for degree in range(3, 13) for _ in range(5)]
    area, cpt = (proposed(stars, TWINS[name][0]) for name in (("laplacian", "area"), ("cpt", None)))
    np.testing.assert_allclose(area, 1.5 * cpt, rtol=1e-12)


def test_summaries_and_defaults():
    assert gmsnet.METHODS["laplacian"].variants == ("smart", "plain", "inverse-length", "area")
    mesh = gmsnet.random_mesh(200, seed=1)
    default = gmsnet.smooth(mesh, "laplacian", max_sweeps=3).points
    assert default.tobytes() == gmsnet.smooth(mesh, "laplacian", variant="smart", max_sweeps=3).points.tobytes()
    others = {gmsnet.smooth(mesh, *name[:1], variant=name[1], max_sweeps=3).points.tobytes() for name in TWINS}
    assert len(others) == len(TWINS)
