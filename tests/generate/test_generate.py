from __future__ import annotations

import json

import numpy as np
import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import SHAPES, disturb, random_mesh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

POLYGON = [
    [[0, 0], [3, 0.1], [3.3, 2], [1.5, 1], [0.1, 2]],
    [[0.5, 0.5], [1, 0.5], [0.7, 0.8]],
    [[2, 0.5], [2.5, 1], [2.6, 0.5]],
]
seeds = st.integers(0, 2**32)


def doubled_areas(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def edges_once(triangles):
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    assert count.max() <= 2
    return unique[count == 1]


def euler(mesh):
    triangles = mesh.cells[0].nodes
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    return len(mesh.points) - len(edges) + len(triangles)


def inner_mask(mesh):
    mask = np.ones(len(mesh.points), dtype=bool)
    mask[mesh.cells[1].nodes] = False
    return mask


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 150),
    st.sampled_from([*SHAPES, "polygon"]),
    st.sampled_from(["even", "random"]),
    st.floats(1e-6, 1e6),
    seeds,
)
def test_fills_the_shape_with_counter_clockwise_triangles(nodes, shape, boundary, size, seed):
    mesh = random_mesh(nodes, POLYGON if shape == "polygon" else shape, size=size, boundary=boundary, seed=seed)
    triangles, lines = mesh.cells
    area = doubled_areas(mesh.points, triangles.nodes)
    assert (area > 0).all()
    assert inner_mask(mesh).sum() == nodes
    assert len(np.unique(triangles.nodes)) == len(mesh.points)
    # The line cells are exactly the boundary of the triangles, the domain on their left.
    assert np.array_equal(edges_once(triangles.nodes), np.unique(np.sort(lines.nodes, axis=1), axis=0))
    start, end = mesh.points[lines.nodes[:, 0]], mesh.points[lines.nodes[:, 1]]
    enclosed = np.sum(start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0])
    assert area.sum() == pytest.approx(enclosed, rel=1e-9)
    holes = {"plate": 1, "polygon": 2}.get(shape, 0)
    assert euler(mesh) == 1 - holes
    assert set(mesh.region_names.values()) == {"domain", *mesh.markers}


@pytest.mark.parametrize("nodes", [1, 2, 7, 100, 1000])
def test_square_is_the_one_of_the_figures(nodes):
    mesh = random_mesh(nodes, size=2.0, seed=5)
    side = round(np.sqrt(nodes))
    assert np.array_equal(
        np.sort(mesh.points[inner_mask(mesh)], axis=0), np.sort(2 * np.random.default_rng(5).random((nodes, 2)), axis=0)
    )
    for name, axis, value in (("bottom", 1, 0), ("top", 1, 2), ("left", 0, 0), ("right", 0, 2)):
        on_side = mesh.points[mesh.markers[name]]
        assert len(on_side) == side + 1  # with both corners
        assert (on_side[:, axis] == value).all()
        assert np.sort(on_side[:, 1 - axis]) == pytest.approx(np.linspace(0, 2, side + 1))
    assert doubled_areas(mesh.points, mesh.cells[0].nodes).sum() == pytest.approx(8.0)
    # Euler: T = 2·inside + boundary − 2, no sliver along the hull left and none too many taken.
    assert len(mesh.cells[0].nodes) == 2 * nodes + 4 * side - 2


def test_quality_of_the_random_square_is_as_published():
    mesh = random_mesh(20_000, seed=1)
    a, b, c = (mesh.points[mesh.cells[0].nodes[:, k]] for k in range(3))
    lengths = ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2).sum(axis=1)
    inverse_q = 2 * np.sqrt(3) * doubled_areas(mesh.points, mesh.cells[0].nodes) / lengths
    assert inverse_q.mean() == pytest.approx(0.694, abs=0.005)


def test_circle_nodes_lie_on_the_circle_and_evenly():
    mesh = random_mesh(300, "circle", size=4.0, seed=2)
    rim = mesh.points[mesh.markers["circle"]] - 2.0
    assert np.linalg.norm(rim, axis=1) == pytest.approx(2.0)
    gaps = np.diff(np.sort(np.arctan2(rim[:, 1], rim[:, 0])))
    assert gaps == pytest.approx(2 * np.pi / len(rim))


