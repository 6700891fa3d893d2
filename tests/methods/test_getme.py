"""GETMe: its steps and sweeps against the plain twin, its rules one by one. tests/kernels: its transformation."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.generate import disturb
from gmsnet.kernels.methods import getme as kernels
from gmsnet.kernels.star.block import DROPPED, MOVED
from gmsnet.kernels.star.guard import Precision, plain_guard
from gmsnet.methods import getme
from gmsnet.methods.base import Field
from gmsnet.paper import plain_getme
from gmsnet.paper.plain import PlainMesh
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

SETTINGS = {  # θ, λ, ρ, η
    "sequential": (math.pi / 3, 0.0, 1.0, 0),
    "simultaneous": (math.pi / 3, 0.0, 1.0, 2),
    "sequential-book": (math.pi / 4, 0.5, 0.01, 0),
    "simultaneous-book": (math.pi / 4, 0.5, 1.0, 0),
}
SEQUENTIAL = [name for name in SETTINGS if name.startswith("sequential")]


def mesh_of(points, triangles):
    triangles = np.asarray(triangles)
    return Mesh(np.asarray(points, dtype=float), (CellBlock("triangle", triangles, np.zeros(len(triangles), int)),))


def tangled(nodes, seed):
    mesh = gmsnet.random_mesh(nodes, seed=seed)
    return disturb(mesh, Topology.of(mesh).free, 0.5, seed=seed, keep_valid=False)


def field_of(mesh):
    topology = Topology.of(mesh)
    precision = Precision.of(single=mesh.single, exponent=mesh.exponent)
    return Field(planar_points(mesh)[topology.memory], topology, precision)


def guard_of(field):
    return plain_guard(field.precision)


def in_file_order(field, mesh):
    points = np.empty_like(field.points)
    points[field.topology.memory] = np.ldexp(field.points, mesh.exponent)
    return points


def star_sizes(mesh, topology):
    """(F, 1) the larger side of each star's bounding box."""
    start, ring = topology.patches
    stars = [np.append(ring[start[k] : start[k + 1]], node) for k, node in enumerate(topology.free)]
    return np.array([[np.ptp(mesh.points[star], axis=0).max()] for star in stars])


def test_the_variants_have_these_parameters():
    for name, (theta, weight, rho, eta) in SETTINGS.items():
        c1 = (1 - weight) * math.tan(theta)
        c2 = weight * (1 - weight) - c1**2
        found = getme.TRANSFORMATIONS[name]
        assert found == pytest.approx((1 - 3 * c2, c1, rho, eta, 0.5, 0.0), rel=1e-15, abs=1e-15)
    assert list(SETTINGS) == list(gmsnet.METHODS["getme"].variants)


# ------------------------------------------------------------------------------------------------ sequential


@pytest.mark.parametrize("name", SEQUENTIAL)
@pytest.mark.parametrize("make", [gmsnet.random_mesh, tangled], ids=["random", "tangled"])
def test_step_by_step_it_is_the_plain_one(name, make):
    total = np.zeros(3, dtype=np.int64)
    for seed in range(5):
        mesh = make(200, seed=seed)
        field = field_of(mesh)
        elements = getme.elements_of(field.topology)
        queue = getme.queue_of(field.points, elements)
        twin = plain_getme.PlainGetme(PlainMesh.of(mesh), *SETTINGS[name][:3])
        assert len(elements.corners) == len(twin.elements)
        tally, nodes = np.zeros(3, dtype=np.int64), 0
        for count in (1, 2, 2997):
            kernels.steps(field.points, elements, queue, getme.TRANSFORMATIONS[name], guard_of(field), count, tally)
            nodes += sum(twin.step() for _ in range(count))
            off = (in_file_order(field, mesh) - twin.mesh.array())[field.topology.free]
            assert (abs(off) <= 1e-9 * star_sizes(mesh, field.topology)).all()
            np.testing.assert_allclose(np.sort(queue.shape), np.sort(twin.shapes), rtol=0, atol=1e-9)
            np.testing.assert_allclose(np.sort(queue.penalty), np.sort(twin.penalties), rtol=0, atol=1e-12)
        assert tally[MOVED] + tally[DROPPED] == nodes
        total += tally
    assert total[MOVED] > 400
    cautious = name == "sequential-book" and make is gmsnet.random_mesh  # a hundredth of a step breaks nothing there
    assert total[DROPPED] == 0 if cautious else total[DROPPED] > 1000


