"""Which nodes are to go where, in all the forms that users give it, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet import CellBlock, InputError, Mesh, random_mesh
from gmsnet.generate import random_volume
from gmsnet.motion.prescribed import Prescribed


@pytest.fixture(scope="module")
def square():
    return random_mesh(50, seed=1)


def test_one_vector_moves_all_nodes_of_a_marker(square):
    made = Prescribed.of(square, (0.5, -1.0), "top")
    ids = square.markers["top"]
    assert np.flatnonzero(made.moved).tolist() == ids.tolist()
    assert (made.places[ids] == square.points[ids, :2] + [0.5, -1.0]).all()
    others = ~made.moved
    assert (made.places[others] == square.points[others, :2]).all()


def test_rows_belong_to_the_ids_in_their_order(square):
    made = Prescribed.of(square, [(1.0, 0.0), (0.0, 2.0)], [7, 3])
    assert (made.places[7] - square.points[7, :2]).tolist() == [1.0, 0.0]
    assert (made.places[3] - square.points[3, :2]).tolist() == [0.0, 2.0]


def test_rows_for_every_node_move_those_that_are_not_zero(square):
    shifts = np.zeros((len(square.points), 2))
    shifts[[4, 9]] = 0.25
    assert np.flatnonzero(Prescribed.of(square, shifts).moved).tolist() == [4, 9]


def test_places_are_taken_bit_for_bit(square):
    places = np.random.default_rng(0).normal(size=(2, 2)) * 1e-3
    made = Prescribed.of(square, nodes=[5, 2], places=places)
    assert (made.places[[5, 2]] == places).all()
    every = square.points[:, :2].copy()
    every[8] += 0.1
    assert np.flatnonzero(Prescribed.of(square, places=every).moved).tolist() == [8]


def test_rotations_come_before_displacements_and_quarter_turns_are_exact(square):
    ids = square.markers["left"]
    made = Prescribed.of(square, (1.0, 0.0), "left", rotate=("left", 90, (0.0, 0.0)))
    x, y = square.points[ids, :2].T
    assert (made.places[ids] == np.column_stack([1.0 - y, x])).all()
    assert made.turn[ids] == pytest.approx(np.pi / 2)
    several = Prescribed.of(square, rotate=[("left", 30.0, (0, 0)), ("right", -30.0, (1, 0))])
    assert several.moved.sum() == len(ids) + len(square.markers["right"])


def test_shifts_in_another_plane():
    points = np.array([[0.0, 5.0, 0.0], [1.0, 5.0, 0.0], [0.0, 5.0, 1.0]])
    mesh = Mesh(points, (CellBlock("triangle", np.array([[0, 1, 2]]), np.zeros(1, dtype=int)),))
    assert (Prescribed.of(mesh, (1.0, 0.0, 2.0), [1]).places[1] == [2.0, 2.0]).all()
    assert (Prescribed.of(mesh, (1.0, 2.0), [1]).places[1] == [2.0, 2.0]).all()
    with pytest.raises(InputError, match="out of the plane of the mesh, in which y does not vary: give 0"):
        Prescribed.of(mesh, (1.0, 1.0, 2.0), [1])
    with pytest.raises(InputError, match="give 5 as its y"):
        Prescribed.of(mesh, places=[(1.0, 1.0, 2.0)], nodes=[1])


def test_single_precision_places_are_those_that_the_mesh_can_hold(square):
    single = Mesh(square.points.astype(np.float32), square.cells, square.region_names, single=True)
    made = Prescribed.of(single, (0.1, 0.3), "top")
    assert (made.places.astype(np.float32) == made.places).all()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "nothing to move"),
        ({"nodes": "top"}, "neither a displacement nor places"),
        ({"displacement": (1, 2), "nodes": "roof"}, "no marker 'roof'"),
        ({"displacement": (1, 2), "nodes": [0, 10**6]}, "nodes names the node 1000000"),
        ({"displacement": (1, 2), "nodes": [0.5]}, "nodes must be node ids"),
        ({"displacement": (1, 2)}, "one row of 2 numbers for each of the .* nodes of the mesh"),
        ({"displacement": [(1, 2, 3, 4)], "nodes": [0]}, "got the shape"),
        ({"displacement": [(1, 2), (3, 4)], "nodes": [0, 1, 2]}, "each of the 3 nodes named"),
        ({"displacement": [(1, 2), (3, 4)], "nodes": [5, 5]}, "node 5 more than once"),
        ({"displacement": (np.nan, 0), "nodes": [0]}, "finite numbers; row 0"),
        ({"displacement": ("a", "b"), "nodes": [0]}, "must be numbers"),
        ({"rotate": ("top", 180, (1e308, 0))}, "no finite number"),
        ({"displacement": (1, 0), "nodes": [0], "places": [(0, 0)]}, "give one of them"),
        ({"places": [(0, 0)], "nodes": [0], "rotate": ("top", 3, (0, 0))}, "leave rotate out"),
        ({"rotate": ("top", 3)}, "a rotation must be"),
        ({"rotate": "top"}, "a rotation must be"),
        ({"rotate": ("top", float("inf"), (0, 0))}, "finite numbers"),
        ({"rotate": ("top", "3", (0, 0))}, "finite numbers"),
    ],
)
def test_what_cannot_be_used_is_refused(square, given, message):
    with pytest.raises(InputError, match=message):
        Prescribed.of(square, **given)


def test_zero_everywhere_is_nothing(square):
    with pytest.raises(InputError, match="nothing to move"):
        Prescribed.of(square, np.zeros((len(square.points), 2)))


def test_rotations_of_volumes_are_about_an_axis():
    cube = random_volume(30, seed=1)
    ids = cube.markers["top"]
    made = Prescribed.of(cube, (0.0, 0.0, 1.0), ids, rotate=(ids, 90, (0, 0, 1), (0, 0, 3)))
    x, y, z = cube.points[ids].T
    assert (made.places[ids] == np.column_stack([-y, x, z + 1.0])).all()
    assert made.turn[ids] == pytest.approx(np.tile([0.0, 0.0, np.pi / 2], (len(ids), 1)))
    twice = Prescribed.of(cube, rotate=[(ids, 200.0, (0, 0, 0), (1, 0, 0)), (ids, 200.0, (0, 0, 0), (1, 0, 0))])
    assert twice.turn[ids] == pytest.approx(np.tile([np.radians(400.0), 0.0, 0.0], (len(ids), 1)))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rotate": ("top", 3, (0, 0))}, "a rotation of a volume must be"),
        ({"rotate": ("top", 3, (0, 0, 0))}, "a rotation of a volume must be"),
        ({"rotate": ("top", 3, (0, 0, 0), (0, 0, 0))}, "axis of a rotation must have a length"),
        ({"rotate": ("top", 3, (0, 0, 0), (0, 0, float("nan")))}, "finite numbers"),
        ({"displacement": (1, 2), "nodes": "top"}, "one vector of 3 numbers"),
    ],
)
def test_what_volumes_do_not_take_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        Prescribed.of(random_volume(30, seed=1), **given)
