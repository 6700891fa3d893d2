"""Cells keep their areas near walls that the mesh is refined towards, and nowhere else."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
import pytest
from support.layer_meshes import grid, rows_around

import gmsnet
from gmsnet.generate import Curve, disturb, good_mesh, layered_mesh, random_quad_mesh, recombine
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.paper.cases import CASES
from gmsnet.preserve.layers import stretched_layers
from gmsnet.preserve.protection import WALL, wall_note
from gmsnet.preserve.survey import Survey
from gmsnet.preserve.wall_edges import Beside
from gmsnet.preserve.walls import NEAR, WIDEST, near_walls
from gmsnet.topology.topology import Topology


def kept(mesh, held=None):
    return near_walls(mesh, Topology.of(mesh, held)).kept.nodes


def distances(points, wall):
    """(n,) from the closed polygon (k, 2), one edge after the other."""
    out = np.full(len(points), np.inf)
    for a, b in zip(wall, np.roll(wall, -1, axis=0), strict=True):
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        out = np.minimum(out, np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
    return out


@pytest.fixture(scope="module")
def ring():
    """A hole of diameter 1 in a square of side 8, refined towards it: edges from 0.01 to 1."""
    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    hole = Curve(0.5 * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    square = Curve(np.array([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0], [-4.0, -4.0]]), "square")
    return good_mesh([[square], [hole]], lambda x: 0.01 + 0.25 * np.abs(np.linalg.norm(x, axis=1) - 0.5))


def test_a_hole_that_the_mesh_is_refined_towards(ring):
    flags = kept(ring)
    triangles = ring.cells[0].nodes
    middle = ring.points[triangles].mean(axis=1)
    near = distances(middle, ring.points[ring.markers["hole"]]) <= NEAR
    assert flags[triangles[near]].all()
    assert set(np.flatnonzero(flags).tolist()) == set(triangles[near].ravel().tolist())
    assert 200 < near.sum() < len(triangles) / 2


def test_what_becomes_of_the_nodes_near_walls_is_told(ring):
    count = int(kept(ring).sum()) - len(ring.markers["hole"])
    told = f"the mesh is refined towards its walls: the {count:,} nodes next to them"
    moved = gmsnet.smooth(ring)
    band = "move only as far as the areas of their cells stay within 10% of the input's, "
    band += "and the heights of those on the wall within 2%"
    assert moved.notes == [f"{told} {band} (preserve='shape')"]
    assert WALL not in moved.held
    least = float(moved.before.shape.min())
    missed = gmsnet.smooth(ring, target_quality=least * 1.01)  # by cells near the wall
    assert missed.notes[:1] == moved.notes
    assert missed.after.shape.min() >= least * 1.01
    assert 0 < missed.moved[kept(ring)].sum() < moved.moved[kept(ring)].sum()
    for options in ({"max_sweeps": 1}, {"target_quality": least * 0.9}):
        held = gmsnet.smooth(ring, **options)
        assert held.notes[:1] == [f"{told} are held in this run (preserve='shape'); preserve='none' lets them move"]
        assert len(held.notes) <= 2
        assert all(note.startswith("of the cells with a free node: 1/q, least ") for note in held.notes[1:])
        assert len(held.held[WALL]) == count
        assert not held.moved[kept(ring)].any()


def test_it_moves_turns_and_scales_with_the_mesh(ring):
    cosine, sine = np.cos(0.7), np.sin(0.7)
    turned = ring.points @ [[cosine, sine], [-sine, cosine]] * 1e3 + 1e4
    assert kept(ring.with_points(turned)).tolist() == kept(ring).tolist()
    assert kept(ring.with_points(ring.points * [1.0, -1.0])).tolist() == kept(ring).tolist()


def test_the_more_a_mesh_is_disturbed_the_wider_are_its_bands(ring):
    free = Topology.of(ring).free
    found = [
        near_walls(disturb(ring, free, amount, seed=0), Topology.of(ring)).kept for amount in (0.05, 0.2, 0.3, 0.5)
    ]
    assert near_walls(ring, Topology.of(ring)).kept.blend.max() < 0.1
    means = [walls.blend[walls.nodes].mean() for walls in found]
    assert means[0] < 0.02 < 0.1 < means[1] < 0.5 < means[2] < means[3] == 1.0
    assert found[2].room.max() == 1.0 < found[3].room.max() < WIDEST
    assert not near_walls(disturb(ring, free, 1.0, seed=0), Topology.of(ring)).kept.nodes.any()


def test_the_noise_of_quads_is_that_of_their_areas(ring):
    """What a mesh generator recombines to quads is undisturbed as it is; thrown about, it is not."""
    quads = recombine(ring)
    free, hole = Topology.of(quads).free, ring.markers["hole"]
    found = [near_walls(disturb(quads, free, t, seed=0), Topology.of(quads)).kept for t in (0.0, 0.1, 0.2, 0.3)]
    assert [walls.heights[hole].max() for walls in found][::3] == [1.0, 0.0]
    assert found[0].blend[found[0].nodes].mean() < 0.2
    assert found[1].blend[found[1].nodes].mean() < found[2].blend[found[2].nodes].mean() < 1.0
    assert found[2].room.max() == 1.0 < found[3].room.max() < WIDEST
    assert not near_walls(disturb(quads, free, 0.6, seed=0), Topology.of(quads)).kept.nodes.any()


@pytest.mark.parametrize("cells", ["triangle", "quad"])
def test_walls_with_cells_too_large_to_be_kept_are_told(cells):
    """60 edges around a hole: each is longer than 2 % of its diameter."""
    turn = np.linspace(0.0, 2.0 * np.pi, 61)
    hole = Curve(0.5 * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    square = Curve(np.array([[-6.0, -6.0], [6.0, -6.0], [6.0, 6.0], [-6.0, 6.0], [-6.0, -6.0]]), "square")
    mesh = good_mesh([[square], [hole]], lambda x: 0.05 + 0.3 * np.abs(np.linalg.norm(x, axis=1) - 0.5))
    mesh = recombine(mesh) if cells == "quad" else mesh
    found = near_walls(mesh, Topology.of(mesh))
    assert found.coarse == 1
    assert not found.kept.nodes.any()
    told = "the mesh is refined towards a wall, but cells on it are larger than 2% of its diameter"
    assert any(note.startswith(told) for note in gmsnet.smooth(mesh).notes)
    assert not any(note.startswith(told) for note in gmsnet.smooth(mesh, preserve="none").notes)


def test_heights_give_way_to_areas_where_a_mesh_is_disturbed(ring):
    free, hole = Topology.of(ring).free, ring.markers["hole"]
    found = [near_walls(disturb(ring, free, amount, seed=0), Topology.of(ring)).kept for amount in (0.0, 0.1, 0.2)]
    for walls in found:
        assert not np.delete(walls.heights, hole).any()
        assert len(set(walls.heights[hole].tolist())) == 1
    as_made, little, much = (walls.heights[hole[0]] for walls in found)
    assert as_made == 1.0 > little > 0.0 == much
    told = [wall_note(walls, 3, moved=True) for walls in found]
    assert "the heights of those on the wall within 2%" in told[0]
    assert re.search(r"the heights of those on the wall within [3-9]%", told[1])
    assert "heights" not in told[2]


def test_the_bands_of_damaged_cells_are_wide(ring):
    walls, topology = near_walls(ring, Topology.of(ring)).kept, Topology.of(ring)
    inner = np.flatnonzero(walls.nodes & np.isin(np.arange(len(walls.nodes)), topology.free))
    chosen = inner[np.random.default_rng(0).permutation(len(inner))[:6]]
    broken = disturb(ring, chosen, 3.0, seed=0, keep_valid=True)
    found = near_walls(broken, topology).kept
    shape = gmsnet.quality(broken).shape
    near = walls.nodes[topology.triangles].all(axis=1)
    bad = (shape < 0.3) & near & found.nodes[topology.triangles].all(axis=1)
    assert bad.any()
    assert (found.blend[topology.triangles[bad]] == 1.0).all()
    assert np.mean(found.blend[walls.nodes] == 0.0) > 0.7
    assert found.firm.nodes.sum() < found.nodes.sum()


def test_inverted_cells_have_no_bands(ring):
    flags, topology = kept(ring), Topology.of(ring)
    inner = np.flatnonzero(flags & np.isin(np.arange(len(flags)), topology.free))
    chosen = inner[np.random.default_rng(0).permutation(len(inner))[:6]]
    broken = disturb(ring, chosen, 3.0, seed=0, keep_valid=False)
    bad = (gmsnet.quality(broken).shape <= 0.0) & flags[topology.triangles].all(axis=1)
    assert bad.any()
    now = kept(broken)
    assert not now[topology.triangles[bad]].any()
    assert now.sum() > 0.8 * flags.sum()
    held = np.zeros(len(flags), dtype=bool)
    held[topology.triangles[bad]] = True
    assert kept(broken, held).sum() > now.sum()  # what is held cannot be untangled: no reason to give way


def test_meshes_that_are_not_refined_towards_a_wall_have_none():
    for shape in ("square", "circle", "plate", "lshape"):
        for nodes in (50, 800):
            for spacing in (0.2, 1.0, 4.0):
                assert not kept(gmsnet.random_mesh(nodes, shape, boundary_spacing=spacing, seed=1)).any()
    assert not kept(gmsnet.random_mesh(20_000, seed=1)).any()
    assert not kept(grid(np.linspace(0.0, 1.0, 80), np.linspace(0.0, 1.0, 80))).any()
    for case in CASES.values():
        for run in range(3):
            assert not kept(case.mesh(run)).any()


@pytest.mark.parametrize("cells", ["quad", "triangle"])
def test_heights_over_a_wall_that_change_are_told(cells):
    """Rows half as high as long, which grow: too long for layers."""
    mesh = rows_around(80, 20, 0.04, 1.25, cells=cells)
    told = [note for note in gmsnet.smooth(mesh).notes if note.startswith("cells that have one height over")]
    assert len(told) == 1
    found = re.match(
        r"cells that have one height over 2 walls are ([\d.]+) times as high now, in the median: ", told[0]
    )
    assert float(found[1]) > 1.3
    fixed = np.unique(mesh.cells[0].nodes)  # all that there are
    assert not any(note.startswith("cells that") for note in gmsnet.smooth(mesh, fixed=fixed).notes)


@pytest.mark.parametrize("seed", [0, 1])
def test_heights_that_nobody_made_are_not_told(ring, seed):
    """Of random points, whose cells on a boundary become higher, and of a mesh whose cells stay."""
    far = gmsnet.random_mesh(800, "circle", boundary_spacing=4.0, seed=seed)
    assert gmsnet.smooth(far).moved.any()
    for mesh in (far, ring, layered_mesh()):
        assert not any(note.startswith("cells that have one height") for note in gmsnet.smooth(mesh).notes)


def test_the_airfoil_of_the_real_meshes(real_meshes):
    """All cells within 2 % of its chord."""
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    flags, triangles = kept(mesh), Topology.of(mesh).triangles
    (airfoil,) = [
        b.nodes for b in mesh.cells if b.dimension == 1 and set(b.nodes.ravel()) == set(mesh.markers["airfoil"])
    ]
    order = dict(airfoil.tolist())
    loop = [int(airfoil[0, 0])]
    while len(loop) < len(airfoil):
        loop.append(order[loop[-1]])
    near = distances(mesh.points[triangles, :2].mean(axis=1), mesh.points[loop, :2]) <= NEAR
    assert near.sum() == 1632
    assert flags[triangles[near]].all()


@pytest.mark.parametrize("name", ["japan_sea.msh", "osteonT1_11.mesh", "helmholtz_apartment.vtk", "internal.msh"])
def test_other_real_meshes_have_none(real_meshes, name):
    assert not kept(gmsnet.read(real_meshes / name)).any()


def test_the_last_rows_of_boundary_layers_and_what_is_next_to_them():
    mesh = layered_mesh()
    layers = stretched_layers(mesh, Topology.of(mesh))
    flags = kept(mesh, layers.nodes)
    assert flags[: 20 * 120].mean() > 0.9
    assert not flags[len(flags) // 2 + 1000 :].all()


def test_no_cells_no_extent_and_a_boundary_in_one_line():
    assert kept(Mesh(np.zeros((0, 2)), ())).tolist() == []
    flat = Mesh(np.zeros((3, 2)), (CellBlock("triangle", [[0, 1, 2]], [0]),))
    assert not kept(flat).any()
    line = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), (CellBlock("triangle", [[0, 1, 2]], [0]),))
    assert not kept(line).any()


@pytest.mark.parametrize("cells", ["quad", "mixed"])
def test_walls_of_quads_are_pieces_of_the_boundary(cells):
    mesh = random_quad_mesh(800, cells=cells, seed=3)
    topology = Topology.of(mesh)
    survey = Survey.of(mesh, topology)
    walls = Beside.of(topology.simplices, survey.beside, survey.rim).walls()
    assert len(walls) == 1  # the square
    edges = {tuple(sorted(edge)) for edge in topology.memory[walls[0][0]].tolist()}
    count = Counter(
        tuple(sorted(pair))
        for block in mesh.cells
        if block.dimension == 2
        for nodes in block.nodes.tolist()
        for pair in zip(nodes, nodes[1:] + nodes[:1], strict=True)
    )
    assert len(walls[0][0]) == len(edges)
    assert edges == {edge for edge, times in count.items() if times == 1}
