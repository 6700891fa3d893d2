"""The mean of η with a wall: what it brings, what it keeps, and where its turns come in the default method."""

from __future__ import annotations

import numpy as np
import pytest
from support import volumes

import gmsnet
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.measure.totals import totals_of
from gmsnet.methods import Field
from gmsnet.methods.above import Above
from gmsnet.methods.auto import Auto
from gmsnet.methods.barrier import Barrier
from gmsnet.methods.phases import LARGE_VOLUME_PLAN, VOLUME_PLAN
from gmsnet.methods.worst_in_space import WorstInSpace
from gmsnet.parallel.threads import serial, workers
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start, precision_of
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume


@pytest.fixture(scope="module")
def cube():
    return volumes.mesh_of(*volumes.cube(1500, 4))


def field_of(mesh, level="worst"):
    topology = Volume.of(mesh)
    points = space_points(mesh)[topology.memory]
    return Field(points, topology, precision_of(mesh), LEVELS.index(level))


def ready(mesh, level="worst"):
    """After Newton sweeps and a turn of the worst cells."""
    field = field_of(mesh, level)
    for _ in range(3):
        Barrier("q", 1.3).sweep(field, serial, lambda: False)
    WorstInSpace().sweep(field, serial, lambda: False)
    return field


def figures(field):
    totals = totals_of(field.points, field.topology.scored)
    return totals.shape_min, totals.shape_mean, totals.inverted


@pytest.mark.parametrize("level", LEVELS)
def test_the_mean_gains_more_than_by_powers_and_the_least_stays(cube, level):
    wall, power = ready(cube, level), ready(cube, level)
    least, mean, _ = figures(wall)
    for _ in range(4):
        Above(0.0, 4, 0.05).sweep(wall, serial, lambda: False)
        Barrier("q", 1.0).sweep(power, serial, lambda: False)
    after, by_power = figures(wall), figures(power)
    assert after[0] > by_power[0] if level == "valid" else after[0] >= least - 1e-12
    assert after[1] > mean  # stars of which no cell may fall hardly move
    assert level == "star" or after[1] > by_power[1] + 0.002
    assert after[2] == 0


def test_a_wall_above_the_worst_makes_room_for_them(cube):
    with_room, without = ready(cube), ready(cube)
    Above(0.17, 3, 1.0).sweep(with_room, serial, lambda: False)
    Barrier("q", 1.0).sweep(without, serial, lambda: False)
    for field in (with_room, without):
        WorstInSpace().sweep(field, serial, lambda: False)
    assert figures(with_room)[0] > figures(without)[0]


def test_with_inverted_cells_steps_are_those_of_the_power(cube):
    points = cube.points.copy()
    points[Volume.of(cube).free[:3]] += 0.7
    mesh = cube.with_points(points)
    wall, power = field_of(mesh), field_of(mesh)
    assert figures(wall)[2] > 0
    Above(0.0, 4, 0.05).sweep(wall, serial, lambda: False)
    Barrier("q", 1.3).sweep(power, serial, lambda: False)
    assert wall.points.tobytes() == power.points.tobytes()


def test_threads_make_the_same_bits():
    mesh = volumes.mesh_of(*volumes.cube(6000, 4))
    fields = [ready(mesh), ready(mesh)]
    with workers(2) as two:
        for field, executor in zip(fields, (serial, two), strict=True):
            Above(0.17, 3, 1.0).sweep(field, executor, lambda: False)
    assert fields[0].points.tobytes() == fields[1].points.tobytes()


@pytest.mark.parametrize("plan", [VOLUME_PLAN, LARGE_VOLUME_PLAN])
def test_room_is_made_between_turns_alone(cube, plan, monkeypatch):
    names, made = [], Auto.sweep

    def noted(self, *arguments):
        tally = made(self, *arguments)
        names.append(self.phase)
        return tally

    monkeypatch.setattr(Auto, "sweep", noted)
    topology = Volume.of(cube)
    start = Start(topology, space_points(cube)[topology.memory], precision_of(cube))
    Run(start, Auto(plan), SmoothOptions(max_sweeps=200)).to_the_end()
    turns = [k for k, name in enumerate(names) if name == "worst first"]
    assert len(turns) > 1
    for turn in turns[:-1]:
        assert names[turn + 1 : turn + 3] == ["room for the worst", "worst first"]
    last = names[turns[-1] + 1 :]
    assert set(last) == {"mean, worst kept"}
    assert (names[turns[0] - 1] == "Newton above a wall") == (plan is LARGE_VOLUME_PLAN)


def test_the_default_has_both_the_least_and_the_mean(cube):
    """Neither alone: powers of q keep one of the two."""
    result = gmsnet.smooth(cube)
    field = field_of(cube)
    for _ in range(30):
        Barrier("q", 1.3).sweep(field, serial, lambda: False)
    least, mean, _ = figures(field)
    free = np.zeros(len(cube.points), dtype=bool)
    free[Volume.of(cube).free] = True
    own = free[cube.cells[0].nodes].any(axis=1)
    shape = result.after.shape[own]
    assert shape.min() > 1.3 * least
    assert shape.mean() > mean - 0.006
