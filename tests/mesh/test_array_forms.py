"""Arrays with regions and markers: what they say is held, and what comes in goes out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gmsnet
from gmsnet.errors import InputError
from gmsnet.mesh.adapters import to_mesh

POINTS = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.9, 1.1], [3.0, 1.0]])
FAN = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
QUADS = np.array([[0, 1, 4, 3], [1, 5, 2, 4]])
WALL = np.array([[0, 1], [1, 2]])


def halves(nodes=200):
    """A random square, its triangles, and on which side of its middle each of them is."""
    mesh = gmsnet.random_mesh(nodes, seed=3)
    points, triangles = np.array(mesh.points), np.array(next(b.nodes for b in mesh.cells if b.kind == "triangle"))
    left = points[triangles].mean(axis=1)[:, 0] < np.median(points[:, 0])
    return points, triangles, left


def interface(triangles, left):
    """The nodes of edges between the two sides, by a slow look at all edges."""
    sides = {}
    for corners, side in zip(triangles.tolist(), left.tolist(), strict=True):
        for k in range(3):
            sides.setdefault(frozenset((corners[k], corners[k - 1])), set()).add(side)
    return {node for edge, found in sides.items() if len(found) == 2 for node in edge}


@pytest.mark.parametrize("names", [(0, 1), ("steel", "copper"), (False, True)])
def test_nodes_between_two_regions_are_held(names):
    points, triangles, left = halves()
    regions = np.where(left, *names)
    alone = gmsnet.smooth((points, triangles), max_sweeps=2)
    given = {"points": points, "cells": triangles, "regions": regions}
    result = gmsnet.smooth(given, max_sweeps=2)
    between = interface(triangles, left)
    assert len(between) > 5
    assert not result.moved[list(between)].any()
    assert alone.moved[list(between)].any()
    assert list(result.mesh) == ["points", "cells", "regions"]
    assert result.mesh["cells"] is triangles
    assert result.mesh["regions"] is regions
    assert result.mesh["points"].tolist() == result.points.tolist()
    assert given["points"] is points
    same = gmsnet.smooth(gmsnet.mesh_from_arrays(points, triangles, regions), max_sweeps=2)
    assert same.points.tolist() == result.points.tolist()


def test_markers_of_edges_are_lines_and_those_of_nodes_are_sets():
    mesh = gmsnet.mesh_from_arrays(POINTS, FAN, markers={"wall": WALL, "probe": [4], "none": [], "far": WALL + 1})
    assert [(block.kind, len(block.nodes)) for block in mesh.cells] == [("triangle", 4), ("line", 2), ("line", 2)]
    assert {name: nodes.tolist() for name, nodes in mesh.markers.items()} == {
        "wall": [0, 1, 2], "far": [1, 2, 3], "probe": [4], "none": [],
    }  # fmt: skip
    assert gmsnet.mesh_from_arrays(POINTS, FAN, markers={"low": POINTS[:, 1] == 0}).markers["low"].tolist() == [0, 1]


def test_marked_edges_hold_their_nodes_and_sets_do_if_they_are_asked_to():
    points, triangles, left = halves()
    inner = sorted(set(triangles[left].ravel()) - set(triangles[~left].ravel()))
    free = gmsnet.smooth((points, triangles), max_sweeps=1)
    inner = [node for node in inner if free.moved[node]][:4]
    for markers, fixed in (({"a": [inner[:2], inner[2:]]}, None), ({"a": inner}, "a")):
        given = {"points": points, "cells": triangles, "markers": markers}
        result = gmsnet.smooth(given, fixed=fixed, max_sweeps=1)
        assert not result.moved[inner].any()
        assert result.mesh["markers"] is markers
    assert gmsnet.smooth({**given, "markers": {"a": inner}}, max_sweeps=1).moved[inner].any()


def test_regions_in_every_form():
    cells = {"triangle": FAN, "line": WALL}
    by_kind = {"triangle": [1, 1, 2, 2], "line": [7, 8]}
    for regions in (by_kind, list(by_kind.values()), [1, 1, 2, 2, 7, 8], np.array([1, 1, 2, 2, 7, 8], dtype=np.uint8)):
        mesh = gmsnet.mesh_from_arrays(POINTS, cells, regions)
        assert [block.regions.tolist() for block in mesh.cells] == list(by_kind.values())
    faces = gmsnet.mesh_from_arrays(POINTS, cells, [1, 1, 2, 2])
    assert [block.regions.tolist() for block in faces.cells] == [[1, 1, 2, 2], [0, 0]]
    named = gmsnet.mesh_from_arrays(POINTS, FAN, ["b", "a", "b", "b"], {"wall": WALL})
    assert [block.regions.tolist() for block in named.cells] == [[2, 1, 2, 2], [1, 1]]
    assert dict(named.region_names) == {(2, 1): "a", (2, 2): "b", (1, 1): "wall"}
    assert set(named.markers) == {"a", "b", "wall"}


def test_markers_reach_a_file(tmp_path):
    mesh = gmsnet.mesh_from_arrays(POINTS, FAN, markers={"wall": WALL, "rest": [[2, 3], [3, 0]]})
    gmsnet.write(mesh, tmp_path / "mesh.su2")
    again = gmsnet.read(tmp_path / "mesh.su2")
    assert {name: nodes.tolist() for name, nodes in again.markers.items()} == {"wall": [0, 1, 2], "rest": [0, 2, 3]}


@pytest.mark.parametrize("cells", [QUADS, QUADS.tolist(), [("quad", QUADS)], ("quad", QUADS), {"quad": QUADS}])
def test_four_columns_are_quads_in_the_plane(cells):
    mesh, restore = to_mesh((POINTS, cells))
    assert [(block.kind, block.nodes.tolist()) for block in mesh.cells] == [("quad", QUADS.tolist())]
    assert restore(POINTS)[1] is cells


@given(dtype=st.sampled_from([np.float32, np.float64]), cells=st.sampled_from([FAN, {"triangle": FAN}]))
def test_points_come_back_in_their_precision(dtype, cells):
    mesh, restore = to_mesh({"points": POINTS.astype(dtype), "cells": cells})
    assert mesh.single is (dtype == np.float32)
    assert restore(POINTS + 1)["points"].dtype == dtype


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"regions": [1, 2]}, "one number or name for each of the 4 cells, got 2"),
        ({"regions": 3}, "for each cell, got shape"),
        ({"regions": [[1, 1, 2, 2], [1]]}, "one for each array of cells"),
        ({"regions": [0.5, 1, 2, 2]}, "regions must be whole numbers"),
        ({"regions": {"triangle": [1, 1, 2, 2]}}, "cells given by the same kinds"),
        ({"markers": {"wall": [[0, 1, 2]]}}, "marker 'wall' must be pairs of nodes"),
        ({"markers": {"wall": [[0, 9]]}}, "line 0 .* names the nodes"),
        ({"markers": {"wall": [9]}}, "marker 'wall' names 9, but there are only 6 nodes"),
        ({"markers": {"wall": [0.5]}}, "marker 'wall' must be whole numbers"),
        ({"markers": {1: WALL}}, "the name of a marker must be a text, got 1"),
        ({"markers": [WALL]}, "markers must be a mapping"),
        ({"marker": {}}, "has no 'marker'; did you mean 'markers'"),
        ({"colour": {}}, "has no 'colour'; known are 'points', 'cells'"),
    ],
)
def test_what_cannot_be_used_is_named(more, message):
    with pytest.raises(InputError, match=message):
        to_mesh({"points": POINTS, "cells": FAN, **more})


def test_points_and_cells_are_needed():
    with pytest.raises(InputError, match="needs 'cells'"):
        gmsnet.smooth({"points": POINTS})
