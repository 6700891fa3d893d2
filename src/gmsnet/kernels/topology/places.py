"""Where whole numbers stand among ascending ones: by a table of ranges, where halving misses the cache at each step."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import kernel

FEWEST = 1000  # below, halving is as fast


def places_in(ascending: NDArray[np.int64], wanted: NDArray[np.integer[Any]]) -> NDArray[np.int64]:
    """``np.searchsorted(ascending, wanted)`` of whole numbers, in a fraction of the time where both are many.

    ascending: (n,). wanted: of any shape.
    """
    if len(ascending) < FEWEST or wanted.size < FEWEST:
        return np.searchsorted(ascending, wanted)
    span = int(ascending[-1]) - int(ascending[0])
    if span >= 2**62:  # differences would overflow
        return np.searchsorted(ascending, wanted)
    shift = max(0, span.bit_length() - len(ascending).bit_length())  # about as many ranges as there are numbers
    found = np.empty(wanted.size, dtype=np.int64)
    ascending = np.ascontiguousarray(ascending, dtype=np.int64)
    _look_up(ascending, np.ascontiguousarray(wanted, dtype=np.int64).reshape(-1), np.int64(shift), found)
    return found.reshape(wanted.shape)


@kernel
def _look_up(ascending, wanted, shift, found):
    """As ``np.searchsorted``, into found. A range has the numbers of one shifted distance from the first number."""
    count, low, high = len(ascending), ascending[0], ascending[len(ascending) - 1]
    ranges = (high - low >> shift) + 1
    first = np.empty(ranges + 1, dtype=np.int32)  # of the numbers of each range
    k = 0
    for one in range(ranges):
        while k < count and (ascending[k] - low >> shift) < one:
            k += 1
        first[one] = k
    first[ranges] = count
    for k in range(len(wanted)):
        number = wanted[k]
        if number <= low:
            found[k] = 0
        elif number > high:
            found[k] = count
        else:
            one = number - low >> shift
            left, right = first[one], first[one + 1]
            while left < right:
                middle = (left + right) // 2
                if ascending[middle] < number:
                    left = middle + 1
                else:
                    right = middle
            found[k] = left
