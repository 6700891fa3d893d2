"""Nodes that hang together are dealt to one rank, and each rank gets no more than cells at its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import gmsnet
from gmsnet.generate import random_quad_mesh

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.comm import together
from support.ranks import on_parts, parts_at_random, same, spread

from gmsnet.distributed import executor
from gmsnet.distributed.executor import Ranks
from gmsnet.distributed.loan import dealt_field
from gmsnet.distributed.patch_ranks import patch_ranks
from gmsnet.distributed.piece import pieces_of
from gmsnet.distributed.smoothing import smoothed
from gmsnet.methods.base import Field
from gmsnet.run.options import SmoothOptions


@settings(max_examples=25, deadline=None)
@given(
    st.integers(50, 300), st.floats(0.02, 0.9), st.integers(0, 2**16), st.integers(1, 4),
    st.sampled_from(["interleaved", "strips", "lonely"]), st.booleans(),
)  # fmt: skip
def test_what_hangs_together_is_on_one_rank(nodes, share, seed, ranks, how, quads):
    rng = np.random.default_rng(seed)
    mesh = random_quad_mesh(nodes, seed=seed % 20) if quads else gmsnet.random_mesh(nodes, seed=seed % 20)
    chosen = rng.random(len(mesh.points)) < share

    def work(part):
        ids, topology = part.around.nodes.ids[part.topology.memory], part.topology
        active = chosen[ids] & topology.near_free
        found = patch_ranks(part, topology, active)
        owner = part.around.nodes.owner[topology.memory]
        field = Field(part.points.copy(), topology, None, "valid")
        loan = dealt_field(part, field, active)
        at = None if loan.field is None else (loan.all, loan.all[np.sort(loan.field.topology.free)])
        return (
            ids[active],
            found[active],
            dict.fromkeys(ids[owner == part.comm.rank].tolist(), part.comm.rank),
            at,
        )

    told = on_parts(mesh, parts_at_random(mesh, ranks, rng, how), ranks, work)
    ids, home = (np.concatenate([each[k] for each in told]) for k in range(2))
    owner = {node: rank for each in told for node, rank in each[2].items()}
    assert len(np.unique(ids)) == len(ids)
    pairs = np.concatenate(
        [block.nodes[:, [a, b]] for block in mesh.cells if block.dimension == 2
         for a in range(block.nodes.shape[1]) for b in range(a)]
    )  # fmt: skip
    active = np.zeros(len(mesh.points), dtype=bool)
    active[ids] = True
    pairs = pairs[active[pairs].all(axis=1)]
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(active), len(active)))
    piece = connected_components(graph, directed=False)[1]
    for name in np.unique(piece[ids]):
        own = ids[piece[ids] == name]
        (rank,) = set(home[np.isin(ids, own)].tolist())
        assert rank in {owner[node] for node in own.tolist()}
    for rank, (*_, at) in enumerate(told):
        mine = np.sort(ids[home == rank])
        assert (at is None) == (len(mine) == 0)
        if at is not None:
            cells = [
                block.nodes[np.isin(block.nodes, mine).any(axis=1)] for block in mesh.cells if block.dimension == 2
            ]
            assert at[0].tolist() == np.unique(np.concatenate([nodes.ravel() for nodes in cells])).tolist()
            assert at[1].tolist() == mine.tolist()


@settings(max_examples=50, deadline=None)
@given(st.lists(st.lists(st.floats(-1.0, 1.0), max_size=8), min_size=2, max_size=3), st.integers(1, 30))
def test_a_value_of_all_ranks_is_that_of_one(values, number):
    mesh = gmsnet.random_mesh(20, seed=0)
    parts = parts_at_random(mesh, len(values), np.random.default_rng(0), "strips")
    found = on_parts(mesh, parts, len(values), lambda part: Ranks(part).nth(np.array(values[part.comm.rank]), number))
    every = np.sort(np.concatenate([np.array(each) for each in values]))
    wanted = every[min(number, len(every)) - 1] if len(every) else np.inf
    assert found == [wanted] * len(values)


def test_worst_cells_are_on_all_ranks(monkeypatch):
    """Of a random mesh no rank gets much more of their surroundings than others."""
    counts, dealt = [], executor.read_alike

    def counting(part, field, active, **how):
        loan = dealt(part, field, active, **how)
        counts.append((part.comm.rank, 0 if loan.field is None else len(loan.field.points)))
        return loan

    monkeypatch.setattr(executor, "read_alike", counting)
    mesh = gmsnet.random_mesh(4_000, seed=1)
    parts = parts_at_random(mesh, 3, np.random.default_rng(0), "strips")
    assert same(mesh, SmoothOptions(method="worst-first", threads=1), parts, 3).gathered == ""
    of_rank = [np.mean([count for rank, count in counts if rank == k]) for k in range(3)]
    assert max(of_rank) < 0.6 * sum(of_rank)
    assert min(of_rank) > 0


@pytest.mark.parametrize("base", [2**52, 2**62])
def test_ids_that_no_float_can_hold(base):
    mesh = gmsnet.random_mesh(600, seed=3)
    parts = parts_at_random(mesh, 3, np.random.default_rng(0), "interleaved")
    options = SmoothOptions(method="worst-first", threads=1)
    points, _ = spread(mesh, options, parts, 3)
    pieces = [_shifted(piece, base) for piece in pieces_of(mesh, np.zeros(len(mesh.points), dtype=bool), parts, 3)]
    for piece, result in zip(pieces, together(3, lambda comm: smoothed(pieces[comm.rank], options, comm)), strict=True):
        assert result.points.tobytes() == points[piece.ids - base].tobytes()


def _shifted(piece, base):
    blocks = tuple(replace(block, nodes=block.nodes + base) for block in piece.blocks)
    return replace(piece, ids=piece.ids + base, blocks=blocks)
