"""Colours; the fans around nodes are tested with the topology that they make."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive

from gmsnet.kernels.topology import connectivity
from gmsnet.topology.stars import Colouring


def csr(rings):
    start = np.concatenate([[0], np.cumsum([len(ring) for ring in rings])]).astype(np.int32)
    return start, np.array([u for ring in rings for u in ring] + [0] * connectivity.WIDTH, dtype=np.int32)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.floats(0.0, 0.9))
@settings(max_examples=80, deadline=None)
def test_first_fit_in_the_order_of_the_ids(seed, nodes, share):
    """Ids are shuffled against places; held nodes stand in rings, too."""
    rng = np.random.default_rng(seed)
    place = rng.permutation(nodes)
    joined = np.triu(rng.random((nodes, nodes)) < share, 1)
    joined |= joined.T
    free = np.flatnonzero(rng.random(nodes) < 0.8)
    rings = [np.flatnonzero(joined[v]).tolist() if v in free else [] for v in range(nodes)]
    colours = naive.colours(free.tolist(), rings)
    by_place = [[] for _ in range(nodes)]
    for v in range(nodes):
        by_place[place[v]] = place[rings[v]].tolist() if rings[v] else []
    start, ring = csr(by_place)
    found = Colouring(place[free].astype(np.int32), start, ring).colours
    assert found[place].tolist() == [colours.get(v, -1) for v in range(nodes)]


@pytest.mark.parametrize("nodes", [1, 29, 30, 31, 32, 33, 64, 100])
def test_any_number_of_colours(nodes):
    """Each node beside all others, as in a triangulation of a surface with many handles."""
    start, ring = csr([[u for u in range(nodes) if u != v] for v in range(nodes)])
    places, colours = np.arange(nodes, dtype=np.int32)[::-1].copy(), np.zeros(nodes, dtype=np.int32)
    assert connectivity.colour(places, start, ring, colours) == (nodes <= connectivity.COLOURS)
    assert Colouring(places, start, ring).colours.tolist() == list(range(nodes))[::-1]
