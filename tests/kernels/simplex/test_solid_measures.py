"""Corners of hexahedra from their edges, against corner by corner and against exact arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.cells.hexahedron import HEXAHEDRON
from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.simplex import solid_measures
from gmsnet.kernels.simplex.mean_ratio3 import HEXAHEDRON as SHAPE
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra, shape_of
from gmsnet.kernels.simplex.validity3 import VALID
from gmsnet.measure.solid import judge_volumes

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
ROWS = np.array(HEXAHEDRON.simplices, dtype=np.int32)


@kernel
def one_by_one(points, simplices, out):
    for t in range(len(simplices.rows)):
        out[t, 0], out[t, 1], out[t, 2] = solid_measures.corner3(points, simplices, t)


@kernel
def shapes(corners, out):
    for k in range(len(corners)):
        out[k] = shape_of(corners[k, 0], corners[k, 1])


def corner_simplices():
    owner = np.zeros(8, dtype=np.int32)
    return Tetrahedra(ROWS, np.ones(8, dtype=np.int8), np.full(8, SHAPE, dtype=np.uint8), owner, None)


def hexahedra(jitter, stretch, count):
    rng = np.random.default_rng(round(100 * jitter))
    for _ in range(count):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))
        yield ((CUBE + rng.uniform(-jitter, jitter, CUBE.shape)) * [1.0, stretch, stretch**2]) @ turn


@pytest.mark.parametrize("stretch", [1.0, 0.1, 1e-3])
@pytest.mark.parametrize("jitter", [0.0, 0.05, 0.2, 0.5])
def test_the_edges_tell_what_the_corners_do(jitter, stretch):
    simplices, nodes = corner_simplices(), np.arange(8, dtype=np.int32)
    wanted, found, known = np.empty((8, 3)), np.empty((8, 3)), np.empty(8)
    plain_ones = 0
    for points in hexahedra(jitter, stretch, 200):
        one_by_one(points, simplices, wanted)
        doubtful, plain = solid_measures.corners_of_hexahedron(points, nodes, found)
        assert found[:, :2].tobytes() == wanted[:, :2].tobytes()
        assert doubtful >= wanted[:, 2].any()
        shapes(wanted, known)
        assert solid_measures.least_shape(found, 8) == known.min()
        if plain:
            plain_ones += 1
            signs = judge_volumes(points, nodes[None], "hexahedron", np.ones(1, dtype=np.int8))[0]
            assert signs.tolist() == [VALID]
    assert (plain_ones == 200) if jitter == 0.0 else (plain_ones < 200 or jitter < 0.2)


def test_what_is_no_number_is_in_doubt():
    nodes, found = np.arange(8, dtype=np.int32), np.empty((8, 3))
    for value in (np.nan, np.inf, -np.inf):
        for node in range(8):
            points = CUBE.copy()
            points[node, node % 3] = value
            assert solid_measures.corners_of_hexahedron(points, nodes, found) == (True, False)


def test_without_size_there_is_no_shape():
    found = np.zeros((8, 3))
    assert solid_measures.least_shape(found, 8) == 0.0
    found[:] = np.nan
    assert np.isnan(solid_measures.least_shape(found, 8))
