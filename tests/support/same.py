"""Things of arrays, compared bit by bit."""

from __future__ import annotations

import dataclasses

import numpy as np


def same(one, other):
    """Are two dataclasses, tuples, dictionaries or arrays alike in all bits of their arrays?"""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    if dataclasses.is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in dataclasses.fields(one))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return len(one) == len(other) and all(map(same, one, other)) if isinstance(one, tuple) else one == other
