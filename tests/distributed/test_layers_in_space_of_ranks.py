"""Layers of volumes that ranks find in their parts are those that one process finds, and no rank has the whole mesh."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.layer_meshes import around_a_cube
from support.ranks import on_parts, parts_at_random, same, spread

from gmsnet.distributed.on_first import LOOKED_AT
from gmsnet.distributed.on_ranks import OnRanks
from gmsnet.generate import block_volume, disturb, layered_volume, random_volume
from gmsnet.measure.report import connectivity_of
from gmsnet.preserve.protection import LAYER, protected_volume
from gmsnet.run.options import SmoothOptions
from gmsnet.topology.ordering import near_points

WAYS = ("interleaved", "strips", "lonely")


def alone(mesh, firm):
    """Which nodes are held for layers, and what is said of it."""
    topology = connectivity_of(mesh)
    found = protected_volume(topology, "shape", True, near_points(mesh, topology), firm=firm)
    return sorted(found.outer.held.get(LAYER, np.empty(0)).tolist()), found.notes


def on_ranks(mesh, firm, parts, ranks):
    def work(part):
        found = protected_volume(part.topology, "shape", True, part.points, firm=firm, shared=OnRanks(part))
        ids = found.outer.held.get(LAYER, np.empty(0, dtype=np.int64))
        return part.around.nodes.ids[ids].tolist(), found.notes

    found = on_parts(mesh, parts, ranks, work)
    assert all(notes == found[0][1] for _, notes in found)
    return sorted(node for ids, _ in found for node in ids), found[0][1]


def some_mesh(kind, cells, rows, first, thrown, seed):
    """Layers on a floor or around a cube, or none; nodes thrown about, so that cells are inverted."""
    if kind == "none":
        return random_volume(600, seed=seed)
    if kind == "grid":
        mesh = block_volume(cells, "hexahedron")
    elif kind.startswith("cube of "):
        mesh = around_a_cube(kind.removeprefix("cube of "), cells // 2, rows, first, 1.0 + first * 10)[0]
    else:
        mesh = layered_volume(cells, rows, kind=kind, first=first, growth=1.3, seed=seed)
    if not thrown:
        return mesh
    free = connectivity_of(mesh).free
    some = np.random.default_rng(seed).permutation(free)[: max(len(free) // 40, 1)]
    return disturb(mesh, some, thrown, seed=seed)


@settings(max_examples=50, deadline=None)
@given(
    kind=st.sampled_from(["tetra", "wedge", "cube of tetra", "cube of wedge", "cube of hexahedron", "grid", "none"]),
    cells=st.integers(5, 9), rows=st.integers(3, 7), first=st.sampled_from([0.01, 0.03, 0.08]),
    thrown=st.sampled_from([0.0, 0.0, 0.3, 2.0]), seed=st.integers(0, 99), ranks=st.integers(1, 4),
    how=st.sampled_from(WAYS), firm=st.booleans(),
)  # fmt: skip
def test_layers_are_those_of_one_process(kind, cells, rows, first, thrown, seed, ranks, how, firm):
    mesh = some_mesh(kind, cells, rows, first, thrown, seed)
    parts = parts_at_random(mesh, ranks, np.random.default_rng(seed), how)
    assert on_ranks(mesh, firm, parts, ranks) == alone(mesh, firm)


@pytest.mark.parametrize("kind", ["tetra", "wedge"])
@pytest.mark.parametrize("thrown", [0.2, 2.0])
def test_calls_hold_them_and_no_rank_has_the_whole(kind, thrown):
    mesh = some_mesh(kind, 8, 5, 0.03, thrown, 1)
    parts = parts_at_random(mesh, 3, np.random.default_rng(1), "interleaved")
    told = same(mesh, SmoothOptions(threads=1), parts, 3)
    assert told.held[LAYER] > 100
    assert LOOKED_AT not in told.notes
    if thrown < 1.0:
        assert told.gathered == ""


def test_feet_here_and_there_are_no_layers():
    """Random cubes have flat cells at their sides, but few beside one another."""
    mesh = random_volume(3_000, seed=1)
    parts = parts_at_random(mesh, 3, np.random.default_rng(0), "strips")
    _, results = spread(mesh, SmoothOptions(threads=1), parts, 3)
    assert results[0].gathered == ""
    assert LAYER not in results[0].held
