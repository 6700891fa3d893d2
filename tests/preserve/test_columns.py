"""Layers of tetrahedra and of prisms: found where they were made, nowhere else; held by smoothing."""

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import (
    block_volume,
    disturb,
    lattice_volume,
    layered_volume,
    o_grid_section,
    part_volume,
    random_mesh,
    random_volume,
    swept_volume,
)
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.columns import layers_of_volume
from gmsnet.preserve.protection import LAYER
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import space_points, taken

KINDS = [(10, 8, 0.02, 1.4), (12, 10, 0.005, 1.5), (12, 5, 0.1, 1.3), (10, 4, 0.3, 1.0)]  # cells, rows, first, growth


def found(mesh):
    """The layers, and which nodes may move."""
    volume = volume_of(wound_of(mesh))
    free = np.zeros(len(mesh.points), dtype=bool)
    free[volume.free] = True
    return layers_of_volume(volume, taken(space_points(mesh), volume.memory)), free


def made(cells, rows, first, growth, seed=0):
    """The mesh and which of its nodes are in layers."""
    mesh = layered_volume(cells, rows, first=first, growth=growth, seed=seed)
    layers = np.zeros(len(mesh.points), dtype=bool)
    layers[: (rows + 1) * (cells + 1) ** 2] = True  # nodes are numbered from the bottom up
    return mesh, layers


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_layers_are_found_where_they_are(kind, seed):
    mesh, known = made(*kind, seed)
    layers, free = found(mesh)
    assert not (layers.nodes & ~(known & free)).any()
    assert layers.nodes.sum() >= 0.94 * (known & free).sum()  # the last row may look like the cells above it
    cells, rows = kind[:2]
    assert layers.cells.sum() > 0.55 * 6 * cells**2 * rows  # those at the sides have no column there
    assert 2.5 < layers.median <= layers.largest


