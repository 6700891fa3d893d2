from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from support import naive

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.errors import InputError
from gmsnet.parallel import memory as available_memory
from gmsnet.topology import polygons as faces
from gmsnet.topology.topology import Topology


def mesh_of(points, triangles, regions=None, extra=()):
    triangles = np.asarray(triangles, dtype=int).reshape(-1, 3)
    regions = np.zeros(len(triangles), dtype=int) if regions is None else regions
    return Mesh(points, (CellBlock("triangle", triangles, regions), *extra))


def wheel(degree, centre=(0.0, 0.0)):
    angle = 2 * np.pi * np.arange(degree) / degree
    points = np.vstack([centre, np.column_stack([np.cos(angle), np.sin(angle)]) + centre])
    triangles = [(0, 1 + i, 1 + (i + 1) % degree) for i in range(degree)]
    return points, np.array(triangles)


def check_against_twin(mesh, topology, others=(), lines=()):
    triangles = mesh.cells[0].nodes.tolist()
    regions = [*mesh.cells[0].regions.tolist(), *[-1] * len(others)]
    held = naive.held_nodes(len(mesh.points), triangles, regions, others, lines)
    # Cells folded onto each other have no positive side either: the tests of the winding look at both reasons.
    reasons = ("part that cannot be wound consistently", "part of zero area, which has no positive side")
    unwound = {node for reason in reasons for node in topology.held.get(reason, np.empty(0, int)).tolist()}
    free = set(topology.free.tolist())
    assert free == set(range(len(mesh.points))) - held - unwound
    counted = [i for ids in topology.held.values() for i in ids.tolist()]
    assert sorted([*counted, *free]) == list(range(len(mesh.points)))  # each node once
    start, ring = topology.patches
    turn = topology.orientation
    for i, v in enumerate(topology.free.tolist()):
        around = ring[start[i] : start[i + 1]].tolist()
        wanted = {
            tuple(t if w > 0 else t[::-1])
            for t, w in zip(topology.triangles.tolist(), turn.tolist(), strict=True)
            if v in t
        }
        rotated = {t[k:] + t[:k] for t in wanted for k in range(3)}
        assert len(wanted) == len(around)
        assert around[0] == min(around)
        for a, b in zip(around, around[1:] + around[:1], strict=True):
            assert (v, a, b) in rotated
    rings = {v: ring[start[i] : start[i + 1]].tolist() for i, v in enumerate(topology.free.tolist())}
    colours = naive.colours(free, rings)
    assert topology.colours.tolist() == [colours.get(v, -1) for v in range(len(mesh.points))]


@given(st.integers(0, 2**32 - 1), st.integers(4, 60), st.integers(1, 3))
@settings(max_examples=80, deadline=None)
def test_random_triangulations_with_holes_regions_and_mixed_winding(seed, nodes, regions):
    rng = np.random.default_rng(seed)
    points = rng.random((nodes, 2))
    triangles = Delaunay(points).simplices
    triangles = triangles[rng.random(len(triangles)) < rng.choice([1.0, 0.9, 0.5])]
    triangles = np.array([np.roll(t[:: rng.choice([1, -1])], rng.integers(3)) for t in triangles]).reshape(-1, 3)
    if rng.random() < 0.3 and len(triangles):
        triangles = np.vstack([triangles, triangles[rng.integers(len(triangles), size=2)]])  # duplicates
    if rng.random() < 0.3:
        triangles = np.vstack([triangles, [[0, 0, 1]]])  # a cell that names a node twice
    mesh = mesh_of(points, triangles, rng.integers(regions, size=len(triangles)))
    check_against_twin(mesh, Topology.of(mesh))


@given(st.integers(0, 2**32 - 1), st.integers(5, 40))
@settings(max_examples=80, deadline=None)
def test_triangles_among_polygons_lines_and_nonsense(seed, nodes):
    rng = np.random.default_rng(seed)
    points = rng.random((nodes, 2))
    triangles = Delaunay(points).simplices
    if rng.random() < 0.3:
        triangles = np.vstack([triangles, rng.integers(nodes, size=(rng.integers(1, 4), 3))])  # any three nodes
    triangles = np.array([np.roll(t[:: rng.choice([1, -1])], rng.integers(3)) for t in triangles])
    extra = [
        CellBlock(kind, cells := rng.integers(nodes, size=(rng.integers(2), size)), np.zeros(len(cells), dtype=int))
        for kind, size in (("polygon", 4), ("polygon", 5), ("triangle6", 6), ("line", 2), ("vertex", 1))
    ]
    others = [c for block in extra[:2] for c in block.nodes.tolist()]
    others += [c[:3] for c in extra[2].nodes.tolist()]
    lines = [c for block in extra[2:] for c in block.nodes.tolist()]
    mesh = mesh_of(points, triangles, rng.integers(2, size=len(triangles)), extra)
    topology = Topology.of(mesh)
    check_against_twin(mesh, topology, others, lines)
    assert topology.triangles.tolist() == triangles.tolist() + [c[:3] for c in extra[2].nodes.tolist()]
    before = len(triangles) + sum(len(block.nodes) for block in extra[:2])
    assert topology.cell.tolist() == [*range(len(triangles)), *range(before, before + len(extra[2].nodes))]


