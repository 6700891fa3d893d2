"""The order in memory."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from support import naive

from gmsnet.kernels.topology import layout


def memory_order(points):
    n = len(points)
    memory, position = np.empty(n, dtype=np.int32), np.empty(n, dtype=np.int32)
    layout.morton_order(
        points, np.empty((0, 2)), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), memory, position
    )
    np.testing.assert_array_equal(position[memory], np.arange(n))
    return memory.tolist()


@pytest.mark.parametrize("scale", [(1.0, 1.0), (1e-9, 1.0), (1.0, 0.0), (1e300, 1e300)])
def test_points_along_the_curve(scale):
    points = np.random.default_rng(0).random((3000, 2)) * scale
    assert memory_order(points) == naive.morton_order(points)


def test_points_of_one_square_stay_in_the_order_of_their_ids():
    rng = np.random.default_rng(1)
    points = np.vstack([rng.random((500, 2)) * 1e-6, [[0.0, 0.0], [1.0, 1.0]]])
    assert memory_order(points) == naive.morton_order(points)
    assert memory_order(np.ones((5, 2))) == [0, 1, 2, 3, 4]
    assert memory_order(np.empty((0, 2))) == []


def test_faces_by_their_first_node_in_memory_and_else_as_in_the_file():
    rng = np.random.default_rng(2)
    sizes = rng.integers(1, 6, size=200)
    first = np.concatenate([[0], np.cumsum(sizes)])
    corner = rng.integers(60, size=first[-1]).astype(np.int32)
    position = rng.permutation(60).astype(np.int32)
    begin, place, order = np.zeros(62, dtype=np.int32), np.empty_like(corner), np.empty(200, dtype=np.int32)
    layout.order_faces(first, corner, position, begin, place, order)
    np.testing.assert_array_equal(place, position[corner])
    lowest = [min(place[a:b]) for a, b in itertools.pairwise(first)]
    assert order.tolist() == sorted(range(200), key=lambda f: (lowest[f], f))
    for v in range(60):
        assert [lowest[f] for f in order[begin[v] : begin[v + 1]]] == [v] * lowest.count(v)
    new_first, taken = np.concatenate([[0], np.cumsum(sizes[order])]), np.empty_like(corner)
    layout.take_faces(first, place, order, new_first, taken)
    assert taken.tolist() == [c for f in order for c in place[first[f] : first[f + 1]].tolist()]


def test_points_of_a_part_stand_in_the_order_of_the_whole():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(2000, 2))
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    codes = np.empty(len(points), dtype=np.int64)
    layout.morton_codes(points, box, codes)
    whole = memory_order(points)
    assert whole == np.lexsort((np.arange(len(points)), codes)).tolist()
    some = np.sort(rng.choice(len(points), 300, replace=False))
    memory, position = np.empty((2, 300), dtype=np.int32)
    layout.morton_order(
        points[some], box, np.empty(300, dtype=np.int64), np.empty(300, dtype=np.int64), memory, position
    )
    chosen = set(some.tolist())
    assert some[memory].tolist() == [i for i in whole if i in chosen]
