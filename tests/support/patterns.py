"""Stars of triangles, of quads and of both, with the patterns that kernels are given for them."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.star.pattern import pattern_at
from gmsnet.topology.links import patterns_of
from support.random_stars import star


class Fan:
    """A star of triangles: what kernels are given for its pattern, and its simplices (i, j, weights)."""

    pattern = None

    def simplices(self, degree):
        return [((j - 1) % degree, j, (1, 1, 1)) for j in range(degree)]


class Linked(Fan):
    """A star of so many triangles and quads."""

    def __init__(self, triangles, quads):
        self.triangles, self.quads = triangles, quads
        kind = (triangles, quads, triangles > 0 < quads)
        self.table = patterns_of([kind])  # which the pattern has by its addresses
        self.pattern = pattern_at.py_func(self.table, np.zeros(1, dtype=np.int32), 0)

    def simplices(self, _):
        at, table = range(self.pattern.simplices), self.table
        return [(*table.pair[k].tolist(), table.weight[k].tolist()) for k in at]

    def star(self, rng):
        """The nodes around in the order of the pattern. Where cells meet, those of mixed stars are there twice."""
        cells = self.triangles + self.quads
        centre, corners = star(rng, cells + self.quads)
        kinds, corner, around = [3] * self.triangles + [4] * self.quads, 0, []
        for kind in kinds:
            own = [corners[(corner + k) % len(corners)] for k in range(kind - 1)]
            around += own if self.triangles and self.quads else own[1:] if kind == 3 else own[:2]
            corner += kind - 2
        return centre, np.array(around)


FAN = Fan()