def hopeless():
    """A flat triangle below a free node that cannot rise: another flat one hangs from the ceiling just above."""
    points = [(0, 0), (10, 0), (10, 0.2), (0, 0.2), (5, 0.1)]
    return mesh_of(points, [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])


def test_penalties_of_an_element_that_is_put_back():
    mesh = hopeless()
    field = field_of(mesh)
    elements = getme.elements_of(field.topology)
    queue = getme.queue_of(field.points, elements)
    first = int(queue.heap[0])
    tally = np.zeros(3, dtype=np.int64)
    before = field.points.copy()
    for count in range(1, 6):
        kernels.steps(field.points, elements, queue, getme.TRANSFORMATIONS["sequential"], guard_of(field), 1, tally)
        # Its twin on the other side of the node is as bad, so they take orientations: never twice running.
        assert queue.penalty.sum() == pytest.approx(count * 1e-4)
        assert tally.tolist() == [0, 0, count]
    assert queue.penalty[first] == pytest.approx(3e-4)
    queue.penalty[:] = [0.0 if e == first else 1.0 for e in range(4)]
    queue.key[:] = queue.shape + queue.penalty  # all are valid
    kernels.build(queue.heap, queue.place, queue.key)
    queue.memory[kernels.LAST] = -1
    kernels.steps(field.points, elements, queue, getme.TRANSFORMATIONS["sequential"], guard_of(field), 10, tally)
    assert queue.penalty[first] == pytest.approx(10 * 1e-4 + 9 * 1e-5)
    np.testing.assert_array_equal(field.points, before)


def test_success_takes_from_the_penalty_but_never_below_nothing():
    mesh = gmsnet.random_mesh(50, seed=2)
    field = field_of(mesh)
    elements = getme.elements_of(field.topology)
    for start, after in ((0.0, 0.0), (4e-4, 0.0), (5e-3, 4e-3)):
        points = field.points.copy()
        queue = getme.queue_of(points, elements)
        first, tally = int(queue.heap[0]), np.zeros(3, dtype=np.int64)
        queue.penalty[:] = start
        queue.key[:] = queue.shape + queue.penalty
        book = getme.TRANSFORMATIONS["sequential-book"]
        kernels.steps(points, elements, queue, book, guard_of(field), 1, tally)
        assert tally[DROPPED] == 0
        assert tally[MOVED] >= 1
        assert queue.penalty[first] == pytest.approx(after, abs=1e-15)
        assert (np.delete(queue.penalty, first) == start).all()


def test_only_elements_with_a_free_node_take_part_in_canonical_order():
    mesh = gmsnet.random_mesh(100, seed=4)
    triangles = next(block.nodes for block in mesh.cells if block.kind == "triangle")
    topology = Topology.of(mesh)
    elements = getme.elements_of(topology)
    free = np.isin(triangles, topology.free).any(axis=1)
    assert 0 < len(elements.corners) == free.sum() < len(triangles)
    found = {frozenset(topology.memory[c].tolist()) for c in elements.corners}
    assert found == {frozenset(t.tolist()) for t in triangles[free]}
    for node in range(len(mesh.points)):
        around = elements.around[elements.start[node] : elements.start[node + 1]]
        assert around.tolist() == [e for e, corners in enumerate(elements.corners) if node in corners]
    assert (elements.corners.argmin(axis=1) == 0).all()
    rows = elements.corners.tolist()
    assert rows == sorted(rows)


