"""Ranks measure a mesh as one process does."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gmsnet
from gmsnet.generate import block_volume, disturb, random_quad_mesh, random_volume, second_order, sphere_surface

pytest.importorskip("mpi4py", reason="mpi4py is not installed")

from support.comm import together
from support.ranks import parts_at_random

from gmsnet.distributed.piece import pieces_of
from gmsnet.distributed.quality import measured
from gmsnet.measure.overview import Overview

MEANS = ("hexahedra", "wedges", "pyramids")  # whose mean η is another sum


def seen(mesh, ranks, how, seed=0, threshold=None):
    parts = parts_at_random(mesh, ranks, np.random.default_rng(seed), how)
    pieces = pieces_of(mesh, np.zeros(len(mesh.points), dtype=bool), parts, ranks)
    found = together(ranks, lambda comm: measured(pieces[comm.rank], comm, threshold))
    assert all(each == found[0] for each in found)
    return found[0]


def alike(mesh, ranks, how, seed=0, threshold=None):
    found = seen(mesh, ranks, how, seed, threshold)
    wanted = Overview.of(mesh, gmsnet.quality(mesh), threshold, found.gathered)
    if any(name in wanted.figures for name in MEANS):
        assert found.figures["shape"].pop("mean") == pytest.approx(wanted.figures["shape"].pop("mean"), rel=1e-14)
    assert json.dumps(found.__dict__) == json.dumps(wanted.__dict__)  # with the order of keys, and nan
    return found


def tangled(mesh, amount, seed):
    return disturb(mesh, np.arange(len(mesh.points)), amount, seed=seed, keep_valid=False)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(30, 300), st.floats(0.0, 1.0), st.integers(0, 2**10), st.integers(1, 4),
    st.sampled_from(["interleaved", "strips", "lonely"]), st.sampled_from(["triangle", "quad", "mixed", "tetra"]),
    st.sampled_from([None, 0.0, 0.3, 0.9]),
)  # fmt: skip
def test_figures_are_those_of_one_process(nodes, amount, seed, ranks, how, cells, threshold):
    if cells == "triangle":
        mesh = gmsnet.random_mesh(nodes, seed=seed % 50)
    elif cells == "tetra":
        mesh = random_volume(nodes, seed=seed % 50)
    else:
        mesh = random_quad_mesh(nodes, seed=seed % 50, cells=cells)
    alike(tangled(mesh, amount, seed), ranks, how, seed, threshold)


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "pyramid"])
@pytest.mark.parametrize("amount", [0.2, 0.7])
def test_volumes_of_other_kinds(kind, amount):
    mesh = tangled(block_volume(4, kind), amount, 1)
    found = alike(mesh, 3, "interleaved", threshold=0.4)
    assert found.gathered == ""
    assert (found.figures["inverted"] > 0) == (amount > 0.5)


def test_what_is_not_shared_is_measured_by_the_first():
    surface = sphere_surface(200).mesh
    assert alike(surface, 2, "strips").gathered == "surfaces are measured whole"
    curved = second_order(gmsnet.random_mesh(40, seed=1))
    assert "triangle6" in alike(curved, 2, "strips").gathered
    both = gmsnet.random_mesh(40, seed=1)
    turned = both.cells[0].nodes.copy()
    turned[0] = turned[0][::-1]
    block = replace(both.cells[0], nodes=turned)
    assert "both directions" in alike(replace(both, cells=(block, *both.cells[1:])), 2, "strips").gathered


def test_a_mesh_that_cannot_be_measured_is_refused_by_all():
    flat = random_volume(50, seed=1)
    mesh = replace(flat, points=flat.points * np.array([1.0, 1.0, 0.0]))
    with pytest.raises(gmsnet.InputError, match="in one plane"):
        seen(mesh, 2, "strips")
