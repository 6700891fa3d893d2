"""Tensors and their logarithms, both ways; what is no metric is refused with its place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import naive_metric as naive

from gmsnet.errors import InputError
from gmsnet.metric.tensors import checked_metric, checked_sizes, logs_of, tensors_of

numbers = st.floats(-5.0, 5.0)


@given(numbers, numbers, numbers)
def test_a_logarithm_leads_back_to_its_tensor(t, u, v):
    log = np.array([[t, u, v]])
    tensor = tensors_of(log)
    (a, b), (_, c) = naive.tensor(log[0])
    np.testing.assert_allclose(tensor, [[a, b, c]], rtol=1e-10, atol=1e-12 * max(a, c))
    np.testing.assert_allclose(logs_of(tensor), log, atol=1e-4 if np.hypot(u, v) > 3 else 1e-9)


def test_isotropic_and_huge_tensors_have_logarithms():
    tensors = np.array([[4.0, 0.0, 4.0], [1e300, 0.0, 1e300], [1e-300, 0.0, 1e-300], [1e200, 0.0, 1e190]])
    logs = logs_of(tensors)
    np.testing.assert_allclose(logs[:3, 0], np.log([4.0, 1e300, 1e-300]))
    assert (logs[:3, 1:] == 0.0).all()
    np.testing.assert_allclose(logs[3], [0.5 * np.log(10.0) * 390, 0.5 * np.log(1e10), 0.0])
    np.testing.assert_array_equal(checked_sizes([0.5, 2.0], 2, "node")[:, 0], -2.0 * np.log([0.5, 2.0]))
    np.testing.assert_allclose(tensors_of(checked_sizes([0.5], 1, "node")), [[4.0, 0.0, 4.0]])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((2, 3)), r"the metric at node 0 \(counted from 0\) is not positive definite"),
        ([[1, 0, 1], [1, 1, 1]], "the metric at node 1"),
        ([[1, 0, 1], [-1, 0, 1]], "the metric at node 1"),
        ([[1, 0, 1], [np.nan, 0, 1]], "the metric at node 1"),
        ([[1, 0, 1], [1, 0, np.inf]], "the metric at node 1"),
        (np.ones((3, 3)), r"for 2 nodes it has the shape \(3, 3\)"),
        (np.ones(2), r"it has the shape \(2,\)"),
        ([["a", "b", "c"]] * 2, "got <U1 values"),
        ([[1, 2], [3]], "cannot be made an array"),
    ],
)
def test_what_is_no_metric_is_refused(values, message):
    with pytest.raises(InputError, match=message):
        checked_metric(values, 2, "node")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([1.0, 0.0], r"the size at node 1 \(counted from 0\) must be a positive number"),
        ([1.0, -2.0], "the size at node 1"),
        ([np.nan, 1.0], "the size at node 0"),
        ([1.0, np.inf], "the size at node 1"),
        ([1.0], r"for 2 nodes it has the shape \(1,\)"),
        (np.ones((2, 3)), r"it has the shape \(2, 3\)"),
    ],
)
def test_what_is_no_size_is_refused(values, message):
    with pytest.raises(InputError, match=message):
        checked_sizes(values, 2, "node")
