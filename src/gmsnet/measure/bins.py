"""The classes of histograms of a measure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BINS = 60
ENDS = {"min_dihedral": (0.0, float(np.degrees(np.arccos(1 / 3)))), "max_dihedral": (60.0, 180.0)}


def bins_of(name: str, values: Sequence[Floats], quads: bool) -> Floats:
    """(BINS + 1,) the ends of the classes of a column of QualityReport. values: of all meshes that are compared.

    They go to the best value there is: for ``min_angle`` 60 degrees, or 90 where there are quads, for ``min_dihedral``
    that of the regular tetrahedron, and 1 else. Below 0 if cells are inverted. For ``max_dihedral`` they go from 60 to
    180 degrees.
    """
    low, best = ENDS.get(name, (0.0, 1.0))
    low = min([low, *(float(each.min()) for each in values)])
    if name == "min_angle":
        best = 90.0 if quads else 60.0
    ends: Floats = np.linspace(low, best, BINS + 1)
    return ends
