from __future__ import annotations

import numba
import numpy as np
import pytest

from gmsnet.kernels.jit.compile import OPTIONS, kernel
from gmsnet.kernels.jit.prefetch import prefetch


@kernel
def ask_for(array, rows):
    for k in range(len(rows)):
        prefetch(array, np.uint32(rows[k]))


@pytest.mark.parametrize("array", [np.arange(40.0).reshape(20, 2), np.arange(80.0).reshape(40, 2)[::2], np.ones(20)])
def test_what_is_asked_for_stays_as_it_is(array):
    """Rows that do not exist are asked for in vain, and without harm."""
    before = array.copy()
    ask_for(array, np.array([0, 7, 19, 19, 20, 10**6, 2**32 - 1]))
    np.testing.assert_array_equal(array, before)


def test_the_processor_is_asked():
    """What is compiled has the instruction in it, so that it was not taken for useless."""
    anew = numba.njit(**OPTIONS)(ask_for.py_func)  # of what comes from the disk there is no code to look at
    anew(np.ones((2, 2)), np.zeros(1, dtype=np.int64))
    (code,) = anew.inspect_llvm().values()
    assert "llvm.prefetch" in code
