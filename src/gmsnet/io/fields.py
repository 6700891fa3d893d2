"""Numbers that must fit into fields of so many characters: what of them is kept, and by how much that differs."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.rounding import Rounding

Floats = NDArray[np.float64]

LARGEST = 1.79e308  # of few digits
ABAQUS = 20  # characters that Abaqus and CalculiX read of a number, whatever follows


def short(value: float, width: int) -> float:
    """The nearest float64 whose ``repr`` has at most so many characters, at least 12."""
    digits = 17
    while len(repr(value)) > width:
        digits -= 1
        rounded = float(f"{value:.{digits - 1}e}")
        value = rounded if math.isfinite(rounded) else math.copysign(LARGEST, value)
    return value


def short_in_abaqus(points: Floats, nodes: NDArray[np.int64]) -> Floats:
    """The points as Abaqus reads them (see Rounding.keep)."""
    out = points.copy()
    size = np.abs(points)
    long = ((size < 0.1) | (size >= 1e16)) & (size > 0.0)  # all 17 digits fit between these
    out[long] = [short(value, ABAQUS) for value in points[long].tolist()]
    return out


def of_abaqus(points: Floats) -> Rounding:
    """14 digits are kept of the smallest and the largest numbers, and of others so many that 1e-17 is the error."""
    far = bool(np.abs(points).max(initial=0.0) > 1e15)
    return Rounding(1e-12 if far else 2.0**-53, 1e-17, short_in_abaqus, f"{ABAQUS} characters")
