"""The indexed heap against heapq with lazy deletion."""

from __future__ import annotations

import heapq

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.kernels.methods import heap as kernels


class LazyHeap:
    """heapq with outdated entries: an entry counts if its key is the item's key now."""

    def __init__(self, keys):
        self.keys = list(keys)
        self.entries = [(key, item) for item, key in enumerate(self.keys)]
        heapq.heapify(self.entries)

    def update(self, item, key):
        self.keys[item] = key
        heapq.heappush(self.entries, (key, item))

    def least(self):
        while self.entries[0][0] != self.keys[self.entries[0][1]]:
            heapq.heappop(self.entries)
        return self.entries[0][1]


def built(keys):
    key = np.array(keys, dtype=float)
    heap, place = np.full(len(key), -1, dtype=np.int32), np.full(len(key), -1, dtype=np.int32)
    kernels.build(heap, place, key)
    return heap, place, key


def assert_whole(heap, place, key):
    """Each item stands once, its place is known, and none comes before its parent."""
    assert sorted(heap) == list(range(len(heap)))
    assert heap[place].tolist() == list(range(len(heap)))
    for slot in range(1, len(heap)):
        above, item = heap[(slot - 1) // 2], heap[slot]
        assert (key[above], above) < (key[item], item)


# Few different keys, so that many are equal.
KEYS = st.one_of(st.integers(-2, 2).map(float), st.floats(-1e3, 1e3))


@given(st.lists(KEYS, min_size=1, max_size=60), st.data())
def test_the_least_item_is_that_of_heapq_whatever_is_raised_or_lowered(keys, data):
    heap, place, key = built(keys)
    twin = LazyHeap(keys)
    assert_whole(heap, place, key)
    assert heap[0] == twin.least()
    for item, new in data.draw(st.lists(st.tuples(st.integers(0, len(keys) - 1), KEYS), max_size=60)):
        key[item] = new
        kernels.update(heap, place, key, item)
        twin.update(item, new)
        assert_whole(heap, place, key)
        assert heap[0] == twin.least()


@given(st.lists(KEYS, min_size=1, max_size=60))
def test_raising_the_least_again_and_again_sorts_the_items(keys):
    heap, place, key = built(keys)
    order = []
    for _ in keys:
        order.append(int(heap[0]))
        key[heap[0]] = np.inf
        kernels.update(heap, place, key, heap[0])
    assert order == [item for _, item in sorted((k, i) for i, k in enumerate(keys))]


@pytest.mark.parametrize("size", [0, 1, 2, 3, 1000])
def test_sizes(size):
    keys = np.random.default_rng(size).random(size)
    heap, place, key = built(keys)
    assert_whole(heap, place, key)
    if size:
        assert heap[0] == keys.argmin()
