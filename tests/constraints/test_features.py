"""The curves that nodes slide on: where they end, and which nodes slide."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.naive_curves import naive_chains, patchwork
from support.sliding import ring_mesh

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.constraints.features import Curves, curves_of
from gmsnet.generate.random import random_mesh

Chain = tuple[bool, frozenset[tuple[int, int]]]


def edges_of(nodes) -> frozenset[tuple[int, int]]:
    nodes = np.asarray(nodes)
    return frozenset(map(tuple, np.sort(np.column_stack([nodes[:-1], nodes[1:]]), axis=1).tolist()))


def chains_of(curves: Curves) -> set[Chain]:
    return {(bool(curves.closed[c]), edges_of(curves.nodes_of(c))) for c in range(len(curves))}


def on_circle(angles, radius=1.0):
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


@settings(max_examples=300)
@given(st.integers(0, 2**32 - 1), st.sampled_from([10.0, 30.0, 60.0, 120.0]))
def test_chains_are_those_of_the_slow_twin(seed, angle):
    mesh = patchwork(seed)
    curves = curves_of(mesh, True, angle)
    assert chains_of(curves) == naive_chains(mesh, angle)
    check_consistent(curves)


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1))
def test_in_double_precision_chains_are_the_same_or_cut_finer(seed):
    mesh = patchwork(seed)
    twin = naive_chains(mesh, 30.0)
    mesh = Mesh(mesh.points, mesh.cells)
    curves = curves_of(mesh)
    check_consistent(curves)
    found = chains_of(curves)
    assert all(any(edges <= whole for _, whole in twin) for _, edges in found)
    assert sum(len(edges) for _, edges in found) == sum(len(edges) for _, edges in twin)


def check_consistent(curves: Curves) -> None:
    """What the arrays say of each other."""
    inner = set()
    for c in range(len(curves)):
        nodes = curves.nodes_of(c).tolist()
        if curves.closed[c]:
            assert nodes[0] == nodes[-1]
            nodes = [nodes[-2], *nodes]
        for before, node, after in zip(nodes, nodes[1:], nodes[2:], strict=False):
            assert (curves.curve[node], curves.before[node], curves.after[node]) == (c, before, after)
            assert node not in inner
            inner.add(node)
    assert set(np.flatnonzero(curves.curve >= 0).tolist()) == inner
    assert (curves.curve[curves.slides] >= 0).all()


def test_a_square_has_four_straight_sides():
    curves = curves_of(random_mesh(100, "square"))
    assert len(curves) == 4
    assert curves.straight.all()
    assert set(curves.names) == {("bottom",), ("right",), ("top",), ("left",)}
    assert curves.slides.sum() == 36


def test_a_circle_is_one_closed_curve_without_ends():
    curves = curves_of(random_mesh(100, "circle", boundary="random"))
    assert curves.closed.tolist() == [True]
    assert not curves.straight.any()
    assert curves.slides.sum() == len(curves.nodes) - 1


@pytest.mark.parametrize(("sides", "corners"), [(11, 11), (12, 12), (13, 0)])
def test_turning_by_just_the_feature_angle_is_a_corner(sides, corners):
    mesh = ring_mesh(on_circle(2.0 * np.pi * np.arange(sides) / sides + 0.1))
    assert sides - curves_of(mesh).slides.sum() == corners


def test_turning_by_more_than_90_degrees_is_a_corner_at_any_feature_angle():
    mesh = ring_mesh([[0, 0], [1, 0], [0.5, 0.9]])
    curves = curves_of(mesh, True, 179.0)
    assert len(curves) == 3
    assert not curves.slides.any()
    square = curves_of(ring_mesh([[0, 0], [1, 0], [1, 1], [0, 1]]), True, 91.0)
    assert square.closed.tolist() == [True]
    assert square.slides.sum() == 4


def test_nodes_in_one_place_end_curves():
    angles = 2.0 * np.pi * np.arange(40) / 40
    angles[7] = angles[6]
    curves = curves_of(ring_mesh(on_circle(angles)), True, 100.0)
    assert sorted(np.flatnonzero(~curves.slides).tolist()) == [6, 7, 40]


def test_held_nodes_stay_and_the_curve_goes_on_through_them():
    mesh = ring_mesh(on_circle(2.0 * np.pi * np.arange(20) / 20))
    held = np.zeros(21, dtype=bool)
    held[[3, 4]] = True
    curves = curves_of(mesh, held=held)
    assert len(curves) == 1
    assert curves.slides.sum() == 18
    assert not curves.slides[held].any()
    assert (curves.before[5], curves.after[2]) == (4, 3)


def test_only_nodes_of_named_markers_slide():
    mesh = random_mesh(100, "plate")
    hole = curves_of(mesh, ["hole"])
    assert sorted(np.flatnonzero(hole.slides).tolist()) == mesh.markers["hole"].tolist()
    bottom = curves_of(mesh, "bottom")
    assert set(np.flatnonzero(bottom.slides).tolist()) < set(mesh.markers["bottom"].tolist())
    assert not curves_of(mesh, None).slides.any()
    assert len(curves_of(mesh, None)) == len(hole)


def stadium():
    """Two half circles and two straight sides of five edges, counter-clockwise; no corner turns by more than 10°."""
    arc = np.pi * np.arange(21) / 20 - np.pi / 2
    side, middle = np.arange(1, 5)[:, None] / 5, np.array([2.0, 0.0])
    right, left = on_circle(arc) + middle, on_circle(arc + np.pi) - middle
    return np.vstack([right, right[-1] + side * (left[0] - right[-1]), left, left[-1] + side * (right[0] - left[-1])])


@pytest.mark.parametrize("turn", [0, 3, 22, 27])
def test_straight_runs_within_a_curve_are_curves_of_their_own(turn):
    points = np.roll(stadium(), turn, axis=0) @ [[0.8, 0.6], [-0.6, 0.8]]
    curves = curves_of(ring_mesh(points))
    sizes = sorted((bool(curves.straight[c]), len(curves.nodes_of(c)) - 1) for c in range(len(curves)))
    assert sizes == [(False, 20), (False, 20), (True, 5), (True, 5)]
    assert curves.slides.sum() == len(points) - 4
    whole = curves_of(ring_mesh(points, single=True))
    assert whole.closed.tolist() == [True]


def test_nodes_of_cells_that_are_not_smoothed_do_not_slide():
    points = [[0, 0], [1, 0], [2, 0], [3, 0], [0, 1], [1, 1], [2, 1], [3, 1], [1.5, 2]]
    cells = (
        CellBlock("polygon", [[1, 2, 6, 8, 5]], [0]),
        CellBlock("triangle", [[0, 1, 5], [0, 5, 4], [2, 3, 7], [2, 7, 6]], np.zeros(4)),
    )
    assert not curves_of(Mesh(np.array(points, float), cells)).slides.any()


def test_nodes_of_second_order_cells_end_curves():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5], [1, 0.5], [0.5, 1]], float)
    cells = (CellBlock("triangle6", [[0, 1, 3, 4, 5, 6], [1, 2, 3, 7, 8, 5]], [0, 0]),)
    curves = curves_of(Mesh(points, cells), True, 100.0)
    assert (curves.curve == -1).all()
    assert len(curves) == 4


@pytest.mark.parametrize(
    ("name", "curves", "edges", "sliding", "closed"),
    [
        ("mesh_NACA0012_inv.su2", 2, 250, 249, 1),
        ("internal.msh", 5, 45, 40, 0),
        ("japan_sea.msh", 262, 793, 531, 0),
        ("ex28.msh", 4, 104, 100, 0),
        ("osteonT1_11.mesh", 152, 678, 526, 0),
        ("square_quad_10_rand.vtk", 4, 40, 36, 0),
        ("n0012_113-33.su2", 3, 240, 237, 0),
        ("mesh_NACA0012_lam_hybrid_v1.su2", 2, 250, 249, 1),
        ("square_triquad.mesh", 7, 100, 93, 0),
    ],
)
def test_curves_of_real_meshes(real_meshes, name, curves, edges, sliding, closed):
    found = curves_of(gmsnet.read(real_meshes / name))
    check_consistent(found)
    assert (len(found), len(found.nodes) - len(found)) == (curves, edges)
    assert (found.slides.sum(), found.closed.sum()) == (sliding, closed)


def test_an_airfoil_ends_at_its_trailing_edge(real_meshes):
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    curves = curves_of(mesh)
    airfoil, farfield = curves.names.index(("airfoil",)), curves.names.index(("farfield",))
    nodes = curves.nodes_of(airfoil)
    assert len(nodes) == 201
    assert not curves.closed[airfoil]
    assert nodes[0] == nodes[-1] == mesh.points[:, 0][mesh.markers["airfoil"]].argmax() + mesh.markers["airfoil"][0]
    assert curves.closed[farfield]
    assert len(curves.nodes_of(farfield)) == 51


REFEREE = """
import json, os, sys
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(sys.argv[1]))
from readers import load
from topology import topology
from curves import Curves
mesh = load(sys.argv[2])
print(json.dumps([(bool(closed), nodes.tolist()) for nodes, closed in Curves(mesh, topology(mesh), 30.0).chains]))
"""


@pytest.mark.parametrize(
    "name",
    [
        "mesh_NACA0012_inv.su2", "internal.msh", "japan_sea.msh", "ex28.msh", "osteonT1_11.mesh", "insulated.msh",
        "helmholtz_apartment.vtk", "n0012_113-33.su2", "square_triquad.mesh", "quadratic_quad.msh", "star-mixed-p2.vtk",
    ],
)  # fmt: skip
def test_curves_are_those_of_the_referee_or_cut_finer(real_meshes, name):
    program = os.environ.get("GMSNET_REFEREE")
    if not program:
        pytest.skip("GMSNET_REFEREE names no program")
    command = [sys.executable, "-c", REFEREE, str(Path(program)), str(real_meshes / name)]
    answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    wanted = {(closed, edges_of(nodes)) for closed, nodes in json.loads(answer)}
    curves = curves_of(gmsnet.read(real_meshes / name))
    found = chains_of(curves)
    if name == "japan_sea.msh":  # with straight runs
        assert (len(wanted), len(wanted - found), len(found - wanted)) == (258, 2, 6)
        assert all(any(edges <= whole for _, whole in wanted) for _, edges in found)
    else:
        assert found == wanted


def test_nodes_of_cells_of_an_unknown_kind_end_curves():
    mesh = ring_mesh(on_circle(2.0 * np.pi * np.arange(20) / 20))
    more = (*mesh.cells, CellBlock("blob", [[3, 4, 5]], [0]))
    curves = curves_of(Mesh(mesh.points, more))
    assert sorted(np.flatnonzero(curves.curve[:20] < 0).tolist()) == [3, 4, 5]
    assert curves.slides.sum() == 17
