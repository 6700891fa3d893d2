"""Paths of boundaries, how much they turn, and how the inside follows; beside slow twins."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gmsnet.generate import layered_mesh, random_mesh, structured_mesh
from gmsnet.motion.path import Path, as_complex
from gmsnet.motion.prescribed import Prescribed
from gmsnet.motion.rigid import Follower
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology


def boundary(topology):
    return topology.held["boundary"]


def carried(mesh, topology, prescribed):
    """The path of a mesh, and the points and turns of its end."""
    near = near_points(mesh, topology)
    path = Path.of(prescribed, topology, near, mesh.exponent)
    z = as_complex(near)
    nothing = np.zeros(len(z), dtype=bool)
    follower = Follower.of(topology, z, path.end != path.start, nothing)
    a, b = follower.edges.T
    points, turned = follower.follow(z, np.zeros(len(z)), z[b] - z[a], path.end, path.turns(1.0), path.sure)
    return path, follower, points, turned


@settings(max_examples=25)
@given(
    st.floats(-3.1, 3.1), st.complex_numbers(max_magnitude=20.0, allow_nan=False), st.sampled_from(["tri", "quad"]),
    st.integers(0, 3),
)  # fmt: skip
def test_a_motion_of_the_whole_boundary_as_one_body_is_reproduced(angle, shift, kind, seed):
    mesh = random_mesh(60, seed=seed) if kind == "tri" else structured_mesh(6, 5)
    topology = Topology.of(mesh)
    z = as_complex(mesh.points[:, :2])
    wanted = cmath.exp(1j * angle) * z + shift
    ids = boundary(topology)
    places = np.column_stack([wanted.real, wanted.imag])
    _, _, points, turned = carried(mesh, topology, Prescribed.of(mesh, places=places[ids], nodes=ids))
    scale = 2.0**mesh.exponent
    off = np.abs(points * scale - wanted[topology.memory])
    assert off.max() <= 1e-12 * (1.0 + abs(shift))
    assert np.abs(np.exp(1j * turned) - cmath.exp(1j * angle)).max() <= 1e-11


def test_a_step_is_the_least_squares_solution_of_a_slow_twin():
    mesh = random_mesh(40, seed=5)
    topology = Topology.of(mesh)
    ids = mesh.markers["top"]
    _, follower, points, turned = carried(mesh, topology, Prescribed.of(mesh, (0.1, 0.2), ids))
    z = as_complex(near_points(mesh, topology))
    free = np.flatnonzero(topology.near_free)
    rows, right = [], []
    for (a, b), stiffness in zip(follower.edges.tolist(), follower.stiffness.tolist(), strict=True):
        way, row = z[b] - z[a], np.zeros(len(z), dtype=complex)
        root = math.sqrt(stiffness) / abs(way)
        row[b], row[a] = root, -root
        rows.append(row)
        right.append(root * cmath.exp(0.5j * (turned[a] + turned[b])) * way)
    system, right = np.array(rows), np.array(right)
    held = np.setdiff1d(np.arange(len(z)), free)
    found = np.linalg.lstsq(system[:, free], right - system[:, held] @ points[held], rcond=None)[0]
    assert np.abs(points[free] - found).max() <= 1e-10


@pytest.mark.parametrize("degrees", [30.0, 90.0, 180.0, 270.0, -540.0])
def test_a_body_goes_along_an_arc_and_turns_as_asked(degrees):
    mesh = layered_mesh(3, 10.0, 30)
    topology = Topology.of(mesh)
    prescribed = Prescribed.of(mesh, (1.0, 2.0), "airfoil", rotate=("airfoil", degrees, (0.25, 0.0)))
    path = Path.of(prescribed, topology, near_points(mesh, topology), mesh.exponent)
    moved = np.zeros(len(topology.memory), dtype=bool)
    moved[mesh.markers["airfoil"]] = True
    moved = moved[topology.memory]
    assert len(path.bodies) == 1
    for share in (0.0, 0.25, 0.5, 1.0):
        places, turns = path.places(share), path.turns(share)
        assert turns[moved] == pytest.approx(math.radians(share * degrees), abs=1e-6)
        assert (turns[topology.near_ringed] == 0.0).all()
        apart = np.abs(np.subtract.outer(places[moved], places[moved]))
        assert apart == pytest.approx(np.abs(np.subtract.outer(path.start[moved], path.start[moved])), abs=1e-9)
        assert (places[~moved] == path.start[~moved]).all()
    by_id = np.empty((len(places), 2))
    by_id[topology.memory] = np.column_stack([places.real, places.imag]) * 2.0**mesh.exponent
    assert (by_id == prescribed.places).all()


def test_a_bend_beyond_half_a_turn_is_told_along_the_boundary():
    mesh = structured_mesh(40, 4)
    topology = Topology.of(mesh)
    ids, angle = boundary(topology), 1.6 * math.pi
    x, y = mesh.points[ids, :2].T
    radius = 1.0 / angle - 0.1 * (y - 0.5)
    places = np.column_stack([radius * np.sin(angle * x), -radius * np.cos(angle * x)])
    path = Path.of(Prescribed.of(mesh, places=places, nodes=ids), topology, near_points(mesh, topology), mesh.exponent)
    order = np.empty(len(topology.memory), dtype=int)
    order[topology.memory] = np.arange(len(order))
    turns = path.turns(1.0)[order[ids]]
    turns += 2.0 * math.pi * round(float(np.mean(angle * x - turns)) / (2.0 * math.pi))
    inner = (x > 0.1) & (x < 0.9)
    assert np.abs(turns - angle * x)[inner].max() < 0.1


def test_layers_keep_their_spacing_around_a_wall_that_turns():
    mesh = layered_mesh(10, 100.0, 60)
    topology = Topology.of(mesh)
    near = near_points(mesh, topology)
    path = Path.of(Prescribed.of(mesh, rotate=("airfoil", 30, (0.25, 0.0))), topology, near, mesh.exponent)
    z = as_complex(near)
    layers = np.arange(len(z)) < 11 * 60
    follower = Follower.of(topology, z, path.end != path.start, layers[topology.memory])
    a, b = follower.edges.T
    points, _ = follower.follow(z, np.zeros(len(z)), z[b] - z[a], path.end, path.turns(1.0), path.sure)
    by_id = np.empty(len(z), dtype=complex)
    by_id[topology.memory] = points
    spacing = np.abs(np.diff(by_id[layers].reshape(11, 60), axis=0))
    before = np.abs(np.diff(as_complex(mesh.points[layers, :2]).reshape(11, 60), axis=0)) / 2.0**mesh.exponent
    assert np.abs(spacing / before - 1.0).max() < 0.01
