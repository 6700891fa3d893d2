"""What every smoother of tetrahedra must keep, whatever it proposes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes
from support.choices import CHOICES, name_of
from test_guard_levels_of_tetrahedra import IN_SPACE, every_method, takes_tetrahedra

import gmsnet
from gmsnet.errors import InputError
from gmsnet.parallel import threads as workers
from gmsnet.topology.volume import Volume

# What is more than the others gain of η on a random cube in twenty sweeps: the least, and the mean.
LESSER_GAINS = {
    "laplacian-smart": (0.0, 0.7),  # falling sums of q^(3/2) leave the worst cell to itself
    "laplacian-plain": (0.0, 0.68),
    "worst-first": (0.2, 0.66),  # leaves all but the worst cells alone
    "getme-simultaneous": (0.01, 0.68),
    "optimize-adam-metric": (0.01, 0.7),  # bounded: it gives up single cells for the mean
    "optimize-newton-metric": (0.01, 0.7),
}


@lru_cache
def random_cube(nodes, seed):
    """They are shared by all methods, which do not change them."""
    return volumes.mesh_of(*volumes.cube(nodes, seed))


@lru_cache
def large_lattice():
    return volumes.mesh_of(*volumes.lattice(27, 0.2, 1))


def test_these_methods_smooth_tetrahedra():
    assert set(map(name_of, IN_SPACE)) == {
        "auto", "barrier-q", "barrier-q2", "barrier-q4", "getme-simultaneous", "laplacian-plain", "laplacian-smart",
        "optimize-adam-metric", "optimize-adam-q", "optimize-adam-q2", "optimize-newton-metric", "optimize-newton-q",
        "optimize-newton-q2", "worst-first",
    }  # fmt: skip
    assert set(LESSER_GAINS) <= set(map(name_of, IN_SPACE))


@pytest.mark.parametrize(
    "method", [c for c in CHOICES if not takes_tetrahedra(c)], ids=lambda choice: name_of(choice)
)  # fmt: skip
def test_all_others_say_what_does(method):
    with pytest.raises(InputError, match=r"1,\d{3} tetrahedra: choose .*(auto|smart)"):
        gmsnet.smooth(random_cube(300, 5), **method)


@every_method
@given(seed=st.integers(0, 2**32 - 1), thrown=st.sampled_from([0.0, 0.2, 0.6]))
@settings(max_examples=10)
def test_nothing_valid_is_inverted_and_nothing_held_moves(method, seed, thrown):
    rng = np.random.default_rng(seed)
    points, cells = volumes.cube(int(rng.integers(30, 120)), seed)
    free = Volume.of(volumes.mesh_of(points, cells)).free
    points[free[:3]] += thrown * rng.uniform(-1, 1, (len(free[:3]), 3))
    mesh = volumes.mesh_of(points, volumes.shuffled(rng, cells))
    chosen = rng.random(len(points)) < 0.1
    result = gmsnet.smooth(mesh, **method, max_sweeps=int(rng.integers(1, 8)), fixed=chosen)
    topology = Volume.of(mesh, chosen)
    turn = topology.orientation
    before, after = (np.array(volumes.exact_signs(m.points, mesh.cells[0].nodes, turn)) for m in (mesh, result.mesh))
    assert (after[before > 0] > 0).all()
    assert result.before.sign.tolist() == before.tolist()
    assert result.after.sign.tolist() == after.tolist()
    still = np.setdiff1d(np.arange(len(points)), topology.free)
    assert mesh.points[still].tobytes() == result.points[still].tobytes()
    assert result.moved.tolist() == (result.points != mesh.points).any(axis=1).tolist()
    assert result.after.totals.shape_min >= result.before.totals.shape_min
    np.testing.assert_array_equal(result.mesh.cells[0].nodes, mesh.cells[0].nodes)


@every_method
def test_the_same_bits_for_any_number_of_threads_and_from_run_to_run(method, monkeypatch):
    monkeypatch.setattr(workers, "FEWEST_BLOCKS", 1)  # so that a mesh of this size is shared out at all
    mesh = random_cube(3000, 3)
    results = [gmsnet.smooth(mesh, **method, max_sweeps=3, threads=n).points.tobytes() for n in (1, 2, 4, 1)]
    assert len(set(results)) == 1


def test_the_same_bits_of_many_nodes():
    mesh = large_lattice()
    assert len(mesh.points) > 20_000
    results = [gmsnet.smooth(mesh, max_sweeps=4, threads=n) for n in (1, 2, 4)]
    assert len({result.points.tobytes() for result in results}) == 1
    assert results[0].after.shape.min() > results[0].before.shape.min()
    assert results[0].after.inverted == 0


@every_method
@pytest.mark.parametrize("power", [-300, -40, 300])
def test_powers_of_two_do_not_change_a_bit(method, power):
    mesh = random_cube(300, 5)
    one = gmsnet.smooth(mesh, **method, max_sweeps=2).points
    other = gmsnet.smooth(mesh.with_points(np.ldexp(mesh.points, power)), **method, max_sweeps=2).points
    assert np.ldexp(one, power).tobytes() == other.tobytes()


SAME = {
    "scaled": lambda points: points * 1e-9,
    "moved": lambda points: points + np.array([1e4, -3e3, 7.0]),
    "turned": lambda points: points @ TURN,
    "mirrored": lambda points: -points @ TURN,
    "axes": lambda points: points[:, [1, 2, 0]],
}
TURN = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]


@every_method
@pytest.mark.parametrize("case", SAME)
def test_where_a_mesh_lies_and_how_large_it_is_does_not_matter(method, case):
    """What float32 does not tell apart is judged either way, so that a node may end elsewhere; the mesh is as good."""
    mesh = random_cube(300, 8)
    one = gmsnet.smooth(mesh, **method, max_sweeps=3)
    other = gmsnet.smooth(mesh.with_points(SAME[case](mesh.points)), **method, max_sweeps=3)
    assert one.after.shape.mean() == pytest.approx(other.after.shape.mean(), abs=0.005)
    assert one.after.shape.min() == pytest.approx(other.after.shape.min(), abs=0.05)
    assert one.after.inverted == other.after.inverted == 0


@every_method
def test_the_order_and_the_orientation_of_cells_do_not_matter(method):
    mesh = random_cube(300, 7)
    rng = np.random.default_rng(0)
    mixed = volumes.shuffled(rng, rng.permutation(mesh.cells[0].nodes))
    one = gmsnet.smooth(mesh, **method, max_sweeps=3)
    other = gmsnet.smooth(volumes.mesh_of(mesh.points, mixed), **method, max_sweeps=3)
    assert one.after.shape.mean() == pytest.approx(other.after.shape.mean(), abs=0.01)
    assert one.after.shape.min() == pytest.approx(other.after.shape.min(), abs=0.1)


@every_method
def test_a_few_inverted_cells_do_not_keep_the_others_from_getting_better(method):
    mesh = random_cube(1000, 2)
    node = int(Volume.of(mesh).free[0])
    points = mesh.points.copy()
    points[node] = 0.01
    broken = mesh.with_points(points)
    result = gmsnet.smooth(broken, **method, max_sweeps=20, untangle=False)
    assert 0 < result.before.inverted < 30
    assert result.after.inverted in (result.before.inverted, 0)  # the mean of its neighbours can be a valid place
    away = ~np.isin(mesh.cells[0].nodes, mesh.cells[0].nodes[result.before.sign <= 0]).any(axis=1)
    before, after = (report.shape[away] for report in (result.before, result.after))
    if name_of(method) == "worst-first":  # meshes are compared by the worst cell, which is an inverted one
        assert sum(sweep.moved for sweep in result.history) > 20
        return
    assert result.moved.sum() > 20
    if not name_of(method).startswith("laplacian"):
        assert after.min() > before.min() + 0.02


@every_method
def test_stars_without_extent_do_no_harm(method):
    """Nodes thrown together in one point, in a line and in a plane: where a formula has no value, nothing moves."""
    mesh = random_cube(600, 9)
    topology = Volume.of(mesh)
    points, cells = mesh.points.copy(), mesh.cells[0].nodes
    inner = topology.free
    for k, node in enumerate(inner[[0, len(inner) // 2, -1]]):
        own = np.unique(cells[(cells == node).any(axis=1)])
        own = own[np.isin(own, inner)]
        points[own, k:] = points[node, k:]
    broken = mesh.with_points(points)
    result = gmsnet.smooth(broken, **method, max_sweeps=4)
    assert np.isfinite(result.points).all()
    before, after = (np.array(volumes.exact_signs(m.points, cells)) for m in (broken, result.mesh))
    assert (before <= 0).any()
    assert (after[before > 0] > 0).all()
    assert result.after.inverted == (after <= 0).sum() <= result.before.inverted == (before <= 0).sum()


@every_method
@pytest.mark.parametrize("around", [4, 5, 6, 12, 16, 17, 60, 254, 255])
def test_numbers_of_neighbours(method, around):
    points, cells = volumes.ball(np.random.default_rng(around), around, off=0.5)
    result = gmsnet.smooth(volumes.mesh_of(points, cells), **method, max_sweeps=10)
    assert result.after.inverted == 0
    assert result.after.shape.min() >= result.before.shape.min()
    assert result.moved[1:].sum() == 0
    # The way to a smaller sum may be closed by the worst cell.
    if name_of(method) in ("auto", "worst-first") and around <= 60:
        assert result.moved[0]


@every_method
def test_a_perfect_mesh_stays(method):
    """The cells of a body-centred cubic lattice are congruent; no node of it gains by a move."""
    n = 3
    corner = np.argwhere(np.ones((n + 1,) * 3)).astype(float)
    middle = np.argwhere(np.ones((n,) * 3)) + 0.5
    points = np.vstack([corner, middle])
    place = {tuple(p): i for i, p in enumerate(points.tolist())}
    cells = []
    for p in middle.tolist():
        for axis in range(3):
            other = tuple(v + (k == axis) for k, v in enumerate(p))
            if other not in place:
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            rim = []
            for a, b in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
                q = list(p)
                q[axis] += 0.5
                q[u] += a
                q[v] += b
                rim.append(place[tuple(q)])
            cells += [(place[tuple(p)], place[other], rim[k], rim[(k + 1) % 4]) for k in range(4)]
    mesh = volumes.mesh_of(points, volumes.wound(points, cells))
    assert len(Volume.of(mesh).free) > 0
    result = gmsnet.smooth(mesh, **method)
    assert result.points.tobytes() == mesh.points.tobytes()
    assert not result.moved.any()


@every_method
def test_it_makes_bad_meshes_better(method):
    gain, mean = LESSER_GAINS.get(name_of(method), (0.05, 0.68))
    result = gmsnet.smooth(random_cube(1000, 1), **method, max_sweeps=20)
    assert result.after.shape.min() >= result.before.shape.min() + gain
    assert result.after.shape.mean() > mean
    assert result.after.inverted == 0
    assert [sweep.inverted for sweep in result.history] == [0] * len(result.history)
