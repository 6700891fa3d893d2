"""Layers around bodies so coarse that the cells around a node are flat one by one, but not in the mean."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import gmsnet
from gmsnet.generate import structured_mesh
from gmsnet.kernels.topology import columns as kernels
from gmsnet.preserve.flat_cells import ALONG_WALL, BROAD, COHERENT, DETERMINANT, FLAT, FLAT_EACH, STEEP, feet
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import space_points, taken

ROWS, GROWTH = 6, 1.3


def cube_on_a_sphere(count):
    """Quads that look outwards, so many by so many on each side."""
    number, nodes, quads = {}, [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            for u in range(count):
                for v in range(count):
                    quad = []
                    for i, j in ((u, v), (u + 1, v), (u + 1, v + 1), (u, v + 1)):
                        at = np.empty(3)
                        at[axis], at[axis - 2], at[axis - 1] = side, 2 * i / count - 1, 2 * j / count - 1
                        quad.append(number.setdefault(tuple(at), len(number)))
                        if len(number) > len(nodes):
                            nodes.append(at / np.linalg.norm(at))
                    quads.append(quad if side > 0.0 else quad[::-1])
    return np.array(nodes), np.array(quads)


def ball(count):
    """Triangles that look outwards; nodes on a spiral."""
    number = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * number / count, np.pi * (1.0 + np.sqrt(5.0)) * number
    nodes = np.column_stack([np.sqrt(1.0 - z * z) * np.cos(angle), np.sqrt(1.0 - z * z) * np.sin(angle), z])
    faces = ConvexHull(nodes).simplices
    normals = np.cross(nodes[faces[:, 1]] - nodes[faces[:, 0]], nodes[faces[:, 2]] - nodes[faces[:, 0]])
    inwards = (normals * nodes[faces].mean(axis=1)).sum(axis=1) < 0.0
    return nodes, np.where(inwards[:, None], faces[:, ::-1], faces)


def grown(nodes, faces, height):
    """Wedges or hexahedra over the faces of a body around the origin."""
    reach = 1.0 + np.concatenate([[0.0], np.cumsum(height * GROWTH ** np.arange(ROWS))])
    cells = [np.hstack([faces + row * len(nodes), faces + (row + 1) * len(nodes)]) for row in range(ROWS)]
    kind = "wedge" if faces.shape[1] == 3 else "hexahedron"
    block = gmsnet.CellBlock(kind, np.concatenate(cells), np.zeros(ROWS * len(faces), dtype=np.int64))
    return gmsnet.Mesh(np.concatenate([nodes * r for r in reach]), (block,))


@pytest.mark.parametrize("body", [ball(15), ball(20), ball(30), cube_on_a_sphere(2)])
@pytest.mark.parametrize("height", [0.01, 0.03, 0.05])
def test_rows_around_a_coarse_ball_keep_their_heights(body, height):
    mesh = grown(*body, height)
    result = gmsnet.smooth(mesh)
    assert (result.points == mesh.points).all()
    assert any("stretched alike" in note for note in result.notes)
    moved = gmsnet.smooth(mesh, preserve="none")
    assert (moved.points != mesh.points).any()  # they could be


def test_cubes_of_a_grid_that_is_bent_are_no_layers():
    """Flat by less than FLAT_EACH, and in directions that turn."""
    grid = structured_mesh(8).points[:, :2]
    angle, radius = 2.0 * grid[:, 0], 1.0 + 0.3 * grid[:, 1]
    plane = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    faces = structured_mesh(8).cells[0].nodes
    points = np.concatenate([np.column_stack([plane, np.full(len(plane), z)]) for z in np.linspace(0.0, 1.0, 5)])
    cells = np.concatenate([np.hstack([faces + k * 81, faces + (k + 1) * 81]) for k in range(4)])
    block = gmsnet.CellBlock("hexahedron", cells, np.zeros(len(cells), dtype=np.int64))
    result = gmsnet.smooth(gmsnet.Mesh(points, (block,)))
    assert not any("stretched alike" in note for note in result.notes)


def moment(corners):
    """Of a tetrahedron (4, 3), of trace 1, as a matrix."""
    total = sum(np.outer(a - b, a - b) for k, a in enumerate(corners) for b in corners[:k])
    return total / np.trace(total)


@pytest.mark.parametrize("seed", range(20))
def test_feet_against_a_slow_twin(seed):
    """A fan of flat tetrahedra over a cap, whose edges fall away from its node by up to 40 degrees."""
    draw = np.random.default_rng(seed)
    count, fall, height = 6, np.radians(draw.uniform(0.0, 45.0)), 10.0 ** draw.uniform(-2.5, -0.5)
    angle = 2.0 * np.pi * np.arange(count) / count + draw.uniform(-0.2, 0.2, count)
    rim = np.column_stack([np.cos(fall) * np.cos(angle), np.cos(fall) * np.sin(angle), np.full(count, -np.sin(fall))])
    points = np.concatenate([[[0.0, 0.0, 0.0]], rim, [[0.0, 0.0, height]]])
    around = np.arange(count)
    rows = np.column_stack([0 * around, 1 + around, 1 + (around + 1) % count, 0 * around + count + 1]).astype(np.int32)
    wall = np.arange(len(points)) <= count
    places, normal, flatness = feet(np.column_stack([points, 0.0 * points[:, 0]]), rows, wall, BROAD)

    each = [moment(points[row]) for row in rows]
    values, vectors = np.linalg.eigh(np.mean(each, axis=0))
    mean = np.sqrt(np.sqrt(values[1] * values[2]) / values[0]) if values[1] >= BROAD**2 * values[0] else 1.0
    edges = [(corner - points[0]) / np.linalg.norm(corner - points[0]) for corner in rim]
    expected = None
    across = np.mean([(edge @ vectors[:, 0]) ** 2 for edge in edges])
    if np.linalg.det(np.mean(each, axis=0)) < DETERMINANT and mean >= FLAT and across <= ALONG_WALL:
        expected = mean, vectors[:, 0]
    if expected is None and all(np.linalg.det(one) < DETERMINANT for one in each):
        flat, ways = [], []
        for one in each:
            values, vectors = np.linalg.eigh(one)
            broad = values[1] >= BROAD**2 * values[0]
            flat.append(np.sqrt(np.sqrt(values[1] * values[2]) / values[0]) if broad else 1.0)
            ways.append(vectors[:, 0])
        values, vectors = np.linalg.eigh(np.mean([np.outer(way, way) for way in ways], axis=0))
        common = vectors[:, 2]
        if values[2] >= COHERENT and max((edge @ common) ** 2 for edge in edges) <= STEEP:
            flat = np.exp(np.mean(np.log(flat)))
            expected = (flat, common) if flat >= FLAT_EACH else None
    assert (0 in places) == (expected is not None)
    if expected is not None:
        at = int(np.flatnonzero(places == 0)[0])
        assert flatness[at] == pytest.approx(expected[0])
        assert abs(normal[at] @ expected[1]) == pytest.approx(1.0)


def test_the_cells_of_a_star_are_told_one_by_one():
    mesh = grown(*ball(20), 0.1)
    topology = volume_of(wound_of(mesh))
    points, nodes = taken(space_points(mesh), topology.memory), np.flatnonzero(np.diff(topology.start) > 0)
    nodes = nodes.astype(np.int32)
    total = int((topology.start[nodes + 1] - topology.start[nodes]).sum())
    found = np.empty((total, kernels.MOMENTS))
    stars = topology.start, topology.local, topology.ring_start, topology.ring
    kernels.of_stars(points, nodes, *stars, found)
    row = 0
    for node in nodes:
        for local in topology.local[topology.start[node] : topology.start[node + 1]]:
            corners = points[[*topology.ring[topology.ring_start[node] + local[:3]], node], :3]
            expected = moment(corners)
            np.testing.assert_allclose(found[row], expected[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], atol=1e-12)
            row += 1
    assert row == total
