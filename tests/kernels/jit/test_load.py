import numpy as np
import pytest

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.jit.load import load


@kernel
def numbers(table, out):
    for k in range(len(out)):
        out[k] = load(np.float64, table.ctypes.data, k)


@kernel
def whole_numbers(table, out):
    for k in range(len(out)):
        out[k] = load(np.int32, table.ctypes.data, k)


@pytest.mark.parametrize(("read", "kind"), [(numbers, np.float64), (whole_numbers, np.int32)])
def test_it_reads_what_stands_in_the_array(read, kind):
    table, out = np.arange(-3, 9, dtype=kind).reshape(4, 3), np.zeros(12)
    read(table, out)
    np.testing.assert_array_equal(out, table.ravel())
