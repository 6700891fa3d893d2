"""Surfaces whose facets have gone far from the input's are smoothed once more, with a bound for facets."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import sphere_surface
from gmsnet.run import bounded
from gmsnet.run.bounded import NOTE


def ellipsoid(nodes=300, length=3.0):
    mesh = sphere_surface(nodes).mesh
    return mesh.with_points(mesh.points * [length, 1.0, 1.0])


def share(result):
    return result.surface_change.hausdorff / result.surface_change.diagonal


@pytest.mark.parametrize(("nodes", "length"), [(100, 2.0), (300, 3.0)])
def test_the_ends_of_an_ellipsoid_are_not_cut_off(nodes, length, monkeypatch):
    mesh, seen = ellipsoid(nodes, length), []
    result = gmsnet.smooth(mesh, callback=lambda sweep: seen.append(sweep.index))
    assert NOTE in result.notes
    assert share(result) <= 0.02
    assert result.judged.after.shape_min > result.judged.before.shape_min + 0.2
    assert np.count_nonzero(np.diff(seen) <= 0) == 1  # two runs
    assert result.points.tobytes() == gmsnet.smooth(mesh, hausdorff=0.02).points.tobytes()
    monkeypatch.setattr(bounded, "SMALL", nodes // 2)
    free = gmsnet.smooth(mesh)
    assert NOTE not in free.notes
    assert share(free) > 0.02


@pytest.mark.parametrize(
    "asked", [{"hausdorff": 1.0}, {"target_quality": 0.75}, {"callback": lambda sweep: sweep.min_shape > 0.6}]
)
def test_who_asks_for_something_else_gets_that(asked):
    result = gmsnet.smooth(ellipsoid(100, 2.0), **asked)
    assert NOTE not in result.notes
    assert result.moved.any()


def test_surfaces_that_keep_their_shape_have_one_run():
    seen = list[int]()
    result = gmsnet.smooth(sphere_surface(300).mesh, callback=lambda sweep: seen.append(sweep.index))
    assert NOTE not in result.notes
    assert (np.diff(seen) > 0).all()
