"""Which boxes meet, and which edges cross, against slow twins."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet.untangle import crossings
from gmsnet.untangle.crossings import meeting, near_crossings


@pytest.mark.parametrize("seed", range(5))
def test_boxes_of_all_sizes_that_meet(seed):
    rng = np.random.default_rng(seed)
    low, left = rng.random((40, 2)), rng.random((60, 2))
    high = low + 10.0 ** rng.uniform(-6, 0, size=(40, 1)) * rng.random((40, 2))
    right = left + 10.0 ** rng.uniform(-6, 0, size=(60, 1)) * rng.integers(0, 2, size=(60, 2))
    wanted = {
        (i, j)
        for i in range(40)
        for j in range(60)
        if all(low[i, k] <= right[j, k] and left[j, k] <= high[i, k] for k in range(2))
    }
    found = [tuple(pair) for pair in meeting(low, high, left, right).tolist()]
    assert len(found) == len(set(found))
    assert set(found) == wanted


def test_no_boxes_meet_none():
    none, some = np.empty((0, 2)), np.zeros((3, 2))
    assert meeting(none, none, some, some).shape == (0, 2)
    assert meeting(some, some, none, none).shape == (0, 2)


def test_edges_that_share_a_node_do_not_cross():
    points = np.array([[0.0, 0.0], [2.0, 0.0], [1.0, -1.0], [1.0, 1.0], [0.0, 2.0]])
    cells = np.array([[0, 1, 3]], dtype=np.int32)
    crossed = near_crossings(points, np.array([[0, 1], [2, 3]], dtype=np.int32), cells)
    assert crossed.tolist() == [[1.0, 0.0]]
    apart = near_crossings(points, np.array([[0, 1], [0, 3], [0, 4]], dtype=np.int32), cells)
    assert np.isnan(apart).all()


def test_where_too_many_boxes_meet_none_is_looked_for(monkeypatch):
    points = np.array([[0.0, 0.0], [2.0, 0.0], [1.0, -1.0], [1.0, 1.0], [0.0, 2.0]])
    cells, edges = np.array([[0, 1, 3]], dtype=np.int32), np.array([[0, 1], [2, 3]], dtype=np.int32)
    monkeypatch.setattr(crossings, "MOST", 3)  # two edges, each of which meets both
    assert meeting(*[np.zeros((2, 2))] * 4) is None
    assert np.isnan(near_crossings(points, edges, cells)).all()
    monkeypatch.setattr(crossings, "MOST", 4)
    assert near_crossings(points, edges, cells).tolist() == [[1.0, 0.0]]
