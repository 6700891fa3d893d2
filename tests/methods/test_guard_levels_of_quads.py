"""What each level of the guard promises of quads, in exact arithmetic, after every sweep of every method.

GMSNET_GUARD_EXAMPLES: how many meshes for each method, level and kind of mesh.
"""

from __future__ import annotations

import math
import os
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import quads as naive
from test_guard_levels import as_written
from test_properties_of_quads import every_method, grid

import gmsnet
from gmsnet import Mesh
from gmsnet.generate import disturb, hybrid_mesh, random_quad_mesh
from gmsnet.kernels.star.guard import LEVELS, STAR, VALID
from gmsnet.methods import Field, smoother
from gmsnet.parallel.threads import serial
from gmsnet.run.run import precision_of
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

EXAMPLES = int(os.environ.get("GMSNET_GUARD_EXAMPLES", "3"))
SWEEPS = 3

every_level = pytest.mark.parametrize("level", LEVELS)
both_kinds = pytest.mark.parametrize("cells", ["quad", "mixed"])
some_meshes = given(
    seed=st.integers(0, 2**32 - 1),
    nodes=st.integers(4, 30),
    tangle=st.sampled_from([0.0, 0.0, 0.5, 2.0]),
    where=st.sampled_from([(0.0, 1.0), (1000.1, 1.0), (-3.7e5, 1.0), (0.3, 1e-7), (1.0, 1e3)]),
    single=st.sampled_from([False, False, True]),
)


def some_mesh(seed, cells, nodes, tangle, where, single):
    """Quads, or quads and triangles, perhaps tangled, perhaps far from the origin, perhaps in single precision."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.3:
        mesh = grid(int(rng.integers(2, 6)), 0.0 if cells == "quad" else 0.4, float(rng.choice([0.1, 0.3])), seed)
    elif cells == "mixed" and rng.random() < 0.3:
        mesh = hybrid_mesh(max(nodes, 12), share=0.3, interface=bool(rng.random() < 0.3), seed=seed)
    else:
        mesh = random_quad_mesh(nodes, cells=cells, boundary=str(rng.choice(["even", "random"])), seed=seed)
    if tangle:
        mesh = disturb(mesh, Topology.of(mesh).free, tangle, seed=seed, keep_valid=False)
    points = mesh.points * where[1] + where[0]
    return Mesh(np.float64(np.float32(points)) if single else points, mesh.cells, single=single)


def exact_simplices(points, corners, weights, number):
    """Of corner simplices: twice the area, and (1/q)² with the sign of 1/q, exactly.

    corners: (corner, node after, node before). weights: 12 for a triangle, whose three sides count, 4 for the corner of
    a quad, whose two edges do. number: of a coordinate.
    """
    fractions = [[number(x), number(y)] for x, y in points.tolist()]
    scale = math.lcm(*(value.denominator for pair in fractions for value in pair))
    at = [[value.numerator * (scale // value.denominator) for value in pair] for pair in fractions]
    doubled, squared = [], []
    for (v, a, b), weight in zip(corners, weights, strict=True):
        px, py, qx, qy = at[a][0] - at[v][0], at[a][1] - at[v][1], at[b][0] - at[v][0], at[b][1] - at[v][1]
        area, lengths = px * qy - py * qx, px * px + py * py + qx * qx + qy * qy
        if weight == 12:
            lengths += (px - qx) ** 2 + (py - qy) ** 2
        doubled.append(Fraction(area, scale * scale))
        squared.append(Fraction(weight * area * abs(area), lengths * lengths) if lengths else Fraction(0))
    return doubled, squared


def simplices(mesh):
    """Corner simplices of all cells with their weights, and the number of each one's cell; the cells."""
    cells, corners, weights, owner = naive.wound(mesh), [], [], []
    for number, cell in enumerate(cells):
        found = naive.corners(cell)[: 1 if len(cell) == 3 else 4]
        corners += found
        weights += [12 if len(cell) == 3 else 4] * len(found)
        owner += [number] * len(found)
    return corners, weights, owner, cells


def check(level, before, after, free, around):
    """before, after: of ``exact_simplices``. free: numbers of simplices with a free node. around: of the simplices of
    all cells around each free node."""
    for was, now in zip(before[0], after[0], strict=True):
        assert now > 0 or (was <= 0 and now >= was)
    if level != VALID:
        assert min(after[1][row] for row in free) >= min(before[1][row] for row in free)
    if level == STAR:
        for rows in around:
            assert min(after[1][row] for row in rows) >= min(before[1][row] for row in rows)


def rows_of(topology, corners, owner, cells):
    """What ``check`` wants to know of the free nodes."""
    nodes = set(topology.free.tolist())
    free = [row for row, corner in enumerate(corners) if nodes & set(corner)]
    around = [[row for row, number in enumerate(owner) if node in cells[number]] for node in nodes]
    return free, around


@every_level
@both_kinds
@every_method
@some_meshes
@settings(max_examples=EXAMPLES, deadline=None)
def test_each_sweep_keeps_what_the_level_promises(method, cells, level, seed, nodes, tangle, where, single):
    mesh = some_mesh(seed, cells, nodes, tangle, where, single)
    topology = Topology.of(mesh)
    if not len(topology.free):
        return
    options = {**method}
    chosen, number = smoother(options.pop("method"), **options), LEVELS.index(level)
    start = planar_points(mesh)[topology.memory]
    field = Field(start.copy(), topology, precision_of(mesh), number)
    corners, weights, owner, faces = simplices(mesh)
    free, around = rows_of(topology, corners, owner, faces)
    readings = [Fraction] if single else [Fraction, as_written]

    def exact():
        points = np.empty_like(field.points)
        points[topology.memory] = np.ldexp(field.points, mesh.exponent)
        return [exact_simplices(points, corners, weights, reading) for reading in readings]

    before = exact()
    for _ in range(SWEEPS):
        chosen.sweep(field, serial, lambda: False)
        after = exact()
        for was, now in zip(before, after, strict=True):
            check(number, was, now, free, around)
        held = ~topology.near_free
        assert field.points[held].tobytes() == start[held].tobytes()
        before = after


@every_level
@both_kinds
@some_meshes
@settings(max_examples=5 * EXAMPLES, deadline=None)
def test_so_does_the_whole_from_input_to_output_at_any_stop(cells, level, seed, nodes, tangle, where, single):
    mesh = some_mesh(seed, cells, nodes, tangle, where, single)
    rng, number = np.random.default_rng(seed), LEVELS.index(level)
    result = gmsnet.smooth(mesh, guard=level, max_sweeps=int(rng.integers(0, 30)))
    corners, weights, owner, faces = simplices(mesh)
    free, around = rows_of(result.topology, corners, owner, faces)
    if not free:
        assert not result.moved.any()
        return
    for reading in [Fraction] if single else [Fraction, as_written]:
        (_, was), after = (exact_simplices(each.points, corners, weights, reading) for each in (mesh, result.mesh))
        valid = [[], []]
        for of_cell, values in zip(valid, (was, after[1]), strict=True):
            least = [min(values[k] for k in range(len(owner)) if owner[k] == c) for c in range(len(faces))]
            of_cell += [value > 0 for value in least]
        assert all(now or not before for before, now in zip(*valid, strict=True))
        if number != VALID:
            assert min(after[1][row] for row in free) >= min(was[row] for row in free)
        if number == STAR and not result.before.inverted:  # untangling keeps the worst of the mesh, not of each star
            for rows in around:
                assert min(after[1][row] for row in rows) >= min(was[row] for row in rows)