def test_points_are_uniform_in_a_polygon_with_holes():
    mesh = random_mesh(8000, "plate", seed=3)
    inside = mesh.points[inner_mask(mesh)]
    radius = np.linalg.norm(inside - 0.5, axis=1)
    assert radius.min() > 0.199
    ring = np.pi * (0.3**2 - 0.2**2) / (1 - np.pi * 0.2**2)
    assert (radius < 0.3).mean() == pytest.approx(ring, abs=5 * np.sqrt(ring / 8000))


def test_same_arguments_same_mesh_other_seed_other_mesh():
    first, again, other = (random_mesh(50, "lshape", boundary="random", seed=s) for s in (4, 4, 5))
    assert np.array_equal(first.points, again.points)
    assert np.array_equal(first.cells[0].nodes, again.cells[0].nodes)
    assert first.points.shape != other.points.shape or not np.array_equal(first.points, other.points)


def test_ring_orientation_and_closing_corner_do_not_matter():
    outer, hole = np.array([[0, 0], [4, 0], [4, 3], [0, 3.0]]), np.array([[1, 1], [2, 1], [2, 2.0]])
    plain = random_mesh(40, [outer, hole], seed=1)
    for rings in ([outer[::-1], hole], [outer, hole[::-1]], [np.vstack([outer, outer[:1]]), hole]):
        turned = random_mesh(40, rings, seed=1)
        assert set(turned.markers) == {"domain", "outer", "hole_1"}
        assert len(turned.points) == len(plain.points)
        assert doubled_areas(turned.points, turned.cells[0].nodes).sum() == pytest.approx(2 * (12 - 0.5))


SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"nodes": 0}, "at least 1, got 0"),
        ({"nodes": 2.5}, "whole number of nodes"),
        ({"nodes": True}, "whole number of nodes"),
        ({"size": 0.0}, "size of a random mesh must be a positive number"),
        ({"size": float("nan")}, "size of a random mesh"),
        ({"seed": -1}, "a seed must be a whole number of at least 0, got -1"),
        ({"boundary": "odd"}, "boundary must be 'even' or 'random', got 'odd'"),
        ({"shape": "cube"}, "unknown shape 'cube'; there are square, circle, plate, lshape"),
        ({"shape": []}, "at least one ring"),
        ({"shape": [[[0, 0], [1, 1]]]}, "'outer' must be an array of at least 3 finite corners"),
        ({"shape": [[[0, 0], [1, 0], [0, 0]]]}, "at least 3 finite corners"),
        ({"shape": [[[0, 0], [1, 0], [1, np.inf]]]}, "at least 3 finite corners"),
        ({"shape": [[[0, 0], [1, "x"], [1, 1]]]}, "'outer' must be an array of corners"),
        ({"shape": [[[0, 0], [1, 1], [1, 0], [0, 1]]]}, "may only meet at their corners"),
        ({"shape": [[[0, 0], [1, 0], [2, 0]]]}, "may only meet at their corners"),
        ({"shape": [[[0, 0], [2, 0], [1, 0], [1, 1]]]}, "may only meet at their corners"),
        ({"shape": [SQUARE, [[0.5, 0.5], [1.5, 0.5], [0.7, 0.7]]]}, "'outer' .* and 'hole_1'"),
        ({"shape": [SQUARE, [[2, 2], [3, 2], [2, 3]]]}, "'hole_1' must lie inside the first ring"),
        ({"shape": [SQUARE, [[0.1, 0.1], [0.9, 0.1], [0.5, 0.9]], [[0.4, 0.2], [0.6, 0.2], [0.5, 0.4]]]}, "'hole_2'"),
        ({"shape": [[[0.1, 0.1], [0.9, 0.1], [0.5, 0.9]], SQUARE]}, "'outer' must lie"),
    ],
)  # fmt: skip
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(InputError, match=message):
        random_mesh(**{"nodes": 10, **arguments})


