"""Generated hexahedra, wedges, pyramids and mixed volumes: valid everywhere, closed, exactly where they should be."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gmsnet import quality
from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.generate import (
    block_volume,
    disturb,
    layered_volume,
    o_grid_section,
    random_mesh,
    settle,
    structured_mesh,
    swept_volume,
)
from gmsnet.generate.marked_volume import SIDES
from gmsnet.generate.solids import KINDS

SMALL = settings(max_examples=15, deadline=None)


def check(mesh):
    """All cells valid everywhere and not inside out, facets matched two by two, the others in the mesh as faces, the
    boundary closed. Returns the volume."""
    facets, faces = Counter(), Counter()
    for block in mesh.cells:
        if block.dimension == 3:
            for facet in CELLS[block.kind].facets:
                facets.update(map(tuple, np.sort(block.nodes[:, facet], axis=1).tolist()))
        else:
            faces.update(map(tuple, np.sort(block.nodes, axis=1).tolist()))
    assert max(facets.values()) <= 2
    assert {facet for facet, count in facets.items() if count == 1} == set(faces)
    assert max(faces.values()) == 1
    edges = Counter()
    for block in mesh.cells:
        if block.dimension == 2:
            for ring in block.nodes.tolist():
                edges.update(frozenset(pair) for pair in zip(ring, [*ring[1:], ring[0]], strict=True))
    assert set(edges.values()) == {2}
    used = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.cells if block.dimension == 3]))
    assert len(used) == len(mesh.points)
    found = quality(mesh)
    assert found.inverted == 0
    assert found.remarks == []
    return float(found.volume.sum())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("cells", [2, 3, 5])
def test_blocks_fill_the_cube_and_mark_its_sides(kind, cells):
    mesh = block_volume(cells, kind, size=2.0)
    assert check(mesh) == pytest.approx(8.0)
    for k, name in enumerate(SIDES):
        assert mesh.region_names[2, k + 1] == name
        for block in mesh.cells:
            if block.dimension == 2:
                on = mesh.points[block.nodes[block.regions == k + 1]][..., k // 2]
                assert (on == (k % 2) * 2.0).all()


def test_counts_of_blocks():
    count = {block.kind: len(block.nodes) for block in block_volume(4, "mixed").cells}
    assert count == {"hexahedron": 32, "pyramid": 16 * 5, "tetra": 16 * 2 + 16 * 12, "quad": 64, "triangle": 64}
    assert len(block_volume(3).points) == 64
    assert len(block_volume(3, "wedge").cells[0].nodes) == 54
    assert len(block_volume(3, "pyramid").cells[0].nodes) == 162


@SMALL
@given(
    around=st.integers(1, 4), rings=st.integers(1, 3), layers=st.integers(1, 4),
    twist=st.sampled_from([-20.0, 0.0, 15.0]),
    bend=st.sampled_from([0.0, 30.0, 90.0]),
)  # fmt: skip
def test_swept_o_grids_are_valid(around, rings, layers, twist, bend):
    section = o_grid_section(around, rings, radius=0.5)
    mesh = swept_volume(section, layers, 2.0, twist=twist * layers, bend=bend)
    volume = check(mesh)
    area = 0.5 * 4 * around * np.sin(np.pi / (2 * around)) * 0.25  # of the polygon that the disc is
    assert 0.5 * area < volume < 2.0 * area * (1 + 1e-9)  # what bends or twists in few layers loses some
    if not bend and not twist:
        assert volume == pytest.approx(2.0 * area)
    assert mesh.region_names[2, 1] == "start"
    faces = mesh.cells[-1]
    assert (faces.regions == 1).sum() == (faces.regions == 2).sum() == len(section.cells[0].nodes)
    assert np.abs(np.linalg.norm(mesh.points[: len(section.points)][:, :2], axis=1).max() - 0.5) < 1e-12


def test_of_straight_ways_the_volume_is_area_times_length():
    section = settle(random_mesh(60, "lshape", seed=1), 20)
    area = quality(section).cells
    assert len(area.corners)
    mesh = swept_volume(section, 4, 3.0)
    corners = section.points[section.cells[0].nodes]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    assert check(mesh) == pytest.approx(3.0 * 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum())
    assert mesh.cells[0].kind == "wedge"
    assert check(swept_volume(structured_mesh(3), 2, 1.0)) == pytest.approx(1.0)


@pytest.mark.parametrize(("aspect", "rows"), [(20.0, 5), (500.0, 15)])
def test_prism_layers_are_stretched_as_asked_and_tetrahedra_lie_above(aspect, rows):
    mesh = layered_volume(6, rows, kind="wedge", first=1.0 / aspect)
    assert check(mesh) == pytest.approx(1.0 - 0.1 * 4 / np.pi**2, rel=0.02)
    assert {block.kind for block in mesh.cells} == {"wedge", "tetra", "triangle", "quad"}
    wedges = mesh.cells[0].nodes
    assert len(wedges) == rows * 72
    upward = np.linalg.norm(mesh.points[wedges[:72, 3:]] - mesh.points[wedges[:72, :3]], axis=2)
    across = np.linalg.norm(mesh.points[wedges[:72, 0]] - mesh.points[wedges[:72, 1]], axis=1)
    assert aspect / 2 < (across / upward[:, 0]).mean() < 3 * aspect


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("amount", [0.5, 1.0, 2.0])
def test_thrown_nodes_tangle_cells_of_which_a_valid_mesh_is_known(kind, amount):
    mesh = block_volume(3, kind)
    inner = np.ones(len(mesh.points), dtype=bool)
    for block in mesh.cells:
        if block.dimension == 2:
            inner[block.nodes] = False
    thrown = disturb(mesh, inner, amount, seed=1, keep_valid=False)
    assert quality(thrown).inverted > 0
    assert (thrown.points[~inner] == mesh.points[~inner]).all()
    kept = disturb(mesh, inner, amount, seed=1)
    assert (quality(kept).shape > 0.0).all()


def test_what_cannot_be_made_is_refused():
    for make in (
        lambda: block_volume(0), lambda: block_volume(1, "mixed"), lambda: block_volume(2, "tetra"),
        lambda: swept_volume(block_volume(2), 2, 1.0), lambda: swept_volume(structured_mesh(2), 2, 0.1, bend=180.0),
        lambda: swept_volume(structured_mesh(2), 0, 1.0), lambda: o_grid_section(0, 1),
        lambda: layered_volume(4, 3, kind="hexahedron"),
    ):  # fmt: skip
        with pytest.raises(InputError):
            make()
