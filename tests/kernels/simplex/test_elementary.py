from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.simplex.elementary import exponential, logarithm


@kernel
def exponentials(x, y):
    for k in range(len(x)):
        y[k] = exponential(x[k])


@kernel
def logarithms(x, y):
    for k in range(len(x)):
        y[k] = logarithm(x[k])


def of(kernel_, x):
    y = np.empty_like(x)
    kernel_(x, y)
    return y.astype(np.float64)


def test_exponential_is_exact_to_a_few_units_in_the_last_place():
    x = np.linspace(-80, 80, 1_000_001).astype(np.float32)
    assert np.abs(of(exponentials, x) / np.exp(x.astype(np.float64)) - 1).max() < 3e-7
    assert of(exponentials, np.zeros(1, np.float32)) == 1


def test_exponential_stands_still_beyond_its_range():
    far = np.array([-np.inf, -1e30, -81, 81, 1e30, np.inf], dtype=np.float32)
    ends = of(exponentials, np.array([-80, 80], dtype=np.float32))
    assert of(exponentials, far).tolist() == np.repeat(ends, 3).tolist()


def test_logarithm_is_exact_to_a_few_units_in_the_last_place():
    x = np.exp(np.linspace(-87, 88, 1_000_001)).astype(np.float32)
    near_one = (1 + np.linspace(-0.3, 0.5, 100_001)).astype(np.float32)
    for values in (x, near_one):
        right = np.log(values.astype(np.float64))
        assert (np.abs(of(logarithms, values) - right) <= 2e-7 * (1 + np.abs(right))).all()
    assert of(logarithms, np.ones(1, np.float32)) == 0
