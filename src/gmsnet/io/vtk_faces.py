"""Polyhedra in legacy VTK files: a list says how many faces the cell has, then the size and the nodes of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.cell_table import check_range
from gmsnet.io.places import ranges
from gmsnet.kernels.text import text as kernels
from gmsnet.mesh.display import amount

Ints = NDArray[np.int64]
Fail = Callable[[int, str], NoReturn]


def nodes_once(chosen: NDArray[np.bool_], sizes: Ints, numbers: Ints, points: int, fail: Fail) -> tuple[Ints, Ints]:
    """The number of nodes of each cell, and which of the numbers are these nodes, those of a polyhedron once each.

    chosen: (n,) which cells are polyhedra. sizes: (n,) numbers of each list; numbers: of all lists in turn. points: how
    many there are. ``fail(index into numbers, message)`` raises FormatError for faces that do not fill a list.
    """
    starts = np.cumsum(sizes) - sizes
    heads, length = starts[chosen], sizes[chosen]
    if (empty := np.flatnonzero(chosen & (sizes == 0))).size:
        raise FormatError(f"cell {empty[0]} (counted from 0) is a polyhedron without faces")
    faces = numbers[heads]
    if (wrong := np.flatnonzero((faces < 1) | (faces >= length))).size:
        k = int(wrong[0])
        fail(int(heads[k]), f"a polyhedron of {faces[k]} faces in a list of {length[k]} numbers")
    body = ranges(heads + 1, length - 1)
    none, first = np.empty(0, dtype=np.int8), np.empty(int(faces.sum()), dtype=np.int64)
    found, _ = kernels.walk(numbers[body], 0, 1, -1, 0, none, none, first)
    count = numbers[body[first[:found]]]
    ends = np.full(len(first), -1)  # of each face; those that are cut off fit nowhere
    ends[:found] = first[:found] + 1 + count
    if (wrong := np.flatnonzero(ends[np.cumsum(faces) - 1] != np.cumsum(length - 1))).size:
        k = int(wrong[0])
        what = amount(int(faces[k]), "face")
        fail(int(heads[k]), f"a polyhedron of {what} does not fill its list of {length[k]} numbers")
    at = body[ranges(first + 1, count)]
    check_range(numbers[at], points, lambda k, message: fail(int(at[k]), message))
    cell = np.repeat(np.repeat(np.arange(len(faces)), faces), count)
    _, once = np.unique(cell * points + numbers[at], return_index=True)
    sizes = sizes.copy()
    sizes[chosen] = np.bincount(cell[once], minlength=len(faces))
    kept = np.concatenate([ranges(starts[~chosen], sizes[~chosen]), at[once]])
    return sizes, np.sort(kept)
