"""The arrays of a page: what is drawn is the mesh."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.pages import Page, unpacked

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.cells.table import CELLS
from gmsnet.generate import random_mesh, split_into_quads
from gmsnet.measure.worst import worst_cells
from gmsnet.page import Contents
from gmsnet.page.arrays import packed
from gmsnet.page.document import pieces
from gmsnet.page.groups import MOST_FACETS, groups_of, shell_of
from gmsnet.page.scene import scene_of

KINDS = {"u1": np.uint8, "u2": np.uint16, "u4": np.uint32, "i2": np.int16, "f4": np.float32}


def alone(mesh: Mesh) -> Contents:
    report = gmsnet.quality(mesh)
    return Contents("mesh", "", mesh, report, {}, "", worst_cells(mesh, report, count=3))


@given(st.sampled_from(sorted(KINDS)), st.lists(st.integers(0, 2**32 - 1), max_size=50))
def test_arrays_are_read_as_they_are_written(kind, values):
    array = np.array(values, dtype=np.uint32).astype(KINDS[kind])
    known, elements = packed({"one": array})
    (element,) = elements
    page = Page(element.encode())
    read = unpacked(page.scripts[0][1].strip(), known["one"]["type"], known["one"]["count"])
    assert read.tobytes() == array.tobytes()


def slow_shell(mesh: Mesh) -> set[tuple[int, int]]:
    """(cell, facet) of the facets of one cell alone, by their sets of corners."""
    seen: dict[frozenset[int], list[tuple[int, int]]] = {}
    cell = 0
    for block in mesh.cells:
        for nodes in block.nodes.tolist():
            if block.dimension == 3:
                for k, facet in enumerate(CELLS[block.kind].facets):
                    corners = frozenset(nodes[node] for node in facet if node < block.corners)
                    seen.setdefault(corners, []).append((cell, k))
            cell += 1
    return {facets[0] for facets in seen.values() if len(facets) == 1}


def bricks() -> Mesh:
    """Eight hexahedra, a pyramid on each of the four above, and a wedge beside one."""
    places = np.array([(x, y, z) for z in range(4) for y in range(3) for x in range(4)], dtype=float)
    number = {tuple(map(int, place)): k for k, place in enumerate(places)}
    hexes, pyramids = [], []
    for x in range(2):
        for y in range(2):
            for z in range(2):
                low = [number[x + a, y + b, z] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                high = [number[x + a, y + b, z + 1] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                hexes.append(low + high)
            pyramids.append([*high, number[x, y, 3]])
    wedge = [number[2, 0, 0], number[3, 0, 0], number[2, 1, 0], number[2, 0, 1], number[3, 0, 1], number[2, 1, 1]]
    cells = [("pyramid", pyramids), ("hexahedron", hexes), ("wedge", [wedge])]
    return Mesh(places, tuple(CellBlock(kind, np.array(rows), np.zeros(len(rows), int)) for kind, rows in cells))


@pytest.mark.parametrize("most", [1 << 21, 1])
@pytest.mark.parametrize("make", [bricks, None])
def test_the_shell_is_made_of_the_facets_of_one_cell(make, most, volume, monkeypatch):
    mesh = make() if make else volume.mesh
    groups, left_out = groups_of(mesh)
    assert left_out == ""
    number = np.concatenate([group.number for group in groups])
    shell = shell_of(groups, len(mesh.points) if most > 1 else (1 << 21) + 1)
    found = {(int(number[code // MOST_FACETS]), int(code % MOST_FACETS)) for code in shell}
    assert found == slow_shell(mesh)
    assert len(found) == len(shell)


@pytest.mark.parametrize("name", ["planar", "volume"])
def test_cells_and_nodes_are_those_of_the_mesh(name, request):
    contents = request.getfixturevalue(name)
    page = Page(b"".join(pieces(contents)))
    scene, corners = page.block("scene"), page.array("corners")
    numbers = page.array("numbers") if "numbers" in scene["arrays"] else np.arange(scene["cells"])
    before = page.array("before").view(np.uint32)
    states = {
        "before": before.view(np.float32),
        "after": (page.array("after").view(np.uint32) ^ before).view(np.float32),
    }
    group = scene["groups"][0]
    nodes = corners.reshape(group["corners"], group["count"]).T
    block = next(each for each in contents.mesh.cells if each.kind == group["kind"])
    assert Counter(numbers.tolist()) == Counter(contents.after.cell.tolist())
    for state, report in contents.reports.items():
        places = states[state].reshape(scene["dimension"], -1).T.astype(np.float64)
        if scene["fine"]:
            pytest.fail("these meshes need no more than single precision")
        drawn = places * scene["half"] + scene["middle"]
        real = report.cells.points[block.nodes][..., : scene["dimension"]]
        edges = np.linalg.norm(real - np.roll(real, 1, axis=1), axis=2)
        assert np.abs(drawn[nodes] - real).max() < edges.min() / 256
        shape = page.array(f"shape-{state}")
        assert np.array_equal(shape, np.rint(report.shape * 1000))
        assert np.array_equal(page.array(f"invalid-{state}"), np.flatnonzero(~report.valid))
    for k, ids in enumerate(contents.held.values(), start=1):
        assert np.count_nonzero(page.array("held") == k) == len(np.intersect1d(ids, block.nodes))


@pytest.mark.parametrize("thin", [1e-3, 1e-7, 1e-10])
def test_layers_that_are_thinner_than_single_precision_can_tell_are_drawn(thin):
    heights = np.cumsum([0.0, thin, thin, thin, 1.0])
    points = np.array([(x, y) for y in heights for x in (0.3, 0.5)])
    rows = np.array([[2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2] for k in range(4)])
    scene = scene_of(alone(Mesh(points, (CellBlock("quad", rows, np.zeros(4, int)),))))
    places = scene.arrays["now"].reshape(2, -1).T.astype(np.float64)
    assert scene.known["fine"] == (thin < 1e-4)
    if scene.known["fine"]:
        places = places + scene.arrays["nowLow"].reshape(2, -1).T
    drawn = (places * scene.known["half"])[scene.arrays["corners"].reshape(4, -1).T]
    steps = drawn[:3, 3, 1] - drawn[:3, 0, 1]
    assert np.abs(steps / thin - 1.0).max() < 1e-2


def test_volumes_of_several_kinds_are_drawn_with_their_measures():
    scene = scene_of(alone(bricks()))
    assert scene.known["volumes"]
    assert scene.arrays["shape-now"].tolist() == [756] * 4 + [1000] * 8 + [901]
    assert not len(scene.arrays["invalid-now"])
    assert [group["kind"] for group in scene.known["groups"]] == ["pyramid", "hexahedron", "wedge"]


def test_cells_whose_quality_is_not_known_are_drawn_as_such():
    mesh = bricks()
    curved = np.array([[*mesh.cells[0].nodes[0], *range(8)]])
    scene = scene_of(alone(replace(mesh, cells=(CellBlock("pyramid13", curved, np.zeros(1, int)),))))
    assert (scene.arrays["shape-now"] == scene.known["unknown"]).all()
    assert [group["kind"] for group in scene.known["groups"]] == ["pyramid13"]


def test_cells_of_a_kind_that_is_not_known_are_named():
    mesh = random_mesh(30, seed=1)
    blob = CellBlock("blob", mesh.cells[0].nodes[:4], np.zeros(4, int))
    scene = scene_of(alone(replace(mesh, cells=(*mesh.cells, blob), source=None)))
    assert scene.remark == "Not drawn: 4 blob, whose shape is not known."


def test_quads_have_their_own_scale_of_angles():
    assert scene_of(alone(split_into_quads(random_mesh(30, seed=1)))).known["greatest_angle"] == 90.0
    assert scene_of(alone(random_mesh(30, seed=1))).known["greatest_angle"] == 60.0


@pytest.mark.parametrize("name", ["planar", "volume"])
def test_of_large_meshes_the_worst_cells_and_the_boundary_are_drawn(name, request, monkeypatch):
    contents = request.getfixturevalue(name)
    whole = scene_of(contents)
    monkeypatch.setattr("gmsnet.page.scene.MOST_CELLS", 100)
    monkeypatch.setattr("gmsnet.page.selection.FEW_CELLS", 60)
    scene = scene_of(contents)
    numbers = scene.arrays["numbers"].tolist()
    assert len(numbers) == len(set(numbers)) == scene.known["cells"] < whole.known["cells"]
    assert {cell["cell"] for cell in (*contents.worst_after, *contents.worst_before)} <= set(numbers)
    assert f"The mesh has {whole.known['cells']:,} cells, more than" in scene.remark
    row = np.full(max(contents.after.cell) + 1, -1)
    row[contents.after.cell] = np.arange(len(contents.after.cell))
    assert np.array_equal(scene.arrays["shape-after"], np.rint(contents.after.shape[row[numbers]] * 1000))
    if name == "planar":
        assert len(numbers) == 60
    else:
        facets = {(numbers[code // MOST_FACETS], int(code % MOST_FACETS)) for code in scene.arrays["shell"]}
        assert facets == slow_shell(contents.mesh)
    assert scene.known["nodes"] == len(np.unique(scene.arrays["corners"])) + lines_apart(scene)


def lines_apart(scene) -> int:
    """How many nodes belong to lines alone."""
    return len(np.setdiff1d(scene.arrays["lines"], scene.arrays["corners"]))


def test_extreme_coordinates_have_a_picture():
    mesh = random_mesh(30, seed=1)
    for scale in (1e-300, 1e150):
        scene = scene_of(alone(mesh.with_points(mesh.points * scale)))
        assert np.isfinite(scene.arrays["now"]).all()
        assert np.abs(scene.arrays["now"]).max() == 1.0
