"""Exact arithmetic in whole numbers, where sums of fractions would be slow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from math import lcm


def whole(numbers: Iterable[float | Fraction]) -> tuple[list[int], int]:
    """Numbers times their common denominator, and that."""
    pairs = [number.as_integer_ratio() for number in numbers]
    common = lcm(*(below for _, below in pairs))
    return [above * (common // below) for above, below in pairs], common


def value(polynomial: Mapping[tuple[int, ...], float | Fraction], place: Iterable[float | Fraction]) -> Fraction:
    """Of a polynomial, exponents → coefficient, at a place."""
    numbers, common = whole(polynomial.values())
    at, below = whole(place)
    degree = max(map(sum, polynomial), default=0)
    powers = [[number**k for k in range(degree + 1)] for number in (*at, below)]
    total = 0
    for exponents, term in zip(polynomial, numbers, strict=True):
        for of_one, exponent in zip(powers, (*exponents, degree - sum(exponents)), strict=True):
            term *= of_one[exponent]
        total += term
    return Fraction(total, common * powers[-1][degree])
