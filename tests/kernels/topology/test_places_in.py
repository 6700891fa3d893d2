"""Places among ascending numbers are those of NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gmsnet.kernels.topology import places


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.integers(-(2**62), 2**62) | st.integers(0, 60), min_size=1, max_size=40),
    st.lists(st.integers(-(2**63), 2**63 - 1) | st.integers(-2, 62), min_size=1, max_size=40),
)  # fmt: skip
def test_places_are_those_of_numpy(numbers, wanted):
    ascending, wanted = np.unique(np.array(numbers, dtype=np.int64)), np.array([*wanted, *numbers], dtype=np.int64)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(places, "FEWEST", 1)
        found = places.places_in(ascending, wanted)
    assert found.tolist() == np.searchsorted(ascending, wanted).tolist()


def test_many_in_several_rows():
    rng = np.random.default_rng(0)
    ascending = np.unique(rng.integers(0, 10**9, 20_000))
    wanted = rng.choice(ascending, (10_000, 3)).astype(np.int64)
    assert (places.places_in(ascending, wanted) == np.searchsorted(ascending, wanted)).all()