def test_thin_slits_get_boundary_nodes_until_the_triangulation_has_every_side():
    comb = [[0, 0], [4, 0], [4, 1], [3.02, 1], [3, 0.05], [2.98, 1], [1.02, 1], [1, 0.05], [0.98, 1], [0, 1]]
    mesh = random_mesh(200, [comb], seed=0)
    assert doubled_areas(mesh.points, mesh.cells[0].nodes).sum() == pytest.approx(2 * (4 - 2 * 0.5 * 0.04 * 0.95))


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 100), st.floats(0, 5), seeds)
def test_valid_disturbance_keeps_every_triangle_and_every_held_node(nodes, amount, seed):
    mesh = random_mesh(nodes, seed=seed)
    free = inner_mask(mesh)
    thrown = disturb(mesh, free, amount, seed=seed)
    assert (doubled_areas(thrown.points, thrown.cells[0].nodes) > 0).all()
    assert np.array_equal(thrown.points[~free], mesh.points[~free])
    assert np.array_equal(thrown.points, disturb(mesh, np.flatnonzero(free), amount, seed=seed).points)
    assert (amount > 1e-9) == (thrown.points != mesh.points).any() or amount <= 1e-9


def test_free_disturbance_goes_as_far_as_asked_and_tangles():
    mesh = random_mesh(1000, seed=1)
    triangles, lines = mesh.cells
    thrown = disturb(mesh, inner_mask(mesh), 3.0, seed=2, keep_valid=False)
    assert (doubled_areas(thrown.points, triangles.nodes) < 0).sum() > 100
    edges = np.unique(np.sort(triangles.nodes[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(np.diff(mesh.points[edges], axis=1)[:, 0], axis=1)
    mean = np.array([length[(edges == k).any(axis=1)].mean() for k in range(len(mesh.points))])
    step = np.linalg.norm(thrown.points - mesh.points, axis=1) / mean
    assert 2.9 < step.max() <= 3.0
    assert (step[lines.nodes] == 0).all()
    assert (step[inner_mask(mesh)] < 3 / np.sqrt(2)).mean() == pytest.approx(0.5, abs=0.06)  # uniform in the disc


def test_disturbance_keeps_clockwise_cells_clockwise_and_quads_convex():
    grid = np.array([[x, y] for y in range(3) for x in range(3)], dtype=float)
    quads = np.array([[k, k + 1, k + 4, k + 3] for k in (0, 1, 3, 4)])[:, ::-1]
    mesh = Mesh(np.column_stack([grid, np.full(9, 7.0)]), (CellBlock("quad", quads, np.zeros(4, dtype=int)),))
    thrown = disturb(mesh, [4], 3.0, seed=3)
    for k in range(4):
        corner = quads[:, [k, (k + 1) % 4, (k + 2) % 4]]
        assert (doubled_areas(thrown.points[:, :2], corner) < 0).all()
    assert (thrown.points[:, 2] == 7.0).all()
    assert not np.array_equal(thrown.points[4], mesh.points[4])


def test_disturbance_of_single_precision_meshes_lands_on_float32():
    mesh = random_mesh(200, seed=1)
    single = Mesh(mesh.points.astype(np.float32), mesh.cells, single=True)
    thrown = disturb(single, inner_mask(mesh), 1.0, seed=1)
    assert np.array_equal(thrown.points, thrown.points.astype(np.float32))
    assert (doubled_areas(thrown.points, thrown.cells[0].nodes) > 0).all()


def test_disturbance_leaves_the_corners_of_flat_cells():
    mesh = Mesh(
        np.array([[0.0, 0], [1, 0], [0.5, 0], [0.5, 1]]),
        (CellBlock("triangle", np.array([[0, 1, 2], [0, 1, 3]]), np.zeros(2, dtype=int)),),
    )
    thrown = disturb(mesh, [0, 1, 2, 3], 0.3, seed=0)
    assert np.array_equal(thrown.points[:3], mesh.points[:3])
    assert not np.array_equal(thrown.points[3], mesh.points[3])


@pytest.mark.parametrize(
    ("free", "amount", "message"),
    [
        ([0], -1.0, "must be 0 or more"),
        ([0], float("nan"), "must be 0 or more"),
        ([9999], 1.0, "between 0 and"),
        ([-1], 1.0, "between 0 and"),
        ([0.5], 1.0, "whole numbers"),
        ([[0]], 1.0, "a list of whole numbers"),
        ([True], 1.0, "must have the shape"),
    ],
)
def test_bad_disturbances_are_named(free, amount, message):
    with pytest.raises(InputError, match=message):
        disturb(random_mesh(5), free, amount)


def test_a_surface_cannot_be_disturbed():
    mesh = Mesh(np.eye(4, 3), (CellBlock("triangle", np.array([[0, 1, 2], [0, 1, 3]]), np.zeros(2, dtype=int)),))
    with pytest.raises(InputError, match="planar"):
        disturb(mesh, [0], 1.0)


@pytest.fixture
def app():
    from gmsnet.cli.generate import generate

    app = typer.Typer()
    app.command()(generate)
    return app


def test_command_writes_the_mesh_with_its_markers(tmp_path, app):
    path = tmp_path / "plate.su2"
    result = CliRunner().invoke(app, [str(path), "--shape", "plate", "--nodes", "50", "--size", "3", "--seed", "7"])
    assert result.exit_code == 0, result.output
    assert "plate with 92 nodes, 142 triangles and 42 boundary edges (seed 7)" in result.stdout
    mesh, expected = gmsnet.read(path), random_mesh(50, "plate", size=3.0, seed=7)
    assert np.array_equal(mesh.points, expected.points)
    assert {name: len(ids) for name, ids in mesh.markers.items() if name in expected.markers} == {
        name: len(ids) for name, ids in expected.markers.items() if name != "domain"
    }


def test_command_takes_rings_from_a_file(tmp_path, app):
    (tmp_path / "rings.json").write_text(json.dumps(POLYGON))
    path = tmp_path / "polygon.su2"
    result = CliRunner().invoke(app, [str(path), "--rings", str(tmp_path / "rings.json"), "--nodes", "40"])
    assert result.exit_code == 0, result.output
    mesh = gmsnet.read(path)
    assert np.array_equal(mesh.points, random_mesh(40, POLYGON).points)
    assert {"outer", "hole_1", "hole_2"} <= set(mesh.markers)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "rings.json: cannot be read: No such file"),
        ("[[[0, 0]", "rings.json: no JSON"),
        ("\x80", "rings.json: no JSON"),
        ("{}", "rings.json: must hold a list of rings"),
        ("[7]", "'outer' must be an array"),
        ("[[[0, 0], [1, 0]]]", "'outer' must be an array of at least 3"),
    ],
)
def test_command_refuses_bad_rings(tmp_path, app, text, message):
    if text is not None:
        (tmp_path / "rings.json").write_text(text, encoding="latin-1")
    arguments = [str(tmp_path / "out.su2"), "--rings", str(tmp_path / "rings.json")]
    result = CliRunner().invoke(app, arguments)
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)


@pytest.mark.parametrize("tangled", [False, True])
def test_command_jitters(tmp_path, app, tangled):
    path = tmp_path / "square.vtk"
    result = CliRunner().invoke(app, [str(path), "--nodes", "200", "--jitter", "0.6", *["--tangled"] * tangled])
    assert result.exit_code == 0, result.output
    mesh = gmsnet.read(path)
    triangles = next(block.nodes for block in mesh.cells if block.kind == "triangle")
    assert (doubled_areas(mesh.points, triangles) <= 0).any() == tangled


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tangled"], "--tangled needs --jitter"),
        (["--jitter", "-1"], "--jitter must be 0 or more"),
        (["--shape", "cube"], "unknown shape 'cube'"),
        (["--nodes", "0"], "at least 1"),
    ],
)
def test_command_refuses_bad_options_and_writes_nothing(tmp_path, app, options, message):
    result = CliRunner().invoke(app, [str(tmp_path / "out.su2"), *options])
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)
    assert list(tmp_path.iterdir()) == []
