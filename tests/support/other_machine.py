"""A machine of its own memory that is this processor: kernels compiled anew for one star, as for a GPU."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from types import ModuleType

import numba
import numpy as np
from numba.core import types
from numba.extending import intrinsic

from gmsnet.cuda.parts import FEWEST
from gmsnet.kernels.jit.retarget import Retarget
from gmsnet.kernels.simplex.jacobian3 import SIZE, solid_workspace
from gmsnet.kernels.star.stars3 import aligned, aligned_of_star

MODE = {"error_model": "numpy"}


@cache
def parts_for(room):
    """As gmsnet.cuda.parts.parts_for, for the processor; longer arrays are an error."""

    @numba.njit(**MODE)
    def checked(size):
        if size > room:
            raise MemoryError
        return size

    def empty(size, dtype=np.float64):
        return np.empty(checked(size), dtype=dtype)

    def zeros(size, dtype=np.float64):
        return np.zeros(checked(size), dtype=dtype)

    module = ModuleType("numpy")
    vars(module).update({name: getattr(np, name) for name in dir(np) if not name.startswith("_")})
    module.empty, module.zeros = (numba.njit(**MODE)(each) for each in (empty, zeros))
    parts = {}
    if room > FEWEST:
        parts = {
            aligned: parts_for(FEWEST).names["np"].empty,
            aligned_of_star: module.empty,
            solid_workspace: numba.njit(**MODE)(lambda: np.zeros(SIZE)),
        }
    return Retarget(numba.njit(**MODE), {"LANES": 1, "LANES3": 1, "np": module}, parts, intrinsic, types)


class Processor:
    """See gmsnet.cuda.executor.Machine. sweeps, summaries: how many it has done. closed: it was told to let go."""

    name = "another processor"

    def __init__(self):
        self.sweeps = self.summaries = 0
        self.closed = False

    def there(self, values):
        return np.array(values, order="C")

    def send(self, values, there):
        there[:] = values

    def fetch(self, there, values):
        values[:] = there

    def start(self, kernel, room, stars, arguments):
        points, blocks, first, guard, own, tally = arguments
        assert np.diff(first).max() == stars
        self.sweeps += 1
        for colour in range(len(first) - 1):
            parts_for(room).of(kernel)(points, blocks, first[colour], first[colour + 1], guard, *own, tally)

    def summarise(self, summary, rows, arguments):
        points, cells, rest = arguments
        self.summaries += 1
        ends = np.linspace(0, rows, 8).astype(int)
        figures = np.full((len(ends) - 1, summary.figures), np.nan)
        for part, (first, last) in zip(figures, pairwise(ends), strict=True):
            parts_for(32).of(summary.part)(points, *cells, first, last, *rest, part)
        return figures

    def close(self):
        self.closed = True
