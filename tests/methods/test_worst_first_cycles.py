"""The list of cycles."""

from __future__ import annotations

import numpy as np

import gmsnet
from gmsnet.kernels.star.guard import VALID, WORST, Precision
from gmsnet.methods.base import Field
from gmsnet.methods.worst_first import CYCLES, WorstFirst
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def field_of(mesh, level):
    topology = Topology.of(mesh)
    return Field(planar_points(mesh)[topology.memory].copy(), topology, Precision(), level)


def swept(field, smoother, sweeps):
    tally = np.zeros(3, dtype=np.int64)
    for _ in range(sweeps):
        tally += smoother.sweep(field, serial, lambda: True)
    return tally


def worst(field):
    points, (triangles, turn, *_) = field.points, field.topology.changeable
    a, b, c = (points[triangles[:, k]] for k in range(3))
    d = turn * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return (2 * np.sqrt(3) * d / sum(((u - v) ** 2).sum(axis=1) for u, v in ((a, b), (b, c), (c, a)))).min()


def test_all_cycles_at_once_are_those_one_by_one():
    mesh = gmsnet.random_mesh(2000, seed=1)
    one, other = field_of(mesh, VALID), field_of(mesh, VALID)
    tally = swept(one, WorstFirst(), len(CYCLES))
    assert swept(other, WorstFirst(at_once=len(CYCLES)), 1).tolist() == tally.tolist()
    assert one.points.tobytes() == other.points.tobytes()


def test_the_worst_cell_never_gets_worse_and_at_last_it_settles():
    field, smoother = field_of(gmsnet.random_mesh(1000, seed=2), WORST), WorstFirst()
    before = first = worst(field)
    for _ in range(200):
        swept(field, smoother, 1)
        assert worst(field) >= before
        before = worst(field)
        if smoother.converged:
            break
    assert smoother.converged
    assert before > first + 0.3


def test_only_few_nodes_move():
    mesh = gmsnet.random_mesh(5000, seed=3)
    field = field_of(mesh, VALID)
    start = field.points.copy()
    swept(field, WorstFirst(at_once=len(CYCLES)), 1)
    assert 10 < (field.points != start).any(axis=1).sum() < 500


def test_a_mesh_smaller_than_a_share():
    result = gmsnet.smooth(gmsnet.random_mesh(10, seed=4), "worst-first")
    assert result.after.qhat >= result.before.qhat
