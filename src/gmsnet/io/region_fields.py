"""Which cell fields tell regions (materials, parts, …) apart, and the region of each cell that follows."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

WORDS = (
    *("mat", "material", "region", "zone", "domain", "subdomain", "physical", "attribute"),
    *("entity", "ref", "tag", "part", "block", "group"),
)
REGION_NAMES = frozenset(
    "".join(parts)
    for parts in product(
        ("", "gmsh:", "medit:", "cell"),
        ("", "_"),
        WORDS,
        ("", "s"),
        ("", "id", "ids", "index", "_id", "_ids", "_index"),
    )
)


def names_a_region(name: str) -> bool:
    """Whether a cell field of this name tells regions apart (``material``, ``region_id``, ``gmsh:physical``, …)."""
    return name.lower() in REGION_NAMES


def regions_of(fields: Iterable[tuple[str, NDArray[Any]]], count: int) -> NDArray[np.int64]:
    """(count,) the region of each cell: 0 without a field of one number a cell whose name says so.

    One field of whole numbers gives its own numbers. Else the distinct values, of several fields the distinct
    combinations, are counted from 1.
    """
    named = [
        array.reshape(count)
        for name, array in fields
        if names_a_region(name) and len(array) == count and array.size == count
    ]
    if not named or not count:
        return np.zeros(count, dtype=np.int64)
    if len(named) == 1:
        values = named[0]
        if values.dtype.kind in "iub":
            return values.astype(np.int64)
        if np.isfinite(values).all() and (values == np.rint(values)).all() and (abs(values) < 2**53).all():
            return values.astype(np.int64)
    region = np.zeros(count, dtype=np.int64)
    for values in named:
        which = np.unique(values, return_inverse=True)[1].reshape(count)
        region = np.unique(region * (int(which.max()) + 1) + which, return_inverse=True)[1].reshape(count)
    return region + 1
