"""Which cell fields tell regions (materials, parts, …) apart, and the region of each cell that follows."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology.sorted_unique import sorted_unique

WORDS = (  # FreeFEM writes Label, deal.II MaterialID, MFEM attribute, Gmsh CellEntityIds, Elmer GeometryIds
    *("mat", "material", "region", "zone", "domain", "subdomain", "physical", "attribute"),
    *("entity", "ref", "tag", "part", "block", "group", "label", "marker", "geometry", "family"),
)
NAMES = "gmsnet:region_names"  # the field data that names the numbers of the cell field "region": rows of texts
NUMBERED = 64  # cells: where so many or more all have different values, these number cells and tell no regions apart
OTHER_NAMES = frozenset(("familyidcell", "med:familyidcell", "objectid"))  # of Salome, and of Exodus files
REGION_NAMES = OTHER_NAMES | frozenset(
    "".join(parts)
    for parts in product(
        ("", "gmsh:", "medit:", "cell", "mesh"),
        ("", "_"),
        WORDS,
        ("", "s"),
        ("", "id", "ids", "index", "_id", "_ids", "_index"),
    )
)


def names_a_region(name: str) -> bool:
    """Whether a cell field of this name tells regions apart (``material``, ``region_id``, ``gmsh:physical``, …)."""
    return name.lower().replace(" ", "_") in REGION_NAMES


def regions_of(fields: Iterable[tuple[str, NDArray[Any]]], count: int) -> NDArray[np.int64]:
    """(count,) the region of each cell, from those fields of one number a cell whose name says so; see ``combined``."""
    return combined(
        [array for name, array in fields if names_a_region(name) and len(array) == count and array.size == count],
        count,
    )


def combined(fields: Sequence[NDArray[Any]], count: int) -> NDArray[np.int64]:
    """(count,) one number per cell, equal for two cells where all fields (count, …) are.

    0 without a field. One field of whole numbers gives its own numbers. Else the distinct values, of several fields the
    distinct combinations, are counted from 1. Values count, not their spelling in a file: ``1`` and ``1.0`` are equal.
    Fields of one number that is another for each of many cells count for nothing.
    """
    tables = [np.asarray(field).reshape(count, -1) for field in fields] if count else []
    tables = [table for table in tables if table.shape[1] != 1 or not _numbers_cells(table.ravel())]
    if not tables:
        return np.zeros(count, dtype=np.int64)
    if len(tables) == 1 and tables[0].shape[1] == 1 and _whole(tables[0]):
        return tables[0].ravel().astype(np.int64)
    region = np.zeros(count, dtype=np.int64)
    for table in tables:
        rows = table if table.shape[1] > 1 else table.ravel()
        which = np.unique(rows, axis=0, return_inverse=True)[1].reshape(count)
        region = np.unique(region * (int(which.max()) + 1) + which, return_inverse=True)[1].reshape(count)
    return region + 1


def named_rows(names: Mapping[tuple[int, int], str]) -> list[str]:
    """Names of regions, (dimension, region) → name, as a text each."""
    return [f"{dimension} {region} {name}" for (dimension, region), name in names.items()]


def names_of_rows(rows: Iterable[Any]) -> dict[tuple[int, int], str]:
    """The names that ``named_rows`` wrote. Texts of another form name nothing: others may use the same field."""
    found = (re.fullmatch(r"(\d) (-?\d+) (.+)", str(row)) for row in rows)
    return {(int(match[1]), int(match[2])): match[3] for match in found if match}


def _numbers_cells(values: NDArray[Any]) -> bool:
    """Whether each of many cells has a value of its own."""
    count = len(values)  # that the first of them differ is seldom, and quickly told
    return count >= NUMBERED and all(len(sorted_unique(part)) == len(part) for part in (values[:NUMBERED], values))


def _whole(values: NDArray[Any]) -> bool:
    """Are all of them whole numbers that an int64 holds?"""
    if values.dtype.kind in "iub":
        return True
    finite = values.dtype.kind == "f" and bool(np.isfinite(values).all())
    return finite and bool((values == np.rint(values)).all() and (abs(values) < 2**53).all())
