"""Sweeps that leave out stars in which nothing has changed end with the bits of sweeps over all."""

from __future__ import annotations

import numpy as np
import pytest
from support import volumes

from gmsnet.kernels.methods.barrier3 import Power3
from gmsnet.kernels.methods.barrier3 import sweep3 as barrier_sweep3
from gmsnet.kernels.methods.descent3 import sweep3
from gmsnet.kernels.simplex.objectives3 import DIHEDRAL, Aim3
from gmsnet.kernels.star.guard import LEVELS, Precision
from gmsnet.measure.dihedral import WIDE
from gmsnet.methods import again
from gmsnet.methods.again import over_changing
from gmsnet.methods.base import Field, over_stars
from gmsnet.parallel.threads import serial
from gmsnet.topology.ordering import space_points, taken
from gmsnet.topology.volume import Volume


def field_of(mesh):
    volume = Volume.of(mesh)
    return Field(
        taken(space_points(mesh), volume.memory),
        volume,
        Precision.of(single=False, exponent=mesh.exponent),
        LEVELS.index("valid"),
    )


def visits(field, guard, kind):
    """What visits blocks: Newton's method on angles, or on q."""
    if kind == "angles":
        aim = Aim3(DIHEDRAL, 4, WIDE, np.radians(25.0), 0.0)
        return lambda blocks, first, last, tally: sweep3(
            field.points, blocks, first, last, guard, aim, 1, np.empty(0), tally
        )
    power = Power3.of(2, 40.0)
    return lambda blocks, first, last, tally: barrier_sweep3(
        field.points, blocks, first, last, guard, power, 1.0, tally
    )


@pytest.mark.parametrize("kind", ["angles", "q"])
@pytest.mark.parametrize("share", [0.05, 1.0])
def test_the_bits_are_those_of_sweeps_over_all(kind, share, monkeypatch):
    mesh = volumes.mesh_of(*volumes.cube(900, 3))
    short, long = field_of(mesh), field_of(mesh)
    free = np.flatnonzero(short.topology.near_free).astype(np.int32)
    nodes = np.sort(np.random.default_rng(1).permutation(free)[: max(1, int(share * len(free)))])
    visited = []

    def counted(visit, stars, points, executor):
        visited.append(int(stars.blocks.filled.sum()))
        return over_stars(visit, stars, points, executor)

    monkeypatch.setattr(again, "over_stars", counted)
    visit = visits(short, short.guard(serial), kind)
    tally = over_changing(visit, nodes, 40, short, serial)
    visit = visits(long, long.guard(serial), kind)
    stars = long.topology.stars_of(nodes.astype(np.int64))
    plain = sum(over_stars(visit, stars, long.points, serial) for _ in range(40))
    assert short.points.tobytes() == long.points.tobytes()
    assert tally[0] == plain[0] > 0
    assert visited[0] == len(nodes)
    assert sum(visited) < 40 * len(nodes) or share == 1.0