@pytest.mark.parametrize("name", SEQUENTIAL)
def test_the_same_bits_for_any_order_of_cells_and_corners(name):
    mesh = gmsnet.random_mesh(300, seed=7)
    triangles = next(block.nodes for block in mesh.cells if block.kind == "triangle")
    rng = np.random.default_rng(0)
    mixed = np.array([np.roll(t[:: rng.choice([1, -1])], rng.integers(3)) for t in rng.permutation(triangles)])
    one, other = (gmsnet.smooth(mesh_of(mesh.points, t), "getme", variant=name).points for t in (triangles, mixed))
    assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize(("nodes", "steps", "tests"), [(1, 100, 1), (60, 100, 1), (260, 300, 3), (2990, 2990, 10)])
def test_a_sweep_is_a_step_for_each_free_node_in_whole_periods(nodes, steps, tests, monkeypatch):
    field = field_of(gmsnet.random_mesh(nodes, seed=1))
    assert len(field.topology.free) == nodes
    made, asked = [], []
    original = kernels.steps

    def counted(*arguments):
        made.append(arguments[-2])
        original(*arguments)

    monkeypatch.setattr(getme.kernels, "steps", counted)
    smoother = gmsnet.methods.smoother("getme")
    smoother.sweep(field, serial, lambda: asked.append(True) or True)
    assert sum(made) == steps
    assert len(asked) == tests
    assert not smoother.converged


def test_it_settles_after_twenty_tests_without_gain():
    field = field_of(gmsnet.random_mesh(1000, seed=1))
    smoother = gmsnet.methods.smoother("getme", variant="sequential-book")
    answers = iter([False] * 19 + [True] + [False] * 20 + [True])
    sweeps = 0
    while not smoother.converged:
        smoother.sweep(field, serial, lambda: next(answers))
        sweeps += 1
    assert sweeps == 4
    assert list(answers) == [True]


def test_a_run_ends_where_nothing_can_be_done():
    mesh = hopeless()
    result = gmsnet.smooth(mesh, "getme", max_sweeps=10**6)
    assert result.stop_reason == "no further gain"
    assert result.sweeps <= 21
    assert result.points.tobytes() == mesh.points.tobytes()


# ------------------------------------------------------------------------------------------------ simultaneous


@pytest.mark.parametrize("name", ["simultaneous", "simultaneous-book"])
@pytest.mark.parametrize("make", [gmsnet.random_mesh, tangled], ids=["random", "tangled"])
def test_sweep_by_sweep_it_is_the_plain_one(name, make):
    mesh = make(200, seed=3)
    field = field_of(mesh)
    twin = PlainMesh.of(mesh)
    blocks = field.topology.stars.blocks
    lanes = blocks.centre.reshape(len(blocks.filled), -1)
    order = [int(field.topology.memory[v]) for row, n in zip(lanes, blocks.filled, strict=True) for v in row[:n]]
    smoother = gmsnet.methods.smoother("getme", variant=name)
    for _ in range(5):
        tally = smoother.sweep(field, serial, lambda: True)
        moved = plain_getme.simultaneous(twin, *SETTINGS[name], order)
        assert tally[MOVED] == moved > 0
        off = (in_file_order(field, mesh) - twin.array())[field.topology.free]
        assert (abs(off) <= 1e-9 * star_sizes(mesh, field.topology)).all()


@pytest.mark.parametrize("name", SETTINGS)
def test_what_single_precision_keeps_is_what_was_judged(name):
    mesh = gmsnet.random_mesh(300, seed=5)
    mesh = Mesh(np.float64(np.float32(mesh.points)), mesh.cells, single=True)
    result = gmsnet.smooth(mesh, "getme", variant=name, max_sweeps=10)
    assert result.moved.any()
    np.testing.assert_array_equal(result.points, np.float64(np.float32(result.points)))
    assert result.before.inverted == result.after.inverted == 0


# ------------------------------------------------------------------------------------------------ tangled meshes


@pytest.mark.parametrize("name", SETTINGS)
def test_tangled_meshes_come_to_an_end_and_get_no_worse(name):
    for seed in range(3):
        mesh = tangled(300, seed)
        result = gmsnet.smooth(mesh, "getme", variant=name, max_sweeps=1000)
        assert result.stop_reason == "no further gain"
        was, now = result.before.valid, result.after.valid
        assert (~was).sum() > 20
        assert now[was].all()
        assert (~now).sum() < (~was).sum()
