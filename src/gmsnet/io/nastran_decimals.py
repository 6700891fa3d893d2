"""Many reals in fields of few columns at once: the same decimals as ``nastran_numbers.fitted`` makes one by one.

A product with a power of ten is taken with its rounding error (T. J. Dekker, Numer. Math. 18, 1971), so that the
nearest whole number is known; the few numbers that lie between two of them are left to the slow way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

WIDEST = 16  # columns: all digits of such a field are a whole number below 2⁵³
_POWERS = np.array([float(10**k) for k in range(WIDEST + 1)])  # exact
_SPLIT = 134217729.0  # 2²⁷ + 1


def digits(values: Floats, widths: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64], NDArray[np.bool_]]:
    """(n,) the digits of each number as a whole number, how many of them stand behind the point, and for which numbers
    that is certain: plain decimals that are no ties.
    """
    size = np.abs(values)
    sure = (size >= 0.01) & (size < 10.0 ** (widths - 3.0)) & (widths <= WIDEST)
    size = np.where(sure, size, 1.0)
    before = np.searchsorted(_POWERS, size, side="right")  # the point
    places = np.where(sure, widths - (values < 0.0) - 1 - before, 0)
    whole, rest = _product(size, _POWERS[places])
    found = np.rint(whole)
    rest += whole - found
    found += np.where(rest > 0.5, 1.0, np.where(rest < -0.5, -1.0, 0.0))
    return found, places, sure & (np.abs(np.abs(rest) - 0.5) > 1e-6)


def _product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The product as it is rounded, and its error."""
    (a_high, a_low), (b_high, b_low) = _split(a), _split(b)
    product = a * b
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _split(a: Floats) -> tuple[Floats, Floats]:
    high = _SPLIT * a
    high = high - (high - a)
    return high, a - high


def rounded(values: Floats, widths: NDArray[np.int64]) -> tuple[Floats, NDArray[np.bool_]]:
    """(n,) what is kept of each number, and for which that is certain."""
    found, places, sure = digits(values, widths)
    return np.copysign(found / _POWERS[places], values), sure


def texts(values: Floats, widths: NDArray[np.int64]) -> list[str | None]:
    """The decimals of each number; None where they are not certain."""
    found, places, sure = digits(values, widths)
    return [
        _text(n, behind, value < 0.0) if good else None
        for n, behind, value, good in zip(
            found.astype(np.int64).tolist(), places.tolist(), values.tolist(), sure.tolist(), strict=True
        )
    ]


def _text(n: int, places: int, negative: bool) -> str:
    """Without zeros that say nothing."""
    all_digits = f"{n:0{places}d}"
    at = len(all_digits) - places
    return f"{'-' * negative}{all_digits[:at].lstrip('0')}.{all_digits[at:].rstrip('0')}"
