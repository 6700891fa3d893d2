"""What is asked of all lanes at once."""

from __future__ import annotations

from gmsnet.kernels.jit.compile import LANES, part


@part
def any_positive(values, row):
    """Is one of the LANES values of this row positive? (``.max()`` would need all that Numba has for iterators.)"""
    for lane in range(LANES):  # noqa: SIM110 - any() needs more to compile
        if values[row * LANES + lane] > 0.0:
            return True
    return False
