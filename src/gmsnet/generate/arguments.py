"""Whether numbers and names that generators are given can be used."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gmsnet.errors import InputError


def whole_number(value: object, name: str, least: int) -> int:
    """The value as an int. Raises InputError if it is no whole number of at least ``least``."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{name} must be a whole number of at least {least}, got {value!r}")
    return int(value)


def number_between(value: float, name: str, low: float, high: float) -> float:
    """The value as a float. Raises InputError unless low ≤ value ≤ high."""
    if not (np.isfinite(value) and low <= value <= high):
        raise InputError(f"{name} must lie between {low:g} and {high:g}, got {value!r}")
    return float(value)


def at_least(value: float, name: str, low: float) -> float:
    """The value as a float. Raises InputError unless it is finite and not below ``low``."""
    if not (np.isfinite(value) and value >= low):
        raise InputError(f"{name} must be a number of at least {low:g}, got {value!r}")
    return float(value)


def positive(value: float, name: str) -> float:
    """The value as a float. Raises InputError unless it is positive and finite."""
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} must be a positive number, got {value!r}")
    return float(value)


def one_of(value: str, name: str, choices: Sequence[str]) -> str:
    """The value. Raises InputError unless it is one of the choices."""
    if value not in choices:
        raise InputError(f"{name} must be {' or '.join(map(repr, choices))}, got {value!r}")
    return value
