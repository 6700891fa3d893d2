from __future__ import annotations

import numpy as np
import pytest

from gmsnet.learn.data import Stars


def random_rings(rng: np.random.Generator, degrees: list[int], *, size: float = 1.0, offset: float = 0.0):
    """Free nodes (B × 2) and padded star-shaped rings (B × M × 2), counter-clockwise around points near them."""
    degree = np.array(degrees)
    ring = np.zeros((len(degree), degree.max(), 2))
    for k, n in enumerate(degrees):
        angle = 2 * np.pi * (np.arange(n) + 0.4 * rng.random(n)) / n + rng.random()
        ring[k, :n] = (0.4 + rng.random(n))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    ring *= rng.uniform(0.3, 1.0, (len(degree), 1, 2))  # some are long and flat
    centre = 0.05 * rng.standard_normal((len(degree), 2))
    return offset + size * centre, offset + size * ring, degree


@pytest.fixture
def stars() -> Stars:
    """200 stars of degree 3 to 20."""
    rng = np.random.default_rng(0)
    return Stars.of(*random_rings(rng, rng.integers(3, 21, 200).tolist()))
