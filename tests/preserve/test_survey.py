"""The quick look misses nothing that a full search would find."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.layer_meshes import grid, heights, shaken

import gmsnet
from gmsnet.kernels.simplex.survey import BOUNDARY
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.layers import coherent
from gmsnet.preserve.survey import Survey
from gmsnet.topology.topology import Topology


def look(mesh):
    """Which nodes the quick look suspects, and which ones a full search finds."""
    topology = Topology.of(mesh)
    survey = Survey.of(mesh, topology)
    every = np.ones(len(survey.rim), dtype=bool)
    _, nodes, strong = coherent(survey.points, topology, survey.rim, every)
    found = np.zeros_like(every)
    found[nodes[strong]] = True
    return survey.suspects, found


@settings(max_examples=150, deadline=None)
@given(
    st.integers(20, 400), st.floats(1.0, 6.0), st.floats(0.0, 3.0), st.integers(0, 2**32 - 1),
    st.sampled_from([1.0, 1e-12, 1e-72, 1e-75, 1e-80, 1e-150]),
)  # fmt: skip
def test_whatever_is_found_is_suspected(nodes, factor, wave, seed, size):
    """Meshes that are stretched about as much as it takes, by more or less from place to place; tiny ones, too."""
    mesh = gmsnet.random_mesh(nodes, seed=seed % 100)
    x, y = mesh.points.T
    bent = np.column_stack([x * factor + 0.3 * wave * np.sin(5.0 * x), y + 0.2 * np.sin(wave * x)])
    throw = np.random.default_rng(seed).normal(size=bent.shape) * 0.2 / np.sqrt(nodes)
    points = np.concatenate([size * (bent + throw), [[1.0, 1.0]]])  # the last one keeps the scale
    suspects, found = look(Mesh(points, mesh.cells))
    assert (suspects | ~found).all()


@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("aspect", [3, 4, 5, 50])
def test_layers_are_suspected(aspect, noise):
    across, y = np.linspace(0.0, 2.0, 41), heights(aspect, 0.05)
    suspects, found = look(shaken(grid(across, y), across, y, noise))
    assert found.any() == (aspect > 3)
    assert (suspects | ~found).all()


def test_random_squares_have_no_suspects():
    for seed in range(3):
        suspects, found = look(gmsnet.random_mesh(20_000, seed=seed))
        assert not found.any()
        assert suspects.sum() <= 5


def test_a_node_of_very_many_cells_is_suspected():
    """Single precision may lose too much of such a sum."""
    turn = np.linspace(0.0, 2.0 * np.pi, 3000, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    count = len(turn)
    inner, outer = 1 + np.arange(count), 1 + count + np.arange(count)
    nodes = [[np.zeros_like(inner), inner, np.roll(inner, -1)], [inner, outer, np.roll(outer, -1)],
             [inner, np.roll(outer, -1), np.roll(inner, -1)]]  # fmt: skip
    triangles = np.concatenate([np.stack(corners, axis=-1) for corners in nodes])
    points = np.concatenate([[[0.0, 0.0]], ring, 1.002 * ring])
    mesh = Mesh(points, (CellBlock("triangle", triangles, np.zeros(len(triangles), dtype=int)),))
    topology = Topology.of(mesh)
    assert Survey.of(mesh, topology).suspects[topology.places[0]]


@pytest.mark.parametrize("nodes", [30, 1000])
def test_cells_beside_the_boundary_and_the_mean_area(nodes):
    mesh = gmsnet.random_mesh(nodes, seed=3)
    topology = Topology.of(mesh)
    survey = Survey.of(mesh, topology)
    held = {reason: set(ids.tolist()) for reason, ids in topology.held.items()}
    assert set(topology.memory[(survey.rim & BOUNDARY) > 0].tolist()) == held["boundary"]
    corners = [[int(topology.memory[i]) in held["boundary"] for i in row] for row in topology.near]
    assert survey.beside.tolist() == [row for row, on in enumerate(corners) if sum(on) >= 2]
    area = 0.0
    for a, b, c in topology.near:
        (ax, ay), (bx, by), (cx, cy) = survey.points[[a, b, c]]
        area += abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
    assert survey.double == pytest.approx(area / len(topology.near), rel=1e-13)


def test_nodes_between_regions_are_on_the_rim():
    across, y = np.linspace(0.0, 2.0, 21), np.linspace(-1.0, 1.0, 21)
    mesh = grid(across, y, region=lambda centre: (centre[:, 1] > 0).astype(int))
    topology = Topology.of(mesh)
    rim = Survey.of(mesh, topology).rim[topology.places]
    held = topology.held
    assert set(np.flatnonzero(rim).tolist()) == {
        *held["boundary"].tolist(), *held["interface between regions"].tolist()
    }  # fmt: skip


def test_the_rim_is_the_same_where_nodes_slide():
    """Nodes of the boundary that move along it are still of the boundary."""
    across, y = np.linspace(0.0, 2.0, 21), np.linspace(-1.0, 1.0, 21)
    mesh = grid(across, y, region=lambda centre: (centre[:, 1] > 0).astype(int))
    still, sliding = Topology.of(mesh), Topology.of(mesh, sliding=np.arange(len(mesh.points)) % 3 > 0)
    assert 0 < len(sliding.held["boundary"]) < len(still.held["boundary"])
    one, other = Survey.of(mesh, still), Survey.of(mesh, sliding)
    assert (one.rim[still.places] == other.rim[sliding.places]).all()
    assert (one.suspects[still.places] == other.suspects[sliding.places]).all()