@given(st.integers(0, 2**32 - 1), st.integers(4, 60))
@settings(max_examples=80, deadline=None)
def test_parts_are_wound_alike_with_positive_area(seed, nodes):
    rng = np.random.default_rng(seed)
    points = rng.random((nodes, 2))
    triangles = Delaunay(points).simplices
    triangles = triangles[rng.random(len(triangles)) < rng.choice([1.0, 0.9, 0.5])]
    if rng.random() < 0.5:  # else of whatever winding Delaunay gives, or all of the other
        triangles = np.array([t[:: rng.choice([1, -1])] for t in triangles])
    triangles = triangles.reshape(-1, 3)[:, :: rng.choice([1, -1])]
    if nodes >= 5 and rng.random() < 0.2:
        triangles = np.vstack([triangles, [(i, (i + 1) % 5, (i + 2) % 5) for i in range(5)]])
    topology = Topology.of(mesh_of(points, triangles))
    turned = [t[:: int(turn)] for t, turn in zip(triangles.tolist(), topology.orientation, strict=True)]
    edges = {}
    for f, t in enumerate(turned):
        for a, b in zip(t, t[1:] + t[:1], strict=True):
            edges.setdefault(frozenset((a, b)), []).append((f, a))
    pairs = [both for both in edges.values() if len(both) == 2]
    part = list(range(len(turned)))
    for _ in part:
        for (f, _a), (g, _b) in pairs:
            part[f] = part[g] = min(part[f], part[g])
    torn = {part[f] for (f, a), (g, b) in pairs if a == b}
    unwound = {v for f, t in enumerate(turned) if part[f] in torn for v in t}
    held = topology.held
    counted = {v for name in ("boundary", "non-manifold edge") for v in held.get(name, np.empty(0, int)).tolist()}
    assert set(held.get("part that cannot be wound consistently", np.empty(0, int)).tolist()) == unwound - counted
    area = dict.fromkeys(part, 0.0)
    for f, (a, b, c) in enumerate(turned):
        area[part[f]] += np.linalg.det([points[b] - points[a], points[c] - points[a]])
    # Two faces one on the other have no area together, and no positive side.
    assert all(area[p] > -1e-15 for p in area if p not in torn)


def test_where_corners_are_many_rings_begin_at_int64(monkeypatch):
    """The switch lies at 2³¹ corners; here at 100."""
    mesh = gmsnet.random_mesh(300, seed=2)
    corners = mesh.cells[0].nodes
    mixed = mesh_of(mesh.points, np.where(np.arange(len(corners))[:, None] % 3, corners, corners[:, ::-1]))
    quads = mesh_of(mesh.points, corners[2:], extra=(CellBlock("quad", np.array([[0, 1, 2, 3]]), np.zeros(1, int)),))
    narrow = [(Topology.of(each), gmsnet.smooth(each, "laplacian", max_sweeps=2)) for each in (mesh, mixed, quads)]
    monkeypatch.setattr(faces, "NARROW", 100)
    for (one, smoothed), each in zip(narrow, (mesh, mixed, quads), strict=True):
        two = Topology.of(each)
        assert (one.near_start.dtype, two.near_start.dtype) == (np.int32, np.int64)
        assert two.near_ring.dtype == two.near.dtype == np.int32
        for name in ("near_start", "near_ring", "near_colours", "orientation", "free", "memory", "near"):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        for mine, other in zip(one.patches, two.patches, strict=True):
            np.testing.assert_array_equal(mine, other)
        for mine, other in zip(one.stars.blocks[:-1], two.stars.blocks[:-1], strict=True):
            np.testing.assert_array_equal(mine, other)
        for mine, other in zip(one.patterns or (), two.patterns or (), strict=True):
            np.testing.assert_array_equal(mine, other)
        np.testing.assert_array_equal(smoothed.points, gmsnet.smooth(each, "laplacian", max_sweeps=2).points)


def test_more_nodes_or_cells_than_int32_can_number_are_refused(monkeypatch):
    """The limit is 2³¹ − 1; here less."""
    points, triangles = wheel(6)
    mesh = mesh_of(points, triangles)
    monkeypatch.setattr(faces, "MOST", 6)
    with pytest.raises(InputError, match="the mesh has 7 nodes: gmsnet can number at most 6"):
        Topology.of(mesh)
    more = mesh_of(points[:6], np.repeat(triangles[:1], 7, axis=0))
    with pytest.raises(InputError, match="the mesh has 7 cells: gmsnet can number at most 6"):
        Topology.of(more)


