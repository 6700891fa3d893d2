"""What every method that moves hexahedra, wedges and pyramids keeps, at every level, in exact arithmetic."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import blocks

import gmsnet
from gmsnet.kernels.simplex.validity3 import VALID
from gmsnet.measure.solid import judge_volumes
from gmsnet.methods import METHODS
from gmsnet.topology.solids import KINDS

CHOICES = [
    {"method": name, **({kind[:-1]: each} if each else {})}
    for name, method in METHODS.items()
    for kind in ("objectives", "variants")
    for each in getattr(method, kind) or ("",)
    if all(method.moves(cell, each or None) for cell in KINDS) and (each or kind == "objectives")
]
LEVELS = ("valid", "worst", "star")
SPLIT = {"wedges": [(0, 0), (2, 2), (1, 1)], "pyramids": [(1, 2, 1), (2, 0, 0)]}
some_meshes = st.builds(
    lambda split, jitter, seed, power, turned: _turned(
        blocks.block(3, 3, 3, jitter=jitter, seed=seed, scale=2.0**power, **{key: SPLIT[key] for key in split}), turned
    ),
    st.sets(st.sampled_from(sorted(SPLIT))), st.floats(0.0, 0.45), st.integers(0, 2**32 - 1),
    st.sampled_from((-300, -20, 0, 30, 300)), st.booleans(),
)  # fmt: skip


def _turned(mesh, turned):
    return gmsnet.Mesh(mesh.points * [1.0, 1.0, -1.0], mesh.cells) if turned else mesh


def signs(mesh, points, sense):
    """Exact ones of all cells, valid everywhere or not. Their coordinates are brought near 1."""
    near = np.ldexp(points, -int(np.frexp(np.abs(points).max())[1]))
    found = [
        judge_volumes(near, cells.nodes.astype(np.int32), cells.kind, np.full(len(cells.nodes), sense, dtype=np.int8))[
            0
        ]
        for cells in mesh.cells
    ]
    return np.concatenate(found)


def shapes_of(mesh, points, sense):
    near = np.ldexp(points, -int(np.frexp(np.abs(points).max())[1]))
    return blocks.cubed_shapes(mesh, near, sense)


@pytest.mark.parametrize("level", LEVELS)
@given(mesh=some_meshes, choice=st.sampled_from(CHOICES), sweeps=st.integers(1, 5))
@settings(max_examples=int(os.environ.get("GMSNET_GUARD_EXAMPLES", 100)))
def test_what_a_level_promises_is_kept_in_exact_arithmetic(level, mesh, choice, sweeps):
    sense = int(gmsnet.quality(mesh).cells.blocks[0].orientation[0])
    before = signs(mesh, mesh.points, sense)
    result = gmsnet.smooth(mesh, guard=level, max_sweeps=sweeps, untangle=False, **choice)
    after = signs(mesh, result.points, sense)
    assert (after[before == VALID] == VALID).all()
    inner = blocks.inner_nodes(mesh)
    assert not (result.moved & ~inner).any()
    assert (result.points[~result.moved] == mesh.points[~result.moved]).all()
    was, now = shapes_of(mesh, mesh.points, sense), shapes_of(mesh, result.points, sense)
    if level == "worst" and (before == VALID).all():
        assert min(value for _, value in now) >= min(value for _, value in was)
    if level == "star":
        for node in np.flatnonzero(inner):
            assert min(v for nodes, v in now if node in nodes) >= min(v for nodes, v in was if node in nodes)


@pytest.mark.parametrize("choice", CHOICES, ids=lambda choice: "-".join(choice.values()))
def test_threads_change_no_bit(choice):
    mesh = blocks.block(6, 6, 6, wedges=[(2, 2), (3, 4)], pyramids=[(1, 4, 3), (4, 1, 2)], jitter=0.3, seed=5)
    one, two = (gmsnet.smooth(mesh, max_sweeps=6, threads=threads, **choice) for threads in (1, 2))
    assert one.moved.any()
    assert (one.points == two.points).all()
    assert one.stop_reason == two.stop_reason


@pytest.mark.parametrize("choice", CHOICES, ids=lambda choice: "-".join(choice.values()))
def test_cells_gain(choice):
    mesh = blocks.block(5, 5, 5, wedges=[(2, 2), (3, 3)], jitter=0.25, seed=1)
    result = gmsnet.smooth(mesh, **choice)
    assert result.after.inverted <= result.before.inverted
    assert result.after.totals.shape_mean > result.before.totals.shape_mean


@pytest.mark.parametrize("kind", ["hexahedra", "wedges"])
def test_a_grid_comes_back(kind):
    columns = [(i, j) for i in range(5) for j in range(5)] if kind == "wedges" else []
    grid = blocks.block(5, 5, 5, wedges=columns)
    result = gmsnet.smooth(blocks.block(5, 5, 5, wedges=columns, jitter=0.35, seed=3))
    if kind == "hexahedra":
        np.testing.assert_allclose(result.points, grid.points, atol=1e-6)
    assert result.after.totals.shape_min >= gmsnet.quality(grid).totals.shape_min - 1e-6


def test_tangled_blocks_are_made_valid():
    for seed in range(5):
        mesh = blocks.block(5, 5, 5, pyramids=[(2, 2, 2)], jitter=0.9, seed=seed)
        result = gmsnet.smooth(mesh)
        assert result.before.inverted > 20
        assert result.after.inverted == 0


def test_what_cannot_be_smoothed_is_refused():
    mesh = blocks.block(3, 3, 3)
    for method in ("gmsnet", "angle"):
        with pytest.raises(gmsnet.InputError, match=r"27 hexahedra: choose .*barrier"):
            gmsnet.smooth(mesh, method=method)
    with pytest.raises(gmsnet.InputError, match="target_dihedral is of meshes of tetrahedra alone"):
        gmsnet.smooth(mesh, target_dihedral=10.0)


def test_a_target_is_reached():
    mesh = blocks.block(6, 6, 6, jitter=0.3, seed=2)
    result = gmsnet.smooth(mesh, target_quality=0.7)
    assert result.before.totals.shape_min < 0.5
    assert result.after.totals.shape_min >= 0.7
