"""Areas of regions in exact sums, and by how much sliding changes them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.naive_curves import patchwork, sagittas
from support.sliding import constraint_by_ids, push, slid_at_random

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.constraints.area import area_changes, areas, borders_of
from gmsnet.constraints.features import curves_of
from gmsnet.generate.random import random_mesh
from gmsnet.topology.ordering import planar_points


def exact_areas(mesh: Mesh, points: np.ndarray) -> dict[int, Fraction]:
    """Region → the sum of its faces' areas, each counted as positive."""
    found: dict[int, Fraction] = {}
    for block in mesh.cells:
        if block.dimension == 2:
            for row, region in zip(block.nodes.tolist(), block.regions.tolist(), strict=True):
                p = [[Fraction(v) for v in points[node]] for node in row]
                twice = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(p, [*p[1:], p[0]], strict=True))
                found[region] = found.get(region, Fraction(0)) + abs(twice) / 2
    return found


@given(st.integers(0, 2**32 - 1))
@example(95043149)  # one region, which is not number 0
def test_areas_are_exact_and_rounded_once(seed):
    rng = np.random.default_rng(seed)
    mesh = patchwork(seed, even=True)
    points = mesh.points * rng.uniform(0.1, 10.0, 2) + rng.uniform(-1e3, 1e3, 2)
    if not any(block.dimension == 2 for block in mesh.cells):
        return
    mesh = Mesh(points, mesh.cells)
    borders = borders_of(mesh, points)
    wanted = exact_areas(mesh, points)
    assert list(borders.regions) == sorted(wanted)
    assert areas(borders, points).tolist() == [float(wanted[region]) for region in sorted(wanted)]


def test_moves_inside_change_no_area():
    mesh = random_mesh(200, "plate", seed=1)
    borders, old = borders_of(mesh, mesh.points), mesh.points
    new = old.copy()
    inner = np.ones(len(old), dtype=bool)
    inner[borders.tail] = False
    new[inner] += 1e-3 * np.random.default_rng(0).standard_normal((inner.sum(), 2))
    assert area_changes(borders, old, new).tolist() == [0.0]


def test_faces_wound_either_way_have_positive_areas():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [3, 0], [4, 0], [3, 2]], float)
    cells = (CellBlock("triangle", [[0, 1, 2], [0, 3, 2], [4, 6, 5]], [1, 1, 2]),)
    assert areas(borders_of(Mesh(points, cells), points), points).tolist() == [1.0, 1.0]


def test_sliding_on_lines_keeps_the_area_to_rounding():
    mesh = random_mesh(200, "lshape", boundary="random", seed=1)
    after = slid_at_random(mesh, curves_of(mesh), 0)
    assert (mesh.points != after.points).any()
    assert abs(area_changes(borders_of(mesh, mesh.points), mesh.points, after.points)).max() < 1e-15


def test_even_nodes_of_a_circle_that_slide_together_keep_the_area():
    mesh = random_mesh(400, "circle", seed=2)
    curves, points = curves_of(mesh), planar_points(mesh)
    constraint, nodes = constraint_by_ids(mesh, curves), curves.nodes_of(0)
    p = points[nodes]
    borders = borders_of(mesh, points)
    bound = (2.0 / 3.0 * np.hypot(*np.diff(p, axis=0).T) * sagittas(p, True)).sum() / areas(borders, points)[0]
    middle, radius = p[:-1].mean(axis=0), np.hypot(*(p[0] - p[:-1].mean(axis=0)))
    rng = np.random.default_rng(0)
    new = points.copy()
    for node in nodes[:-1].tolist():
        angle = np.arctan2(*(points[node] - middle)[::-1]) + 0.3 * 2.0 * np.pi / len(p) * rng.uniform(-1.0, 1.0)
        push(constraint, new, node, *(middle + radius * np.array([np.cos(angle), np.sin(angle)])))
    assert 0.0 < abs(area_changes(borders, points, new)[0]) < bound


def test_regions_of_a_real_mesh(real_meshes):
    mesh = gmsnet.read(real_meshes / "osteonT1_11.mesh")
    borders = borders_of(mesh, mesh.points)
    wanted = exact_areas(mesh, mesh.points[:, :2])
    found = areas(borders, np.ascontiguousarray(mesh.points[:, :2]))
    assert dict(zip(borders.regions, found.tolist(), strict=True)) == pytest.approx(
        {region: float(area) for region, area in wanted.items()}, rel=1e-12
    )
