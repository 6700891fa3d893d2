"""What each level of the guard promises, in exact arithmetic, after every sweep of every method.

GMSNET_GUARD_EXAMPLES: how many meshes for each method and level.
"""

from __future__ import annotations

import os
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import naive
from test_properties import every_method, mesh_of, triangulation

import gmsnet
from gmsnet.kernels.star.guard import LEVELS, STAR, VALID
from gmsnet.methods import Field, smoother
from gmsnet.parallel.threads import serial
from gmsnet.run.run import precision_of
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

EXAMPLES = int(os.environ.get("GMSNET_GUARD_EXAMPLES", "6"))
SWEEPS = 3


def ratios(points, triangles, orientation, number):
    """D/L of each triangle as an exact fraction; 0 for one that is a single point. number: of a coordinate."""
    exact = [[number(x), number(y)] for x, y in points.tolist()]
    found = []
    for nodes, sign in zip(triangles.tolist(), orientation.tolist(), strict=True):
        (ax, ay), (bx, by), (cx, cy) = (exact[i] for i in nodes)
        px, py, qx, qy = ax - cx, ay - cy, bx - cx, by - cy
        lengths = px * px + py * py + qx * qx + qy * qy + (px - qx) ** 2 + (py - qy) ** 2
        found.append(sign * (px * qy - py * qx) / lengths if lengths else Fraction(0))
    return found


def as_written(value):
    """The shortest decimal that a file keeps of a float64."""
    return Fraction(repr(value))


def some_mesh(seed, nodes, tangle, where, single):
    """A triangulation, perhaps tangled, perhaps far from the origin, perhaps in single precision."""
    mesh = triangulation(np.random.default_rng(seed), nodes, tangle)
    points = mesh.points * where[1] + where[0]
    if not single:
        return mesh_of(points, mesh.cells[0].nodes, mesh.cells[0].regions)
    return gmsnet.Mesh(np.float64(np.float32(points)), mesh.cells, single=True)


some_meshes = given(
    seed=st.integers(0, 2**32 - 1),
    nodes=st.integers(8, 40),
    tangle=st.sampled_from([0.0, 0.0, 0.5, 2.0]),
    where=st.sampled_from([(0.0, 1.0), (1000.1, 1.0), (-3.7e5, 1.0), (0.3, 1e-7), (1.0, 1e3)]),
    single=st.sampled_from([False, False, True]),
)


def check(level, before, after, stars):
    """before, after: D/L of the triangles with a free node. stars: rows of those around each free node."""
    for was, now in zip(before, after, strict=True):
        assert now > 0 or was <= 0
    assert sum(now <= 0 for now in after) <= sum(was <= 0 for was in before)
    if level != VALID:
        assert min(after) >= min(before)
    if level == STAR:
        for rows in stars:
            assert min(after[row] for row in rows) >= min(before[row] for row in rows)


@pytest.mark.parametrize("level", LEVELS)
@every_method
@some_meshes
@settings(max_examples=EXAMPLES, deadline=None)
def test_each_sweep_keeps_what_the_level_promises(method, level, seed, nodes, tangle, where, single):
    mesh = some_mesh(seed, nodes, tangle, where, single)
    topology = Topology.of(mesh)
    if not len(topology.free):
        return
    options = {**method}
    chosen = smoother(options.pop("method"), **options)
    number = LEVELS.index(level)
    start = planar_points(mesh)[topology.memory]
    field = Field(start.copy(), topology, precision_of(mesh), number)
    triangles, orientation, *_ = topology.changeable
    rows = {node: np.flatnonzero((triangles == node).any(axis=1)) for node in np.flatnonzero(topology.near_free)}
    scale = mesh.exponent
    readings = [Fraction] if single else [Fraction, as_written]

    def exact():
        return [ratios(np.ldexp(field.points, scale), triangles, orientation, reading) for reading in readings]

    before = exact()
    for _ in range(SWEEPS):
        chosen.sweep(field, serial, lambda: False)
        after = exact()
        for was, now in zip(before, after, strict=True):
            check(number, was, now, rows.values())
        held = ~topology.near_free
        assert field.points[held].tobytes() == start[held].tobytes()
        before = after


@pytest.mark.parametrize("level", LEVELS)
@some_meshes
@settings(max_examples=5 * EXAMPLES, deadline=None)
def test_so_does_the_whole_from_input_to_output_at_any_stop(level, seed, nodes, tangle, where, single):
    mesh = some_mesh(seed, nodes, tangle, where, single)
    topology = Topology.of(mesh)
    rng = np.random.default_rng(seed)
    result = gmsnet.smooth(mesh, guard=level, max_sweeps=int(rng.integers(0, 30)))
    triangles, orientation = topology.triangles, topology.orientation
    rows = [np.flatnonzero((triangles == node).any(axis=1)) for node in topology.free]
    free = np.isin(triangles, topology.free).any(axis=1)
    if not free.any():
        return
    number = LEVELS.index(level)
    for reading in [Fraction] if single else [Fraction, as_written]:
        before, after = (ratios(m.points, triangles, orientation, reading) for m in (mesh, result.mesh))
        # Mending a tangle is one transaction, which keeps the worst of the mesh, not that of each star.
        whole = min(number, 1) if result.before.inverted else number
        changed = [k for k in range(len(triangles)) if free[k]]
        place = {k: i for i, k in enumerate(changed)}
        check(whole, [before[k] for k in changed], [after[k] for k in changed], [[place[k] for k in r] for r in rows])
    assert result.after.sign.tolist() == naive.signs(result.points, triangles, orientation)
