"""What the README says of the shipped weights, measured."""

from __future__ import annotations

import numpy as np
import pytest
from reference import metric_loss_optimum

import gmsnet


@pytest.mark.parametrize("seed", range(4))
def test_gmsnet_gains_what_the_optimum_of_its_loss_gains(seed):
    mesh = gmsnet.random_mesh(1000, seed=1000 + seed)
    result = gmsnet.smooth(mesh, max_sweeps=20)
    optimum = gmsnet.quality(mesh.with_points(metric_loss_optimum(mesh)))
    start = result.before.shape.mean()
    assert optimum.shape.mean() - start > 0.15
    assert result.after.shape.mean() - start >= 0.96 * (optimum.shape.mean() - start)
    assert result.after.min_angle.mean() >= 43
    assert result.after.inverted == 0


def test_the_reference_has_settled():
    mesh = gmsnet.random_mesh(300, seed=1)
    early, late = (gmsnet.quality(mesh.with_points(metric_loss_optimum(mesh, n))).shape.mean() for n in (80, 160))
    assert abs(late - early) < 1e-3
    assert np.isfinite(late)
