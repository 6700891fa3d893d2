"""How a file keeps coordinates that are new in it, where its fields have no room for all digits of a float64."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Rounding(NamedTuple):
    """What becomes of a coordinate x that is written: one that differs by at most unit·|x| + grain.

    keep: (n, dim) coordinates and the (n,) nodes that they are of → what the file will hold of them. It must be a
    function that pickle knows. words: what limits them, for messages.
    """

    unit: float
    grain: float
    keep: Callable[[Floats, NDArray[np.int64]], Floats]
    words: str

    def kept(self, old: Floats, new: Floats) -> Floats:
        """(N, dim) the new points as they will be in the file, which has the old ones: what is equal stays."""
        out = new.copy()
        moved = np.flatnonzero((old != new).any(axis=1))
        rounded = self.keep(new[moved], moved)
        out[moved] = np.where(old[moved] == new[moved], new[moved], rounded)
        return out
