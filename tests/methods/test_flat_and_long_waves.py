"""Volumes with cells that float32 takes for flat, and volumes whose cells have to grow together."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support import volumes
from support.hard_volumes import core, slivers

import gmsnet
from gmsnet.kernels.methods.barrier3 import K3
from gmsnet.measure.dihedral import ratios_of
from gmsnet.methods import Field
from gmsnet.methods.flat_in_space import FLAT, unflattened
from gmsnet.methods.gains import BEGUN, LASTING, LITTLE, Falling
from gmsnet.parallel.threads import serial
from gmsnet.run.run import precision_of
from gmsnet.topology.ordering import space_points
from gmsnet.topology.volume import Volume


def least(result):
    volume = Volume.of(result.mesh)
    free = np.zeros(len(result.mesh.points), dtype=bool)
    free[volume.free] = True
    return result.after.shape[free[volume.cells].any(axis=1)].min()


@pytest.mark.parametrize("seed", range(3))
def test_cells_that_are_nearly_flat_become_good(seed):
    mesh = slivers(seed=seed)
    result = gmsnet.smooth(mesh)
    assert result.before.shape[result.before.valid].min() < 1e-4
    assert result.after.valid.all()
    assert least(result) > 0.25
    assert gmsnet.smooth(mesh, threads=2).points.tobytes() == result.points.tobytes()


def test_only_flat_cells_are_unflattened():
    mesh = slivers(off=0.02)
    volume = Volume.of(mesh)
    field = Field(space_points(mesh)[volume.memory].copy(), volume, precision_of(mesh), 1)
    ratios = ratios_of(field.points, volume.changeable)
    flat = np.zeros(len(volume.near_free), dtype=bool)
    flat[volume.changeable.rows[ratios > K3 / FLAT**3]] = True
    before = field.points.copy()
    tally = unflattened(field, serial)
    moved = (field.points != before).any(axis=1)
    assert not (moved & ~(flat & volume.near_free)).any()
    assert bool(tally.any()) == bool((flat & volume.near_free).any())


@pytest.mark.parametrize("seed", range(2))
def test_a_dense_core_spreads_in_one_call(seed):
    result = gmsnet.smooth(core(seed=seed))
    assert result.after.valid.all()
    assert least(result) > 0.2
    assert least(gmsnet.smooth(result.mesh)) < least(result) + 0.03


def test_what_falls_slowly_goes_on(monkeypatch):
    """A sum that falls by a factor a look: at first by enough, then not by much less than before, or by little."""
    mesh = volumes.mesh_of(*volumes.cube(60, 1))
    volume = Volume.of(mesh)
    field = Field(space_points(mesh)[volume.memory], volume, precision_of(mesh), 1)
    sums = iter([])
    monkeypatch.setattr("gmsnet.methods.gains.ratios_of", lambda points, cells: np.full(len(cells.rows), next(sums)))

    def looks(*falls, long=False):
        nonlocal sums
        value = np.cumprod([1.0, *(1.0 - fall for fall in falls)])
        sums, falling = iter(K3 * value**2), Falling(0.01)
        falling.long = long
        return [falling.goes_on(field, serial) for _ in value]

    assert looks(0.02) == [False, True], "much at first"
    assert looks(0.005) == [False, False]
    assert looks(0.02, 0.9 * LASTING * 0.02) == [False, True, False], "it falls fast"
    assert looks(0.005, 1.1 * LASTING * 0.005) == [False, False, True], "it falls slowly"
    assert looks(0.9 * BEGUN, 0.9 * BEGUN) == [False, False, False], "by too little to begin with"
    assert looks(0.9 * BEGUN, 1.1 * LITTLE, long=True) == [False, True, True], "but not to go on with"
    assert looks(0.9 * LITTLE, long=True) == [False, False]
    assert looks(math.nan) == [False, False]
    assert looks(-0.1, 0.2) == [False, False, True]
