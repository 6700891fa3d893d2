"""Generated meshes of tetrahedra: positive, closed, exactly on the cube; thrown nodes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import disturb, lattice_volume, layered_volume, part_volume, random_volume
from gmsnet.generate.marked_volume import SIDES
from gmsnet.generate.volumes import CYLINDER, CYLINDER_RADIUS, SPHERE, SPHERE_RADIUS
from gmsnet.measure.volumes import exact_signs3

SMALL = settings(max_examples=20)


def check(mesh, size=1.0):
    """All cells positive in exact arithmetic, all facets matched, the boundary closed and where its markers say."""
    tetra, faces = mesh.cells
    assert (tetra.kind, faces.kind) == ("tetra", "triangle")
    rows = tetra.nodes.astype(np.int32)
    assert (exact_signs3(mesh.points, rows, np.ones(len(rows), dtype=np.int8)) == 1).all()
    assert len(np.unique(rows)) == len(mesh.points)
    facets = np.sort(rows[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    found, count = np.unique(facets, axis=0, return_counts=True)
    assert count.max() <= 2
    assert np.array_equal(found[count == 1], np.unique(np.sort(faces.nodes, axis=1), axis=0))
    edges = np.sort(faces.nodes[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = (mesh.points[faces.nodes[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0  # by Gauss: all faces are seen from outside
    for k, name in enumerate(SIDES):
        assert mesh.region_names[2, k + 1] == name
        on = mesh.points[faces.nodes[faces.regions == k + 1]][..., k // 2]
        assert on.size
        assert (on == (k % 2) * size).all()
    return volume


@SMALL
@given(nodes=st.integers(1, 150), seed=st.integers(0, 10**6))
def test_random_volumes_fill_the_cube(nodes, seed):
    mesh = random_volume(nodes, size=2.0, seed=seed)
    assert check(mesh, 2.0) == pytest.approx(8.0)
    count = max(1, round(nodes ** (1 / 3)))
    assert len(mesh.cells[1].nodes) == 12 * count**2
    assert len(mesh.points) == nodes + (count + 1) ** 3 - max(0, count - 1) ** 3


@pytest.mark.parametrize("cells", [1, 2, 5])
def test_the_lattice_has_two_kinds_of_cells(cells):
    mesh = lattice_volume(cells)
    assert check(mesh) == pytest.approx(1.0)
    assert len(mesh.cells[0].nodes) == 12 * cells**2 * (cells - 1) + 12 * cells**2
    shapes = np.round(np.unique(gmsnet.quality(mesh).shape.round(9)), 4).tolist()
    assert shapes == [0.762, 0.9524][: 1 + (cells > 1)]


@pytest.mark.parametrize("cells", [9, 12, 16])
def test_the_part_has_round_holes(cells):
    mesh = part_volume(cells)
    holes = np.pi * CYLINDER_RADIUS**2 + 4 / 3 * np.pi * SPHERE_RADIUS**3
    assert check(mesh) == pytest.approx(1.0 - holes, abs=0.02)
    faces = mesh.cells[1]
    for name, far in (
        ("cylinder", np.linalg.norm(mesh.points[:, :2] - CYLINDER, axis=1) - CYLINDER_RADIUS),
        ("sphere", np.linalg.norm(mesh.points - SPHERE, axis=1) - SPHERE_RADIUS),
    ):
        (region,) = [number for (_, number), each in mesh.region_names.items() if each == name]
        assert np.abs(far[faces.nodes[faces.regions == region]]).max() < 0.2 / cells
    assert gmsnet.quality(mesh).shape.min() > 0.3


def test_same_arguments_same_mesh_other_seed_other_mesh():
    one, same, other = (random_volume(50, seed=seed) for seed in (1, 1, 2))
    assert one.points.tobytes() == same.points.tobytes()
    assert one.cells[0].nodes.tobytes() == same.cells[0].nodes.tobytes()
    assert not np.array_equal(one.points, other.points)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: random_volume(0), "the number of nodes must be a whole number of at least 1, got 0"),
        (lambda: random_volume(5, size=0.0), "the size must be a positive number, got 0.0"),
        (lambda: random_volume(5, seed=-1), "a seed must be a whole number"),
        (lambda: lattice_volume(0), "the number of cells must be a whole number of at least 1"),
        (lambda: part_volume(8), "the number of cells must be a whole number of at least 9, got 8"),
    ],
)
def test_bad_arguments_are_named(make, message):
    with pytest.raises(InputError, match=message):
        make()


@SMALL
@given(amount=st.floats(0.0, 3.0), seed=st.integers(0, 99), edge=st.sampled_from(["mean", "shortest"]))
def test_valid_disturbance_keeps_every_tetrahedron_and_every_held_node(amount, seed, edge):
    mesh = lattice_volume(3)
    held = np.unique(mesh.cells[1].nodes)
    free = np.setdiff1d(np.arange(len(mesh.points)), held)
    thrown = disturb(mesh, free, amount, seed=seed, edge=edge)
    assert check(thrown) == pytest.approx(1.0)
    assert thrown.points[held].tobytes() == mesh.points[held].tobytes()
    far = np.linalg.norm(thrown.points - mesh.points, axis=1)
    assert far.max() <= amount * (1 / 3 if edge == "mean" else np.sqrt(3) / 6) * (1 + 1e-12)


def test_free_disturbance_tangles_in_all_directions():
    mesh = lattice_volume(6)
    free = np.setdiff1d(np.arange(len(mesh.points)), mesh.cells[1].nodes)
    thrown = disturb(mesh, free, 2.0, keep_valid=False)
    assert gmsnet.quality(thrown).inverted > 100
    step = (thrown.points - mesh.points)[free]
    assert np.abs(step.mean(axis=0)).max() < 0.15 * np.abs(step).max()
    assert step.std(axis=0).min() > 0.8 * step.std(axis=0).max()


@pytest.mark.parametrize(("cells", "rows", "first", "growth"), [(4, 3, 0.1, 1.5), (8, 8, 0.02, 1.4), (12, 5, 0.1, 1.3)])
def test_layered_volumes(cells, rows, first, growth):
    mesh = layered_volume(cells, rows, first=first, growth=growth, size=2.0, seed=3)
    rows_of = mesh.cells[0].nodes.astype(np.int32)
    assert (exact_signs3(mesh.points, rows_of, np.ones(len(rows_of), dtype=np.int8)) == 1).all()
    wall, above = mesh.points[: (cells + 1) ** 2], mesh.points[(cells + 1) ** 2 : 2 * (cells + 1) ** 2]
    rise = np.sin(np.pi * wall[:, 0] / 2) * np.sin(np.pi * wall[:, 1] / 2)
    np.testing.assert_allclose(above[:, 2] - wall[:, 2], (1.0 - 0.1 * rise) * first / cells * 2.0)
    assert set(mesh.markers) == {"domain", *SIDES}
    assert (mesh.points[mesh.markers["top"], 2] == 2.0).all()
    assert len(mesh.cells[0].nodes) % (6 * cells**2) == 0


def test_layers_that_are_too_high_are_refused():
    with pytest.raises(InputError, match=r"rows are .* of the cube high"):
        layered_volume(4, 20, first=0.5)
    with pytest.raises(InputError, match="growth"):
        layered_volume(4, growth=0.9)
