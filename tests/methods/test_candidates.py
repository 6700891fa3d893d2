"""Which cells are the worst."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gmsnet.methods.worst_first import limit_of, up_to


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 2000), wanted=st.integers(1, 500))
@settings(max_examples=100)
def test_the_worst_are_all_up_to_a_limit(seed, count, wanted):
    rng = np.random.default_rng(seed)
    shape = rng.uniform(-1, 1, count).astype(np.float32) ** rng.choice([1, 3])
    limit = limit_of(shape, wanted)
    cells = up_to(limit, shape)
    assert min(wanted, count) <= len(cells) <= max(wanted + wanted // 4, 1)
    np.testing.assert_array_equal(cells, np.flatnonzero(shape <= limit))


@pytest.mark.parametrize("value", [-1.0, 0.0, 0.5, 1.0])
def test_equal_ones_are_taken_together(value):
    shape = np.full(100, value, dtype=np.float32)
    assert len(up_to(limit_of(shape, 3), shape)) == 100