def test_a_mesh_too_large_for_the_memory_at_hand_is_refused(monkeypatch):
    mesh = mesh_of(*wheel(6))
    monkeypatch.setattr(available_memory, "ALWAYS_FREE", 0)
    monkeypatch.setattr(available_memory, "available", lambda: 10_000)
    assert Topology.of(mesh).free.tolist() == [0]
    with pytest.raises(InputError, match=r"^smoothing 1,128 nodes needs about 0.000677 GB of memory, but only 1e-05"):
        gmsnet.smooth(gmsnet.random_mesh(1000, seed=0))
    with pytest.raises(InputError, match=r"^the connectivity of 1,128 nodes needs about 0.00024\d GB of memory"):
        gmsnet.quality(gmsnet.random_mesh(1000, seed=0))


@pytest.mark.parametrize("degree", [3, 4, 7, 64, 65, 100, 1000])
def test_wheels_of_any_degree(degree):
    points, triangles = wheel(degree)
    topology = Topology.of(mesh_of(points, triangles))
    assert topology.free.tolist() == [0]
    start, ring = topology.patches
    assert sorted(ring.tolist()) == list(range(1, degree + 1))
    assert topology.stars.blocks.degree.tolist() == [degree]
    assert start.tolist() == [0, degree]


def test_a_hub_of_too_many_neighbours_is_held():
    points, triangles = wheel(5000)
    topology = Topology.of(mesh_of(points, triangles))
    assert topology.held["more than 4096 neighbours"].tolist() == [0]


def test_two_wheels_that_touch_in_a_node_are_two_parts_and_wound_each_for_itself():
    a, triangles = wheel(6)
    b, _ = wheel(6, centre=(2.0, 0.0))
    points = np.vstack([a, b])
    second = triangles + 7
    second[second == 7 + 4] = 1  # the rightmost node of the one is the leftmost of the other: a bow-tie
    mesh = mesh_of(points, np.vstack([triangles, second[:, ::-1]]))
    topology = Topology.of(mesh)
    assert topology.orientation.tolist() == [1] * 6 + [-1] * 6
    assert topology.free.tolist() == [0, 7]
    assert topology.held["not used by any cell"].tolist() == [11]


def test_nodes_of_a_non_manifold_edge_are_held():
    points, triangles = wheel(6)
    points = np.vstack([points, [[0.1, 3.0]]])
    mesh = mesh_of(points, np.vstack([triangles, [[0, 1, 7]]]))
    topology = Topology.of(mesh)
    assert topology.free.size == 0
    check_against_twin(mesh, topology)


def test_a_strip_with_a_twist_is_held():
    """Five triangles that form a Möbius strip: no winding suits all, whatever the points."""
    triangles = [(i, (i + 1) % 5, (i + 2) % 5) for i in range(5)]
    points = np.random.default_rng(0).random((5, 2))
    topology = Topology.of(mesh_of(points, triangles))
    assert topology.free.size == 0


def test_interfaces_lines_vertices_and_foreign_cells_hold_their_nodes():
    rng = np.random.default_rng(5)
    points = rng.random((40, 2))
    triangles = Delaunay(points).simplices
    everything = mesh_of(points, triangles)
    free = Topology.of(everything).free.tolist()
    line = CellBlock("line", np.array([free[:2]]), np.array([7]))
    vertex = CellBlock("vertex", np.array([[free[2]]]), np.array([1]))
    held = Topology.of(mesh_of(points, triangles, extra=(line, vertex)))
    assert held.free.tolist() == free[3:]
    assert held.held["node of a line or vertex cell"].tolist() == free[:3]
    regions = np.zeros(len(triangles), dtype=int)
    regions[np.flatnonzero((triangles == free[0]).any(axis=1))[0]] = 1
    assert free[0] not in Topology.of(mesh_of(points, triangles, regions)).free


def test_triangles_beside_quads_and_six_node_triangles():
    points = np.array([[x, y] for y in range(4) for x in range(4)], dtype=float)
    quads, triangles = [], []
    for y in range(3):
        for x in range(3):
            a = 4 * y + x
            if x == 0:
                quads.append((a, a + 1, a + 5, a + 4))
            else:
                triangles += [(a, a + 1, a + 5), (a, a + 5, a + 4)]
    mesh = Mesh(points, (
        CellBlock("triangle", np.array(triangles), np.zeros(len(triangles), dtype=int)),
        CellBlock("quad", np.array(quads), np.full(len(quads), 0)),
    ))  # fmt: skip
    topology = Topology.of(mesh)
    assert topology.free.tolist() == [5, 6, 9, 10]
    six = CellBlock("triangle6", np.array([[0, 1, 5, 2, 3, 4]]), np.zeros(1, dtype=int))
    only = Topology.of(Mesh(points, (six,)))
    assert only.triangles.tolist() == [[0, 1, 5]]
    assert only.free.size == 0


