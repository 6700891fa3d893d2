"""Counting sorts in one piece and in two."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.topology.bins import in_bins


@given(bins_of=st.lists(st.lists(st.integers(0, 6), max_size=3), max_size=20), threads=st.integers(1, 2))
def test_items_in_several_bins_stand_there_in_their_order(bins_of, threads):
    found = np.full(sum(map(len, bins_of)), -1)

    def count(first, last, counts):
        for each in bins_of[first:last]:
            for k in each:
                counts[k] += 1

    def write(first, last, place):
        for item in range(first, last):
            for k in bins_of[item]:
                found[place[k]] = item
                place[k] += 1

    start = in_bins(len(bins_of), 7, threads, count, write)
    expected = [[item for item, each in enumerate(bins_of) for _ in range(each.count(k))] for k in range(7)]
    assert [found[a:b].tolist() for a, b in itertools.pairwise(start)] == expected
