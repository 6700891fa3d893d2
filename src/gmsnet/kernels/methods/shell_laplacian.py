"""To the mean of the neighbours, at single stars of a surface."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.methods.shell import go, mean_of, value_at
from gmsnet.kernels.star.pattern import pattern_at
from gmsnet.kernels.star.shell import gather


@kernel
def average(points, stars, first, last, guard, smart, tally):
    """Visits the stars first…last once: to the mean of the neighbours. smart: only as far as Σq falls."""
    star, floors, work = np.empty(3 * stars.most), np.empty(stars.most + 1), np.empty(24)
    for k in range(first, last):
        i = stars.node[k]
        n, reach = gather(points, stars, i, guard, star, floors)
        pattern = pattern_at(stars.patterns, stars.pattern, i)
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        mx, my, mz = mean_of(star, n, pattern)
        value = np.inf
        if smart:
            value, _ = value_at(star, n, pattern, x, y, z, 1.0, 0)
        go(points, i, stars, guard, star, n, pattern, floors, reach, mx - x, my - y, mz - z, value, 1.0, 0,
           work[15:18], work[18:21], tally)  # fmt: skip