def test_colours_and_patches_do_not_depend_on_the_coordinates():
    rng = np.random.default_rng(8)
    points = rng.random((200, 2))
    triangles = Delaunay(points).simplices
    turned = points @ np.array([[0.6, 0.8], [-0.8, 0.6]])
    one, two = Topology.of(mesh_of(points, triangles)), Topology.of(mesh_of(turned, triangles))
    np.testing.assert_array_equal(one.colours, two.colours)
    for mine, other in zip(one.patches, two.patches, strict=True):
        np.testing.assert_array_equal(mine, other)


def test_blocks_hold_every_star_once():
    rng = np.random.default_rng(9)
    points = rng.random((3000, 2))
    topology = Topology.of(mesh_of(points, Delaunay(points).simplices))
    stars, blocks = topology.stars, topology.stars.blocks
    seen = []
    for c in range(stars.colours):
        for b in range(stars.first[c], stars.first[c + 1]):
            places = blocks.centre[64 * b : 64 * b + blocks.filled[b]]
            assert (topology.near_colours[places] == c).all()
            assert (np.diff(topology.near_start)[places] == blocks.degree[b]).all()
            seen += topology.memory[places].tolist()
            block = blocks.rings[blocks.offset[b] : blocks.offset[b] + 64 * blocks.degree[b]].reshape(-1, 64)
            for lane, place in enumerate(places):
                wanted = topology.near_ring[topology.near_start[place] : topology.near_start[place + 1]]
                assert block[:, lane].tolist() == wanted.tolist()
            last = blocks.filled[b] - 1
            assert (blocks.centre[64 * b + last : 64 * (b + 1)] == blocks.centre[64 * b + last]).all()
            assert (block[:, last:] == block[:, [last]]).all()
    assert sorted(seen) == topology.free.tolist()


def test_meshes_without_faces_or_points():
    assert Topology.of(Mesh(np.empty((0, 2)), ())).free.size == 0
    lone = Topology.of(Mesh(np.zeros((3, 2)), ()))
    assert lone.held["not used by any cell"].tolist() == [0, 1, 2]


def octahedron():
    """A closed surface: every edge has two faces."""
    points = np.array([[1, 0], [-1, 0.1], [0, 1], [0.1, -1], [0.2, 0.1], [-0.1, 0.3]], dtype=float)
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    return points, faces


@pytest.mark.parametrize("shift", [0.0, 1.0, 1e3])
def test_a_closed_surface_pressed_flat_has_no_positive_side_and_is_held(shift):
    points, faces = octahedron()
    topology = Topology.of(mesh_of(points + shift, faces))
    assert topology.held["part of zero area, which has no positive side"].size == 6
    beside, triangles = wheel(6, centre=(9.0 + shift, 0.0))
    both = Topology.of(mesh_of(np.vstack([points + shift, beside]), np.vstack([faces, triangles + 6])))
    assert both.free.tolist() == [6]


@pytest.mark.parametrize("size", [1e-320, 1e-200, 1e-160, 1e160, 1e300])
def test_clockwise_meshes_of_any_size_are_wound_right(size):
    points, triangles = wheel(6)
    topology = Topology.of(mesh_of(points * size, triangles[:, ::-1]))
    assert topology.orientation.tolist() == [-1] * 6
    assert topology.free.tolist() == [0]


@pytest.mark.parametrize(("corner", "again"), list(permutations(range(4), 2)))
def test_nodes_of_a_quad_that_names_a_corner_twice_are_held(corner, again):
    points, triangles = wheel(6)
    quad = np.array([[0, 1, 2, 3]])
    quad[0, again] = quad[0, corner]
    topology = Topology.of(mesh_of(points, triangles, extra=[CellBlock("quad", quad, np.zeros(1, dtype=int))]))
    assert not set(topology.free.tolist()) & set(quad.ravel().tolist())


def test_a_closed_one_ring_of_triangles_and_a_collapsed_quad_is_held():
    points = np.array([[0.61, 0.84], [0.64, 0.59], [0.46, 0.55], [0.01, 0.48], [0.21, 0.88]])
    quad = CellBlock("quad", np.array([[3, 1, 1, 2]]), np.zeros(1, dtype=int))
    mesh = mesh_of(points, np.array([[4, 2, 3], [2, 1, 0], [4, 0, 2]]), extra=[quad])
    assert not len(Topology.of(mesh).free)