@pytest.mark.parametrize(("rows", "first"), [(8, 0.1), (12, 0.02), (15, 0.002)])
def test_rows_of_prisms_are_held_where_they_are_flat(rows, first):
    cells, growth = 14, 1.4
    mesh = layered_volume(cells, rows, kind="wedge", first=first, growth=growth)
    layers, free = found(mesh)
    known = np.zeros((len(mesh.points) // (cells + 1) ** 2, (cells + 1) ** 2), dtype=bool)
    known[: rows + 1] = True
    assert not (layers.nodes & ~(known.ravel() & free)).any()
    flat = 1 + int(np.sum(first * growth ** np.arange(rows) < 1.0 / 2.5))  # levels whose cells below are so flat
    known[flat:] = False
    assert layers.nodes[known.ravel() & free].mean() >= 0.94
    assert layers.cells.mean() < sum(len(b.nodes) for b in mesh.cells if b.kind == "wedge") / len(layers.cells)


@pytest.mark.parametrize("seed", range(3))
def test_a_section_that_was_swept_has_none(seed):
    section = o_grid_section(6 + seed, 3 + seed, radius=0.5)
    mesh = swept_volume(section, 12 + 2 * seed, 3.0, twist=15.0 * seed, bend=45.0 * seed)
    inner = volume_of(wound_of(mesh)).free
    assert not found(disturb(mesh, inner, 0.2, seed=seed))[0]


@pytest.mark.parametrize("kind", ["hexahedron", "wedge"])
def test_a_grid_that_was_squeezed_has_none(kind):
    mesh = squeezed(block_volume(10, kind), 0.2)
    assert not found(mesh)[0]


def squeezed(mesh, by):
    """The mesh, flat."""
    return mesh.with_points(mesh.points * [1.0, 1.0, by])


@pytest.mark.parametrize("seed", range(4))
def test_none_where_there_are_none(seed):
    random, part = random_volume(1000, seed=seed), part_volume(9 + seed)
    inner = volume_of(wound_of(part)).free
    thrown = disturb(squeezed(part, 0.3), inner, 0.2, seed=seed)
    for mesh in (random, squeezed(random, 0.2), squeezed(random, 5.0), part, thrown):
        assert not found(mesh)[0]


def test_neither_place_nor_numbering_nor_scale_matter():
    mesh, _ = made(*KINDS[0])
    layers, _ = found(mesh)
    rng = np.random.default_rng(0)
    order, turn = rng.permutation(len(mesh.points)), np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points, cells = np.empty_like(mesh.points), mesh.cells[0].nodes
    points[order] = 1e-3 * mesh.points @ turn.T + 5.0
    shuffled = order[cells][rng.permutation(len(cells))]
    again, _ = found(Mesh(points, [CellBlock("tetra", shuffled, np.zeros(len(cells)))]))
    assert (again.nodes[order] == layers.nodes).all()


def test_layers_stay_and_what_lies_around_gets_better():
    mesh, _ = made(*KINDS[0])
    result, layers = gmsnet.smooth(mesh), found(mesh)[0]
    assert result.held[LAYER].tolist() == np.flatnonzero(layers.nodes).tolist()
    assert not result.moved[layers.nodes].any()
    assert result.after.totals.shape_mean > result.before.totals.shape_mean + 0.02
    assert any("if it is not meant, preserve='none' lets them move" in note for note in result.notes)
    free = gmsnet.smooth(mesh, preserve="none")
    assert free.moved[layers.nodes].any()
    assert any("nothing is held for that" in note for note in free.notes)


def test_walls_of_layers_do_not_slide():
    mesh, known = made(*KINDS[0])
    result = gmsnet.smooth(mesh, slide=True)
    inside = np.zeros(len(known), dtype=bool)
    inside[result.held[LAYER]] = True
    assert not result.moved[inside].any()
    assert result.moved[mesh.points[:, 2] == 1.0].any()
    wall = np.flatnonzero(known & (np.arange(len(known)) < 11 * 11))
    assert inside[wall].sum() > 0.6 * len(wall)


def test_layers_are_told_on_the_untangled_mesh():
    mesh, known = made(*KINDS[2])
    above = np.flatnonzero(~known & ((mesh.points > 0.0) & (mesh.points < 1.0)).all(axis=1))
    thrown = disturb(mesh, above, 1.5, seed=1, keep_valid=False)
    before = gmsnet.quality(thrown).inverted
    result = gmsnet.smooth(thrown)
    assert before > 100
    assert result.after.inverted == 0
    assert len(result.held[LAYER]) > 0.85 * found(mesh)[0].nodes.sum()  # untangling may move the last row
    still = np.zeros(len(mesh.points), dtype=bool)
    still[np.concatenate(list(result.held.values()))] = True
    could = np.count_nonzero(~still | result.moved)
    assert f"{result.moved.sum():,} of {could:,} free nodes moved" in repr(result)


def test_fix_layers_without_layers_says_so():
    result = gmsnet.smooth(lattice_volume(4), fix_layers=True)
    assert any("no stretched layers were found" in note for note in result.notes)


@pytest.mark.parametrize(("rows", "growth"), [(4, 1.2), (5, 1.2), (8, 1.2)])
def test_rows_from_wall_to_wall_grow_from_where_they_are_thin(rows, growth):
    """Cells at the wall opposite are flat as well, but no columns that start there take nodes from the others."""
    bottom = random_mesh(300, seed=1)
    triangles, nodes = bottom.cells[0].nodes, len(bottom.points)
    heights = 0.008 * np.concatenate([[0.0], np.cumsum(growth ** np.arange(rows))])
    points = np.concatenate([np.column_stack([bottom.points, np.full(nodes, height)]) for height in heights])
    wedges = np.concatenate([np.hstack([triangles + nodes * k, triangles + nodes * (k + 1)]) for k in range(rows)])
    mesh = Mesh(points, (CellBlock("wedge", wedges, np.zeros(len(wedges), dtype=np.int64)),))
    layers, free = found(mesh)
    assert free.sum() > 200 * (rows - 1)
    assert layers.nodes[free].mean() > 0.97


def test_even_rows_have_grown_if_the_row_under_their_tops_is_higher():
    """Cells above it are not flat, so no column goes through it."""
    side, height = np.linspace(0.0, 1.0, 9), np.cumsum([0.0, 0.02, 0.02, 0.02, 0.023, *[0.125] * 4])
    points = np.stack(np.meshgrid(side, side, height, indexing="ij"), axis=-1).reshape(-1, 3)
    node = np.arange(len(points)).reshape(9, 9, -1)
    corners = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    ends = slice(None, -1), slice(1, None)
    cells = np.stack([each[..., end].ravel() for end in ends for each in corners], axis=1)
    layers, _ = found(Mesh(points, (CellBlock("hexahedron", cells, np.zeros(len(cells), dtype=int)),)))
    assert layers.nodes.sum() == 4 * 7**2
