"""What the README says of the shipped weights, measured."""

from __future__ import annotations

import numpy as np
from support.reference import metric_loss_optimum

import gmsnet


def test_gmsnet_gains_what_the_optimum_of_its_loss_gains():
    """Twenty random squares of 1,000 nodes, 20 sweeps: at least 96.5 % of the gain in mean 1/q."""
    gains = []
    for seed in range(20):
        mesh = gmsnet.random_mesh(1000, seed=seed)
        result = gmsnet.smooth(mesh, "gmsnet", max_sweeps=20)
        optimum = gmsnet.quality(mesh.with_points(metric_loss_optimum(mesh, 40))).shape.mean()
        start = result.before.shape.mean()
        gains.append((result.after.shape.mean() - start) / (optimum - start))
        assert result.after.min_angle.mean() >= 43
        assert result.after.inverted == 0
    assert np.mean(gains) >= 0.965
    assert min(gains) >= 0.955


def test_the_reference_has_settled():
    mesh = gmsnet.random_mesh(300, seed=1)
    early, late = (gmsnet.quality(mesh.with_points(metric_loss_optimum(mesh, n))).shape.mean() for n in (80, 160))
    assert abs(late - early) < 1e-3
    assert np.isfinite(late)
