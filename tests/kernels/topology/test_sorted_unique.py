"""The distinct numbers are those of NumPy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from gmsnet.kernels.topology.sorted_unique import sorted_unique


@given(arrays.arrays(st.sampled_from([np.int64, np.int32, np.uint8]), arrays.array_shapes(max_dims=2, min_side=0)))
def test_numbers_are_those_of_numpy(numbers):
    found, wanted = sorted_unique(numbers), np.unique(numbers)
    assert found.dtype == wanted.dtype
    assert found.tolist() == wanted.tolist()
