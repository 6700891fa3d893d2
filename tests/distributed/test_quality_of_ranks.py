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

import gmsnet.distributed
from gmsnet.distributed.piece import pieces_of
from gmsnet.distributed.quality import measured
from gmsnet.measure.overview import Overview
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


def seen(mesh, ranks, how, seed=0, threshold=None):
    parts = parts_at_random(mesh, ranks, np.random.default_rng(seed), how)
    pieces = pieces_of(mesh, np.zeros(len(mesh.points), dtype=bool), parts, ranks)
    found = together(ranks, lambda comm: measured(pieces[comm.rank], comm, threshold))
    assert all(each == found[0] for each in found)
    return found[0]


def alike(mesh, ranks, how, seed=0, threshold=None):
    found = seen(mesh, ranks, how, seed, threshold)
    wanted = Overview.of(mesh, gmsnet.quality(mesh), threshold, found.gathered)
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
@pytest.mark.parametrize("how", ["interleaved", "lonely"])
def test_volumes_of_other_kinds(kind, amount, how):
    mesh = tangled(block_volume(4, kind), amount, 1)
    found = alike(mesh, 3, how, threshold=0.4)
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


def test_fewer_cells_than_ranks():
    few = block_volume(2, "hexahedron")
    block = next(block for block in few.cells if block.kind == "hexahedron")
    mesh = Mesh(few.points, (CellBlock(block.kind, block.nodes[:2], block.regions[:2]),))
    assert alike(mesh, 4, "strips").gathered == ""


def test_volumes_that_name_a_node_twice_or_are_inside_out():
    mesh = block_volume(3, "hexahedron")
    at, block = next((k, block) for k, block in enumerate(mesh.cells) if block.kind == "hexahedron")
    twice, turned = block.nodes.copy(), block.nodes[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    twice[5, 1] = twice[5, 0]
    for nodes, why in ((twice, "name a node twice"), (turned, "inside out")):
        cells = [*mesh.cells]
        cells[at] = replace(block, nodes=nodes)
        found = alike(replace(mesh, cells=tuple(cells)), 3, "interleaved", threshold=0.1)
        assert why in found.gathered or "seen whole" in found.gathered
        assert found.remarks


def test_thresholds_that_are_none():
    cell = np.zeros((3, 2)), np.array([[0, 1, 2]])

    def work(comm):
        for wrong in ("a", 5.0, True, np.nan, np.zeros(2)):
            with pytest.raises(gmsnet.InputError, match="threshold is a value of 1/q"):
                gmsnet.distributed.quality(cell, [0, 1, 2], threshold=wrong, comm=comm)

    together(2, work)


def test_a_mesh_that_cannot_be_measured_is_refused_by_all():
    flat = random_volume(50, seed=1)
    mesh = replace(flat, points=flat.points * np.array([1.0, 1.0, 0.0]))
    with pytest.raises(gmsnet.InputError, match="in one plane"):
        seen(mesh, 2, "strips")
