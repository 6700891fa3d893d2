"""A Mesh is a value: nobody can change it, it shares nothing with what it was made of, nonsense makes none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import gmsnet
from gmsnet.errors import InputError
from gmsnet.mesh.arrays import read_only
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
NODES = np.array([[0, 1, 2], [1, 3, 2]])
REGIONS = np.array([4, 5])
LARGE = 2**53


def block():
    return CellBlock("triangle", NODES, REGIONS)


def full(**changes):
    facts = {
        "points": POINTS.copy(),
        "cells": [block()],
        "region_names": {(2, 4): "core"},
        "point_data": {"t": np.arange(4.0), "names": np.array(["a", "b", "c", "d"])},
        "cell_data": {"material": [np.array([4, 5])]},
        "node_sets": {"probe": np.array([1, 3])},
    }
    return Mesh(**{**facts, **changes})


# ------------------------------------------------------------------ cells


@pytest.mark.parametrize(
    "form",
    [
        np.ndarray.tolist,
        np.asfortranarray,
        lambda a: a.astype(float),
        lambda a: a.astype(np.float16),
        lambda a: a.astype(">i4"),
        lambda a: a.astype(np.uint64),
        lambda a: np.ma.masked_less(a, 0),
    ],
)
def test_whole_numbers_of_any_type_are_taken(form):
    made = CellBlock("triangle", form(NODES), form(REGIONS))
    assert made.nodes.dtype == made.regions.dtype == np.int64
    assert made.nodes.tolist() == NODES.tolist()
    assert made.regions.tolist() == REGIONS.tolist()


def test_no_cells_are_cells():
    made = CellBlock("triangle", np.zeros((0, 3)), [])
    assert made.nodes.shape == (0, 3)
    assert made.regions.dtype == np.int64


def test_regions_may_be_a_mask():
    assert CellBlock("triangle", NODES, [True, False]).regions.tolist() == [1, 0]


NO_NODES = [
    (NODES + 0.7, "the nodes of 'triangle' cells must be whole numbers, got 0.7"),
    (np.full((2, 3), np.nan), "got nan"),
    (np.full((2, 3), np.inf), "got inf"),
    (np.full((2, 3), 2.0**63), r"whole numbers, got 9\.2"),
    (np.full((2, 3), np.longdouble("1e4000")), "whole numbers, got inf"),
    (np.full((2, 3), 2**63 + 1, dtype=np.uint64), r"below 2\*\*63, got 9223372036854775809"),
    (np.full((2, 3), 2**70, dtype=object), "object values"),
    (NODES.astype(bool), "bool values"),
    (NODES.astype(str), r"<U\d+ values: give integers"),
    (NODES + 0j, "complex128 values"),
    (NODES.astype("timedelta64[s]"), "timedelta64"),
    ([[0, 1, 2], [1, 3]], "cannot be made an array"),
    (np.ma.masked_equal(NODES, 3), "masked values"),
    (None, "object values"),
    (NODES.ravel(), r"got shape \(6,\)"),
    (NODES[:, :2], "has 3 nodes, got 2"),
]


@pytest.mark.parametrize(("nodes", "message"), NO_NODES)
def test_nodes_that_are_no_numbers_of_nodes(nodes, message):
    with pytest.raises(InputError, match=message):
        CellBlock("triangle", nodes, [0, 0])


@pytest.mark.parametrize(
    ("regions", "message"),
    [
        ([0.2, 0.9], "the regions of 'triangle' cells must be whole numbers, got 0.2"),
        (["a", "b"], "give integers"),
        (np.ma.masked_equal([1, 2], 2), "masked"),
        ([1, 2, 3], "one region each"),
        (3, "one region each"),
        ([[1], [2, 3]], "cannot be made an array"),
    ],
)
def test_regions_that_are_no_numbers(regions, message):
    with pytest.raises(InputError, match=message):
        CellBlock("triangle", NODES, regions)


def test_the_type_of_cells_is_a_name():
    with pytest.raises(InputError, match="must be a name"):
        CellBlock(3, NODES, REGIONS)


@given(hnp.arrays(st.sampled_from([np.float64, np.float32]), 6, elements=st.floats(width=32)))
def test_floats_are_taken_exactly_where_no_value_changes(values):
    whole = all(np.isfinite(v) and abs(v) < LARGE and int(v) == v for v in values)
    if whole:
        assert CellBlock("polygon", values[None], [0]).nodes[0].tolist() == values.tolist()
    else:
        with pytest.raises(InputError, match="whole numbers"):
            CellBlock("polygon", values[None], [0])


# ------------------------------------------------------------------ meshes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": [["a", "b"]]}, "got <U1"),
        ({"points": POINTS + 0j}, "got complex128"),
        ({"points": POINTS > 0}, "got bool"),
        ({"points": [[0.0, 1.0], [2.0]]}, "points cannot be made an array"),
        ({"points": np.ma.masked_equal(POINTS, 1.0)}, "points hold masked values"),
        ({"points": POINTS.ravel()}, "N×2 or N×3"),
        ({"points": np.full((4, 2), np.longdouble("1e4000"))}, "node 0 .* not finite"),
        ({"cells": block()}, "must be a list of CellBlocks.* got one CellBlock"),
        ({"cells": None}, "got one NoneType"),
        ({"cells": NODES}, "a list with ndarray in it"),
        ({"cells": [block(), ("triangle", NODES)]}, "a list with tuple in it"),
        ({"points": POINTS[:3]}, r"triangle 1 .*\[1, 3, 2\], but the mesh has the nodes 0 to 2"),
        ({"points": np.zeros((0, 2)), "point_data": {}}, "but the mesh has no nodes"),
        ({"region_names": {1: "wall"}}, r"\{\(dimension, region\): name\}, got \{1: 'wall'\}"),
        ({"region_names": {(1, 2): 3}}, "of the form"),
        ({"region_names": ["wall"]}, "region_names must be a mapping"),
        ({"point_data": {"t": 3}}, "'t' has no rows for 4 points"),
        ({"point_data": {"t": [1, 2]}}, "'t' has 2 rows for 4 points"),
        ({"point_data": {"t": [[1], [2, 3], [4], [5]]}}, "'t' cannot be made an array"),
        ({"point_data": {"t": np.ma.masked_equal(range(4), 3)}}, "'t' hold masked"),
        ({"point_data": [1, 2, 3, 4]}, "point_data must be a mapping"),
        ({"cell_data": {"m": [[1, 2, 3]]}}, "'m' does not have one row"),
        ({"cell_data": {"m": [1, 2]}}, "'m' does not have one row"),
        ({"cell_data": {"m": 3}}, "'m' does not have one row"),
        ({"cell_data": {"m": [[1, 2], [3]]}}, "'m' does not have one row"),
        ({"node_sets": {"s": [4]}}, "node set 's' names the node 4, but the mesh has the nodes 0 to 3"),
        ({"node_sets": {"s": [2, -1]}}, "names the node -1"),
        ({"node_sets": {"s": [0.5]}}, "node set 's' must be whole numbers"),
        ({"node_sets": {"s": [[1], [2]]}}, "'s' must be a list of node ids"),
        ({"node_sets": {"s": [True, False, True, False]}}, "give integers"),
    ],
)
def test_what_is_no_mesh_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        full(**changes)


def arrays_of(mesh):
    return [
        mesh.points,
        *(array for b in mesh.cells for array in (b.nodes, b.regions)),
        *mesh.point_data.values(),
        *(part for parts in mesh.cell_data.values() for part in parts),
        *mesh.node_sets.values(),
    ]


def test_no_array_can_be_written_to():
    for array in arrays_of(full()):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = array


def test_nothing_is_shared_with_what_it_was_made_of():
    points, data, sets = POINTS.copy(), np.arange(4.0), np.array([1, 3])
    material = np.array([4, 5])
    nodes, regions = NODES.copy(), REGIONS.copy()
    view = points[:]
    view.flags.writeable = False  # read-only itself, but points is not
    mesh = Mesh(
        view,
        (CellBlock("triangle", nodes, regions),),
        point_data={"t": data},
        cell_data={"m": (material,)},
        node_sets={"s": sets},
    )
    was = [array.copy() for array in arrays_of(mesh)]
    for given_array in (points, data, sets, material, nodes, regions):
        assert given_array.flags.writeable
        given_array[...] = 0
    for now, before in zip(arrays_of(mesh), was, strict=True):
        assert (now == before).all()


def test_a_copy_with_other_points_copies_nothing_else():
    mesh = full()
    moved = mesh.with_points(POINTS + 1)
    again = replace(mesh, single=True)
    assert all(a is b for a, b in zip(arrays_of(mesh)[1:], arrays_of(moved)[1:], strict=True))
    assert all(a is b for a, b in zip(arrays_of(mesh), arrays_of(again), strict=True))
    assert (moved.points == POINTS + 1).all()
    assert (mesh.points == POINTS).all()


def test_memory_that_may_change_is_copied():
    data = bytearray(POINTS.tobytes())
    seen = np.frombuffer(data).reshape(4, 2)
    seen.flags.writeable = False
    kept = read_only(seen)
    data[:] = bytes(len(data))
    assert (kept == POINTS).all()
    assert read_only(kept) is kept
    part = kept[1:3]
    assert read_only(part) is part


def test_blocks_may_come_from_a_generator():
    assert len(full(cells=(b for b in [block()])).cells) == 1


@pytest.mark.parametrize(("axis", "plane"), [(0, (1, 2)), (1, (0, 2)), (2, (0, 1))])
def test_without_cells_a_mesh_stays_in_the_plane_that_they_were_in(axis, plane):
    """A node that no cell uses may lie anywhere."""
    points = np.insert(np.random.default_rng(0).random((5, 2)), axis, 3.0, axis=1)
    points[4] = [7.0, 8.0, 9.0]
    mesh = Mesh(points, (CellBlock("triangle", np.array([[0, 1, 2], [1, 3, 2]]), np.zeros(2, int)),), single=True)
    bare = mesh.without_cells()
    assert mesh.plane == bare.plane == bare.with_points(points + 1.0).plane == plane
    assert bare.points is mesh.points
    assert bare.single
    assert not bare.cells
    assert len(mesh.cells) == 1


def test_other_points_change_nothing_else():
    mesh = full(points=np.column_stack([POINTS, np.zeros(4)]))
    assert mesh.plane == (0, 1)
    other = mesh.with_points(mesh.points[:, [2, 0, 1]])
    assert other.plane == (1, 2)
    assert mesh.plane == (0, 1)
    assert {name: value for name, value in vars(other).items() if name not in ("points", "plane")} == {
        name: value for name, value in vars(mesh).items() if name not in ("points", "plane")
    }
    with pytest.raises(InputError, match=r"node 2 .* not finite"):
        mesh.with_points(np.where(np.arange(4)[:, None] == 2, np.nan, mesh.points))


def test_a_mesh_is_shown_without_its_file(tmp_path):
    gmsnet.write(gmsnet.random_mesh(2000, seed=0), tmp_path / "a.su2")
    mesh = gmsnet.read(tmp_path / "a.su2")
    assert "NDIME" not in repr(mesh)
    assert "NDIME" not in repr(mesh.source)
    assert len(repr(mesh)) < 5000, "arrays are shortened"
    assert len(repr(gmsnet.smooth(mesh))) < 20000
