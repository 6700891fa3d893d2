"""Cube roots against exact ones."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.simplex.cube_root import cube_root


@kernel
def roots(x, out):
    """Of each."""
    for i in range(len(x)):
        out[i] = cube_root(x[i])


def rooted(values):
    out = np.empty(len(values))
    roots(np.array(values, dtype=np.float64), out)
    return out


@given(st.lists(st.floats(2.4e-308, 4e307), min_size=1, max_size=80))
def test_within_two_units_in_the_last_place(values):
    for value, root in zip(values, rooted(values), strict=True):
        step = Fraction(2 * float(np.spacing(root)))
        assert (Fraction(root) - step) ** 3 < Fraction(value) < (Fraction(root) + step) ** 3


def test_cubes_of_small_numbers_zero_and_what_is_nearly_zero():
    whole = np.arange(1.0, 200.0)
    assert (abs(rooted(whole**3) - whole) <= np.spacing(whole)).all()
    assert rooted([0.0, 1e-320, 8.0]).tolist() == [0.0, 0.0, 2.0]
