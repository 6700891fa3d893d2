"""Every method and every level of the guard on meshes from hell, in exact arithmetic.

GMSNET_HELL_EXAMPLES: how many meshes for each method and level.
"""

from __future__ import annotations

import os
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive
from support.hell import hellish
from test_guard_levels import as_written, check, ratios
from test_properties import every_method

import gmsnet
from gmsnet.kernels.star.guard import LEVELS, STAR
from gmsnet.run import stop

EXAMPLES = int(os.environ.get("GMSNET_HELL_EXAMPLES", "3"))


def faces_and_lines(mesh):
    """Triangles with their regions, other faces with theirs, and lower cells, as ``naive.held_nodes`` takes them."""
    triangles, regions, others, lower = [], [], [], []
    for block in mesh.cells:
        rows = block.nodes.tolist()
        if block.kind == "triangle":
            triangles += rows
            regions += block.regions.tolist()
        elif block.kind == "polygon":
            others += rows
        else:
            lower += rows
    return triangles, regions + [-1] * len(others), others, lower


@pytest.mark.parametrize("level", LEVELS)
@every_method
@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(3, 40))
@settings(max_examples=EXAMPLES, deadline=None)
def test_nothing_is_lost_and_nothing_gets_worse(method, level, seed, nodes):
    mesh, rng = hellish(seed, nodes), np.random.default_rng(seed)
    before = mesh.points.tobytes()
    levels = ["shape", "none", "size"] if method["method"] in ("auto", "sized") else ["shape", "none"]
    options = dict(
        **method, guard=level, max_sweeps=int(rng.integers(0, 5)), untangle=bool(rng.random() < 0.5),
        preserve=str(rng.choice(levels)), threads=int(rng.integers(1, 3)),
    )  # fmt: skip
    result = gmsnet.smooth(mesh, **options)
    assert mesh.points.tobytes() == before
    triangles, regions, others, lower = faces_and_lines(mesh)
    held = naive.held_nodes(len(mesh.points), triangles, regions, others, lower)
    still = sorted(held)
    assert result.points[still].tobytes() == mesh.points[still].tobytes()
    assert result.moved.tolist() == (result.points != mesh.points).any(axis=1).tolist()
    assert np.isfinite(result.points).all()
    for old, new in zip(mesh.cells, result.mesh.cells, strict=True):
        assert old is new
    if mesh.single:
        assert (np.float64(np.float32(result.points)) == result.points).all()

    plane, orientation = result.topology.plane, result.topology.orientation
    assert result.topology.triangles.tolist() == triangles
    free = set(range(len(mesh.points))) - held
    rows = [row for row, corners in enumerate(triangles) if free & set(corners)]
    place = {row: at for at, row in enumerate(rows)}
    stars = [[place[row] for row in rows if node in triangles[row]] for node in result.topology.free.tolist()]
    if not rows:
        assert not result.moved.any()
        return
    number = LEVELS.index(level)
    chosen = np.array([triangles[row] for row in rows])
    for reading in [Fraction] if mesh.single else [Fraction, as_written]:
        was, now = (
            ratios(points[:, plane], chosen, orientation[rows], reading) for points in (mesh.points, result.points)
        )
        # Mending a tangle is one transaction, which keeps the worst of the mesh, not that of each star.
        mended = number == STAR and result.before.inverted
        check(1 if mended else number, was, now, stars)
    count = len(triangles)  # polygons of four corners come after them
    assert result.after.sign[:count].tolist() == naive.signs(result.points[:, plane], triangles, orientation)
    assert result.before.sign[:count].tolist() == naive.signs(mesh.points[:, plane], triangles, orientation)


@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(3, 40), bad=st.sampled_from([np.nan, np.inf, -np.inf]))
@settings(max_examples=40, deadline=None)
def test_what_is_no_coordinate_is_refused(seed, nodes, bad):
    mesh, rng = hellish(seed, nodes), np.random.default_rng(seed)
    points = mesh.points.copy()
    points[rng.integers(len(points)), rng.integers(points.shape[1])] = bad
    with pytest.raises(gmsnet.InputError, match=r"not finite|nan|inf"):
        gmsnet.smooth(mesh.with_points(points))


@pytest.mark.parametrize("level", LEVELS)
@every_method
def test_nothing_to_do_is_said(method, level):
    points = np.random.default_rng(0).random((5, 2))
    for cells in (np.empty((0, 3), dtype=int), np.array([[0, 1, 2]]), np.array([[0, 1, 2], [1, 2, 3]])):
        result = gmsnet.smooth((points, cells), **method, guard=level)
        assert result.stop_reason == stop.NOTHING_TO_MOVE
        assert not result.moved.any()
    square = gmsnet.random_mesh(60, seed=0)
    result = gmsnet.smooth(square, **method, guard=level, fixed=np.arange(len(square.points)))
    assert result.stop_reason == stop.NOTHING_TO_MOVE
    assert not result.moved.any()
