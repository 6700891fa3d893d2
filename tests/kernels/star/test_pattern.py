"""What kernels are given for the pattern of a star."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from support.patterns import Linked

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.star.pattern import count_of, neighbour_weight, neighbours, other_of, pair_of, weights_of


@kernel
def table_of(pattern, n, pair, other, weight, neighbour):
    for k in range(count_of(pattern, n)):
        pair[k, 0], pair[k, 1] = pair_of(pattern, n, k)
        other[k] = other_of(pattern, k, 0)
        weights = weights_of(pattern, k, np.float64)
        weight[k, 0], weight[k, 1], weight[k, 2] = weights.a, weights.b, weights.opposite
    for j in range(n):
        neighbour[j] = neighbour_weight(pattern, j)
    return neighbours(pattern, n)


@pytest.mark.parametrize(("triangles", "quads"), [(0, 4), (0, 1), (2, 2), (1, 3)])
def test_it_reads_the_table(triangles, quads):
    star = Linked(triangles, quads)
    simplices, n = triangles + 3 * quads, len(star.table.neighbour)
    pair, other = np.zeros((simplices, 2), dtype=np.int32), np.zeros(simplices, dtype=np.int32)
    weight, neighbour = np.zeros((simplices, 3)), np.zeros(n)
    assert table_of(star.pattern, n, pair, other, weight, neighbour) == star.table.neighbours[0]
    np.testing.assert_array_equal(pair, star.table.pair)
    np.testing.assert_array_equal(other, star.table.other)
    np.testing.assert_array_equal(weight, star.table.weight)
    np.testing.assert_array_equal(neighbour, star.table.neighbour)


def test_it_has_no_array_whose_references_are_counted_in_loops_over_lanes():
    assert all(isinstance(numba.typeof(field), numba.types.Number) for field in Linked(0, 4).pattern)
