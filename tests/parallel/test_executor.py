"""What an executor is told and asked for in a sweep: enough for processes that have a part of the mesh each."""

from __future__ import annotations

import threading

import numpy as np
import pytest

import gmsnet
from gmsnet.kernels.star.guard import WORST, Precision
from gmsnet.methods import METHODS, Field, StarSmoother, smoother
from gmsnet.methods.getme import SimultaneousGetme
from gmsnet.parallel.threads import Process, Threads, serial
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

MESH = gmsnet.random_mesh(3000, seed=4)
TOPOLOGY = Topology.of(MESH)


def swept(method, executor, variant=None):
    field = Field(near_points(MESH, TOPOLOGY), TOPOLOGY, Precision(), WORST)
    made = smoother(method, variant=variant)
    tally = made.sweep(field, executor, lambda: False)
    return field.points, tally, made


class Told(Process):
    """Notes what it is told. Works backwards, block by block."""

    sequential = False

    def __init__(self):
        self.colours, self.places, self.asked = [], [], 0

    def map(self, work, first, last):
        found = [work(block, block + 1) for block in reversed(range(first, last))]
        return found[::-1] or [work(first, last)]

    def after_colour(self, colour, points):
        self.colours.append(colour)
        self.places.append(points.copy())

    def minimum(self, value):
        self.asked += 1
        return value

    def for_blocks(self, blocks):
        return self


SWEEPS = [(name, None) for name in METHODS if isinstance(smoother(name), StarSmoother)] + [("getme", "simultaneous")]


@pytest.mark.parametrize(("method", "variant"), SWEEPS)
def test_each_colour_is_told_when_all_its_nodes_are_where_they_will_be(method, variant):
    executor = Told()
    points, tally, made = swept(method, executor, variant)
    assert isinstance(made, StarSmoother | SimultaneousGetme)
    assert executor.colours == list(range(TOPOLOGY.stars.colours))
    assert executor.asked == 1, "the floor of the guard"
    colours, last = TOPOLOGY.near_colours, near_points(MESH, TOPOLOGY)
    for colour, places in enumerate(executor.places):
        moved = (places != last).any(axis=1)
        assert (colours[moved] == colour).all()
        assert (places[colours == colour] == points[colours == colour]).all()
        last = places
    assert (last == points).all()
    expected, counts, _ = swept(method, serial, variant)
    assert points.tobytes() == expected.tobytes()
    assert tally.tolist() == counts.tolist()


def test_a_sequential_one_gets_all_colours_as_one_range():
    ranges = []

    class Counted(type(serial)):
        def map(self, work, first, last):
            ranges.append((first, last))
            return super().map(work, first, last)

    swept("laplacian", Counted())
    assert ranges[-1] == (0, int(TOPOLOGY.stars.first[-1]))
    assert sum(last == ranges[-1][1] for _, last in ranges) == 1


def test_threads_are_started_when_there_is_something_for_them_to_do():
    executor, before = Threads(3), threading.active_count()
    assert executor.map(lambda first, last: last, 0, 5) == [5]
    assert threading.active_count() == before
    executor.close()
    assert np.array(executor.total(np.arange(3))).tolist() == [0, 1, 2]
