"""Sweeps with kernels compiled anew for one star, in memory of their own: the bits of the processor's lanes.

The machine is this processor (support.other_machine); what a GPU does of it: test_on_a_gpu.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.blocks import block
from support.other_machine import Processor

import gmsnet
from gmsnet.cuda import executor
from gmsnet.cuda.blocks import singles
from gmsnet.generate import random_mesh, random_quad_mesh, random_volume, sphere_surface
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.methods import METHODS, MethodOptions
from gmsnet.run import api
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.topology import Topology

PLANAR = {"triangle": random_mesh(1500, seed=1), "quad": random_quad_mesh(800, seed=2)}
SOLIDS = block(6, 6, 6, wedges=np.ndindex(2, 5), pyramids=np.ndindex(2, 3, 5), jitter=0.15, seed=2)
MESHES = {**PLANAR, "tetra": random_volume(300, seed=1), "solids": SOLIDS}
WAYS = [  # benchmarks/gpu.py has all others
    (kind, name, choice, level, slide)
    for kind, name in itertools.product(PLANAR, executor.METHODS)
    for choice in (METHODS[name].objectives or METHODS[name].variants or ("",))
    for level in LEVELS
    for slide in ((None, "all") if METHODS[name].slides else (None,))
    if METHODS[name].moves(kind, choice or None)
    and (level == "worst" or (slide is None and name != "auto" and choice == METHODS[name].default))
] + [
    ("tetra", "auto", "", "worst", None), ("tetra", "barrier", "q", "worst", "all"),
    ("tetra", "barrier", "q2", "star", None), ("tetra", "laplacian", "plain", "valid", None),
    ("solids", "barrier", "q2", "worst", "all"), ("solids", "laplacian", "smart", "star", None),
]  # fmt: skip


@pytest.fixture
def machine(monkeypatch):
    """What does the sweeps of calls with device="cuda"."""
    made = Processor()
    monkeypatch.setattr("gmsnet.run.options.gpu_library", lambda: None)
    monkeypatch.setattr(executor, "FEWEST", 0)
    monkeypatch.setattr(api, "gpu", lambda threads: executor.on(made, threads))
    return made


def both(mesh, name, choice, **options):
    """The results of two calls that must be alike."""
    if choice:
        options["objective" if METHODS[name].objectives else "variant"] = choice
    one, other = (gmsnet.smooth(mesh, name, device=device, max_sweeps=4, **options) for device in ("cpu", "cuda"))
    assert one.points.tobytes() == other.points.tobytes()
    assert repr(one.history) == repr(other.history)
    assert other.notes[: len(one.notes)] == one.notes
    return other


@pytest.mark.parametrize(("kind", "name", "choice", "level", "slide"), WAYS)
def test_the_bits_are_the_same(machine, kind, name, choice, level, slide):
    result = both(MESHES[kind], name, choice, guard=level, slide=slide)
    assert machine.sweeps > 0
    assert (machine.summaries > 0) == (kind in PLANAR)
    assert result.notes[-1] == f"another processor did {machine.sweeps} sweep{'s' * (machine.sweeps > 1)}"


@pytest.mark.parametrize("kind", PLANAR)
@pytest.mark.parametrize("level", LEVELS)
def test_among_inverted_cells_the_bits_are_the_same(machine, kind, level):
    mesh = MESHES[kind]
    rng = np.random.default_rng(3)
    thrown = mesh.with_points(mesh.points + rng.normal(0.0, 0.01, mesh.points.shape))
    for name in ("barrier", "laplacian"):
        both(thrown, name, "", guard=level, untangle=False)
    both(thrown, "auto", "", guard=level)


@given(st.integers(3, 400), st.integers(0, 50), st.booleans())
@settings(max_examples=20)
def test_stars_one_by_one_are_those_of_the_blocks(nodes, seed, quads):
    mesh = (random_quad_mesh if quads else random_mesh)(nodes, seed=seed)
    stars = Topology.of(mesh).stars
    blocks, (one, first) = stars.blocks, singles(stars.blocks, stars.first)
    star = 0
    for colour in range(stars.colours):
        assert first[colour] == star
        for b in range(stars.first[colour], stars.first[colour + 1]):
            for lane in range(blocks.filled[b]):
                n, low, here = one.degree[star], one.offset[star], blocks.offset[b] + lane
                assert one.centre[star] == blocks.centre[b * LANES + lane]
                assert n == blocks.degree[b]
                assert (one.rings[low : low + n] == blocks.rings[here : here + n * LANES : LANES]).all()
                assert blocks.pattern is None or one.pattern[star] == blocks.pattern[b]
                star += 1
    assert star == first[-1] == len(one.centre)


@given(st.integers(3, 300), st.integers(0, 50))
@settings(max_examples=20)
def test_stars_of_tetrahedra_one_by_one_are_those_of_the_blocks(nodes, seed):
    one_by_one_in_space(volume_of(wound_of(random_volume(nodes, seed=seed))).stars)


@given(st.integers(3, 5), st.integers(0, 50), st.integers(0, 4), st.integers(0, 4))
@settings(max_examples=20)
def test_stars_of_solids_one_by_one_are_those_of_the_blocks(side, seed, wedges, pyramids):
    places = np.random.default_rng(seed).permutation(list(np.ndindex(side, side, side)))
    chosen = [tuple(place) for place in places[: wedges + pyramids].tolist()]
    mesh = block(side, side, side, wedges=chosen[:wedges], pyramids=chosen[wedges:], seed=seed)
    one_by_one_in_space(volume_of(wound_of(mesh)).stars)


def one_by_one_in_space(stars):
    """Compares the rows of each star, as plain slices of the arrays of its block, with those that stand alone."""
    blocks, (one, first) = stars.blocks, singles(stars.blocks, stars.first)
    star, mixture = 0, blocks.mixture
    for colour in range(stars.colours):
        assert first[colour] == star
        for b in range(stars.first[colour], stars.first[colour + 1]):
            n, rows, begin = blocks.degree[b], blocks.simplices[b], blocks.at[b] // (3 * LANES3)
            ring = blocks.ring[blocks.offset[b] :][: n * LANES3].reshape(n, LANES3)
            spokes = blocks.spoke[blocks.at[b] :][: 3 * LANES3 * rows].reshape(rows, 3, LANES3)
            for lane in range(blocks.filled[b]):
                there = np.arange(rows) < blocks.cells[b * LANES3 + lane]
                if mixture is not None:
                    there = (mixture.present[begin : begin + rows] >> lane) & 1 == 1
                    owner = mixture.owner[begin * LANES3 :][: rows * LANES3].reshape(rows, LANES3)[there, lane]
                    to = one.at[star] // 3
                    assert (one.mixture.owner[to : to + len(owner)] == owner).all()
                    assert (one.mixture.role[to : to + len(owner)] == mixture.role[begin : begin + rows][there]).all()
                    assert one.mixture.edges[star] == mixture.edges[b * LANES3 + lane]
                own = spokes[there, :, lane].ravel()
                around = list(dict.fromkeys(ring[:, lane].tolist()))
                assert one.centre[star] == blocks.centre[b * LANES3 + lane]
                assert one.ring[one.offset[star] :][: one.degree[star]].tolist() == around
                assert one.spoke[one.at[star] :][: 3 * one.simplices[star]].tolist() == own.tolist()
                assert one.cells[star] == one.simplices[star] == there.sum()
                star += 1
    assert star == first[-1] == len(one.centre)


def test_what_it_does_not_do_is_said(machine):
    for mesh, method in ((random_volume(300, seed=1), "optimize"), (sphere_surface(300).mesh, "barrier")):
        one, other = (gmsnet.smooth(mesh, method, device=device, max_sweeps=3) for device in ("cpu", "cuda"))
        assert one.points.tobytes() == other.points.tobytes()
        assert machine.sweeps == 0
        assert "another processor did no sweep" in other.notes[-1]
        assert "in a plane and in volumes" in other.notes[-1]


def test_the_methods_are_those_with_a_kernel_that_a_gpu_can_start():
    smoothers = {
        name: method.create(MethodOptions(variant=method.default, objective=method.default))
        for name, method in METHODS.items()
        if not method.weighted
    }
    found = {
        name for name, each in smoothers.items() if getattr(each, "in_plane", None) and each.in_plane.room is not None
    }
    assert found | {"auto", "gmsnet"} == set(executor.METHODS)


def test_small_meshes_stay_on_the_processor(machine, monkeypatch):
    monkeypatch.setattr(executor, "FEWEST", 64)
    result = gmsnet.smooth(MESHES["triangle"], "barrier", device="cuda")
    assert machine.sweeps == machine.summaries == 0
    assert "over 4,096 free nodes or more" in result.notes[-1]


@pytest.mark.parametrize("spokes", [127, 128])
def test_nodes_of_many_neighbours_stay_on_the_processor(machine, spokes):
    angle = np.linspace(0.0, 2.0 * np.pi, spokes, endpoint=False)
    points = np.vstack([[[0.2, 0.1]], np.column_stack([np.cos(angle), np.sin(angle)])])
    ring = 1 + np.arange(spokes)
    triangles = np.column_stack([np.zeros_like(ring), ring, np.roll(ring, -1)])
    one, other = (
        gmsnet.smooth((points, triangles), "laplacian", variant="plain", device=device) for device in ("cpu", "cuda")
    )
    assert one.points.tobytes() == other.points.tobytes()
    assert (machine.sweeps > 0) == (spokes == 127)
    assert ("at most 127 neighbours" in other.notes[-1]) == (spokes == 128)


def test_a_fault_of_the_machine_reaches_the_caller_and_nothing_is_left_open(machine, monkeypatch):
    def fail(*_):
        raise MemoryError("no room")

    monkeypatch.setattr(machine, "start", fail)
    with pytest.raises(MemoryError):
        gmsnet.smooth(MESHES["triangle"], "barrier", device="cuda")
    assert machine.closed


def test_an_interrupted_call_gives_the_best_mesh_so_far(machine):
    seen = []

    def stop(sweep):
        seen.append(sweep)
        if len(seen) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        gmsnet.smooth(MESHES["triangle"], "barrier", device="cuda", callback=stop)
    best = caught.value.result
    assert best.sweeps == 2
    assert best.after.qhat > best.before.qhat
    assert machine.closed
