from __future__ import annotations

import numpy as np
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.kernels.topology.components import pieces, surroundings


@given(st.integers(1, 40), st.integers(0, 60), st.sampled_from([2, 3]), st.integers(0, 2**32 - 1))
def test_pieces_are_connected_components(nodes, count, corners, seed):
    rng = np.random.default_rng(seed)
    cells, chosen = rng.integers(0, nodes, (count, corners), dtype=np.int32), rng.random(nodes) < 0.7
    edges = np.concatenate([cells[:, [k, (k + 1) % corners]] for k in range(corners)])
    edges = edges[chosen[edges].all(axis=1)]
    graph = scipy.sparse.coo_matrix((np.ones(len(edges)), edges.T), shape=(nodes, nodes))
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    least = [int(np.flatnonzero(label == one)[0]) for one in label]
    assert pieces(cells, chosen).tolist() == least


@given(st.integers(3, 40), st.integers(1, 60), st.floats(0.0, 0.3), st.integers(0, 2**32 - 1))
def test_surroundings_are_two_rings_of_triangles(nodes, count, share, seed):
    rng = np.random.default_rng(seed)
    triangles, chosen = rng.integers(0, nodes, (count, 3), dtype=np.int32), rng.random(nodes) < share
    first = {i for t in triangles.tolist() if chosen[t].any() for i in t}
    wanted = [row for row, t in enumerate(triangles.tolist()) if first & set(t)]
    rows, corners, own = surroundings(triangles, chosen)
    assert rows.tolist() == wanted
    assert own.tolist() == sorted({i for row in wanted for i in triangles[row].tolist()})
    assert own[corners].tolist() == triangles[wanted].tolist()
