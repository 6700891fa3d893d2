"""Every sensible way to say which nodes are held gives the same mask; every other is refused, not guessed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.errors import InputError
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.selection import fixed_mask

POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 2.0]])
NAMES = {(1, 1): "inlet", (1, 2): "outlet", (2, 7): "core"}
CELLS = (CellBlock("triangle", [[0, 1, 2], [1, 3, 2]], [7, 8]), CellBlock("line", [[0, 1], [1, 3]], [1, 2]))


def mesh_with(fixed=None):
    data = {} if fixed is None else {"fixed": fixed}
    return Mesh(POINTS, CELLS, NAMES, point_data=data)


def ids_of(mesh, fixed=None):
    mask = fixed_mask(mesh, fixed)
    assert mask.dtype == bool
    assert mask.shape == (len(mesh.points),)
    return np.flatnonzero(mask).tolist()


@pytest.mark.parametrize(
    ("form", "ids"),
    [
        (None, []),
        ([], []),
        ((), []),
        (set(), []),
        (np.zeros(0, dtype=object), []),
        (3, [3]),
        (np.int32(3), [3]),
        ([1, 3], [1, 3]),
        ((3, 1, 3), [1, 3]),
        ({1, 3}, [1, 3]),
        (frozenset({1, 3}), [1, 3]),
        ({1: "a", 3: "b"}.keys(), [1, 3]),
        (range(1, 4), [1, 2, 3]),
        (range(0), []),
        (np.array([1, 3], dtype=np.uint64), [1, 3]),
        (np.array([1, 3], dtype=np.int8), [1, 3]),
        (np.array([[1, 3], [0, 4]]), [0, 1, 3, 4]),
        ([[1, 3], [0, 4]], [0, 1, 3, 4]),
        (np.array([1, 3], dtype=object), [1, 3]),
        (np.array([True, False, False, False, True]), [0, 4]),
        ([True, False, False, False, True], [0, 4]),
        (np.array([True, False, False, False, True], dtype=object), [0, 4]),
        ("inlet", [0, 1]),
        ("core", [0, 1, 2]),
        (["inlet", "outlet"], [0, 1, 3]),
        ({"inlet", "outlet"}, [0, 1, 3]),
        (np.array(["inlet", "outlet"]), [0, 1, 3]),
        (np.array(["inlet", "outlet"], dtype=object), [0, 1, 3]),
    ],
)
def test_every_form(form, ids):
    assert ids_of(mesh_with(), form) == ids
    assert ids_of(mesh_with([0, 0, 1, 0, 0]), form) == sorted({*ids, 2})


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ([5], "names the node 5, but the mesh has the nodes 0 to 4"),
        ([0, -1], "names the node -1"),
        (np.array([2**63 + 1], dtype=np.uint64), "names the node 9223372036854775809"),
        (np.array([200], dtype=np.uint8), "names the node 200"),
        ([2**70], "names the node 1180591620717411303424"),
        ([-1, 2**63], "names the node 9223372036854775808"),
        ([[1, 2], [3]], "one flat list"),
        (np.array([[1, 2], [3]], dtype=object), "one flat list"),
        ([1, "inlet"], "names mixed with other values"),
        (np.array([1, "inlet"], dtype=object), "names mixed with other values"),
        ({1, "inlet"}, "names mixed with other values"),
        ([0.5], r"float64 values: give integers"),
        (np.array([1.0, 2.0]), r"give integers, as by \.astype\(int\)"),
        (1.0, "give integers"),
        ([1, None], "got object values"),
        ([1j], "complex128"),
        (b"inlet", "values"),
        ([b"inlet"], "values"),
        ({"inlet": 1}, "got one dict: give a list"),
        ((i for i in [1]), "got one generator: give a list"),
        (CELLS[0], "got one CellBlock"),
        (np.ma.masked_equal([1, 2], 2), "masked"),
        (True, "one value per node"),
        ([True, False], r"one value per node, \(5,\), got shape \(2,\)"),
        (np.zeros((5, 1), dtype=bool), "one value per node"),
        ("inlett", "no marker 'inlett'; did you mean 'inlet'"),
        ("", "no marker ''"),
    ],
)
def test_everything_else_is_refused(form, message):
    with pytest.raises(InputError, match=message):
        fixed_mask(mesh_with(), form)


@given(st.lists(st.integers(-2, 7)))
def test_ids_are_held_or_refused(ids):
    if len(ids) == 5 and set(ids) <= {0, 1}:
        with pytest.raises(InputError, match="give a mask as bools"):
            fixed_mask(mesh_with(), ids)
    elif all(0 <= i < 5 for i in ids):
        assert ids_of(mesh_with(), ids) == sorted(set(ids))
    else:
        with pytest.raises(InputError, match="fixed names the node"):
            fixed_mask(mesh_with(), ids)


@pytest.mark.parametrize(
    ("data", "ids"),
    [
        ([0, 0, 0, 0, 0], []),
        ([0, 2, 0, -1, 0], [1, 3]),
        (np.array([0.0, np.nan, -0.0, 0.5, np.inf]), [1, 3, 4]),
        (np.array([True, False, False, False, True]), [0, 4]),
        (np.array([[0, 0], [0, 1], [0, 0], [0, 0], [1, 1]]), [1, 4]),
        (np.zeros((5, 0)), []),
    ],
)
def test_point_data_fixed(data, ids):
    assert ids_of(mesh_with(data)) == ids


@pytest.mark.parametrize("data", [["a"] * 5, [b"0"] * 5, np.zeros(5, dtype=complex), np.array([None] * 5)])
def test_point_data_fixed_that_are_no_numbers_are_refused(data):
    with pytest.raises(InputError, match=r"point data 'fixed' of the mesh must be numbers .* another name"):
        fixed_mask(mesh_with(data))


def test_an_empty_mesh():
    empty = Mesh(np.zeros((0, 2)), (), point_data={"fixed": np.zeros(0)})
    assert fixed_mask(empty).shape == (0,)
    assert fixed_mask(empty, []).shape == (0,)
    with pytest.raises(InputError, match="names the node 0, but the mesh has no nodes"):
        fixed_mask(empty, [0])
    with pytest.raises(InputError, match="the mesh has no markers"):
        fixed_mask(empty, "inlet")


@pytest.mark.parametrize("kind", [int, np.int8, np.uint64, float])
def test_a_mask_of_numbers_is_not_taken_for_the_nodes_0_and_1(kind):
    with pytest.raises(InputError, match=r"a 0 or a 1 for each of the 5 nodes: give a mask as bools"):
        fixed_mask(mesh_with(), np.array([0, 0, 1, 1, 1], dtype=kind))
    with pytest.raises(InputError, match="give a mask as bools"):
        fixed_mask(mesh_with(), [0, 0, 0, 0, 0])
    assert ids_of(mesh_with(), np.array([0, 1, 1, 4, 4])) == [0, 1, 4]
    two = Mesh(POINTS[:2], ())
    assert ids_of(two, [0, 1]) == [0, 1]
