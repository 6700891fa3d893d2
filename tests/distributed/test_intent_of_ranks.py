"""What ranks see of layers and walls in their parts: no is certain, and most meshes without any need no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
from gmsnet.generate import random_quad_mesh, random_volume

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.layer_meshes import rows_around
from support.ranks import on_parts, parts_at_random, same, spread

from gmsnet.distributed.intent import Look
from gmsnet.distributed.on_first import LOOKED_AT
from gmsnet.preserve.layers import _seeds
from gmsnet.preserve.survey import Survey
from gmsnet.preserve.wall_edges import Beside
from gmsnet.preserve.walls import near_walls, refined_walls
from gmsnet.run.options import SmoothOptions
from gmsnet.topology.topology import Topology

HEIGHTS = "cells that have one height"


def look(mesh, ranks, parts):
    """What ranks see, and the cells at walls by coordinates as the first rank has them."""

    def work(part):
        seen = Look.at(part, part.points)
        return seen, None if seen.beside is None else seen.beside.at(part.points)

    found = on_parts(mesh, parts, ranks, work)
    assert len({(seen.layers, seen.walls) for seen, _ in found}) == 1
    return found[0]


@settings(max_examples=30, deadline=None)
@given(
    st.integers(200, 600), st.floats(1.0, 4.0), st.integers(0, 2**16), st.integers(1, 4),
    st.sampled_from(["interleaved", "strips", "lonely"]), st.booleans(),
)  # fmt: skip
def test_layers_start_for_ranks_where_they_start_serially(nodes, factor, seed, ranks, how, quads):
    rng = np.random.default_rng(seed)
    mesh = random_quad_mesh(nodes, seed=seed % 50) if quads else gmsnet.random_mesh(nodes, seed=seed % 50)
    x, y = mesh.points.T
    bent = np.column_stack([x * (1.0 + (factor - 1.0) * (x > 0.4)), y])
    mesh = replace(mesh, points=bent + rng.normal(size=bent.shape) * 0.1 / np.sqrt(nodes))
    topology = Topology.of(mesh)
    survey = Survey.of(mesh, topology)
    seen, at = look(mesh, ranks, parts_at_random(mesh, ranks, rng, how))
    assert seen.layers == bool(_seeds(survey, topology).any())
    whole = Beside.of(topology.simplices, survey.beside, survey.rim)
    assert at[seen.beside.beside.simplices.rows].tobytes() == survey.points[whole.simplices.rows].tobytes()
    assert seen.walls == refined_walls(survey.points, whole, survey.double)
    assert seen.walls or not near_walls(mesh, topology).kept.nodes.any()


@pytest.mark.parametrize("mesh", [gmsnet.random_mesh(3_000, seed=2), random_volume(2_000, seed=3)])
def test_meshes_without_layers_stay_apart(mesh):
    parts = parts_at_random(mesh, 3, np.random.default_rng(2), "strips")
    _, results = spread(mesh, SmoothOptions(threads=1), parts, 3)
    assert results[0].gathered == ""
    assert LOOKED_AT not in results[0].notes


@pytest.mark.parametrize("cells", ["triangle", "quad"])
def test_heights_over_walls_are_compared(cells):
    mesh = rows_around(80, 20, 0.04, 1.25, cells=cells)
    parts = parts_at_random(mesh, 3, np.random.default_rng(3), "interleaved")
    told = same(mesh, SmoothOptions(threads=1), parts, 3).notes
    assert any(note.startswith(HEIGHTS) for note in told)
