"""Addresses of many numbers of a file: rows as far apart as one another, else one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.contents import Data

MOST_LATTICES = 1000  # where records differ more often than that, addresses are kept one by one


@dataclass(frozen=True)
class Lattice:
    """``rows`` rows; number j of row k has the address start + k · stride + columns[j]."""

    start: int
    rows: int
    stride: int
    columns: tuple[int, ...] | range = (0,)

    def __len__(self) -> int:
        return self.rows * len(self.columns)

    def column(self, data: Data | bytearray, column: int, dtype: str) -> NDArray[Any]:
        """(rows,) the binary numbers at one of the columns of all rows, in the memory of ``data``."""
        return np.ndarray((self.rows,), dtype, data, self.start + column, (self.stride,))

    def table(self, data: Data | NDArray[Any], dtype: Any, unit: int = 1) -> NDArray[Any] | None:
        """(rows, columns) all the numbers at once, in the memory of ``data``, where an address is ``unit`` bytes.

        None where they are to be taken column by column: few columns, for which that is faster, or uneven ones.
        """
        if not isinstance(self.columns, range) or len(self.columns) <= self.rows:
            return None
        start, strides = unit * (self.start + self.columns[0]), (unit * self.stride, unit * self.columns.step)
        return np.ndarray((self.rows, len(self.columns)), dtype, data, start, strides)


class Places(Sequence[int]):
    """The addresses of numbers in lattices, one after another and row by row."""

    def __init__(self, *lattices: Lattice) -> None:
        self.lattices = lattices

    @cached_property
    def _ends(self) -> NDArray[np.int64]:
        return np.cumsum([len(lattice) for lattice in self.lattices])

    def __len__(self) -> int:
        return int(self._ends[-1]) if self.lattices else 0

    def __getitem__(self, index: int) -> int:  # type: ignore[override]
        part = int(np.searchsorted(self._ends, index, side="right"))
        lattice = self.lattices[part]
        row, column = divmod(index - int(self._ends[part]) + len(lattice), len(lattice.columns))
        return lattice.start + row * lattice.stride + lattice.columns[column]

    def in_threes(self) -> Places:
        """The same places, three to a row, where they are one to a row."""
        return Places(
            *(
                lattice
                if len(lattice.columns) > 1
                else Lattice(
                    lattice.start + lattice.columns[0],
                    lattice.rows // 3,
                    3 * lattice.stride,
                    (0, lattice.stride, 2 * lattice.stride),
                )
                for lattice in self.lattices
            )
        )


Addresses = Places | NDArray[np.int64]


def pick(values: NDArray[Any], addresses: Addresses) -> NDArray[Any]:
    """(n,) what stands at addresses, where these are indices of ``values``."""
    if not isinstance(addresses, Places):
        return values[addresses]
    parts = [values[:0]]
    for lattice in addresses.lattices:
        if not len(lattice):
            continue
        if (table := lattice.table(np.ascontiguousarray(values), values.dtype, values.itemsize)) is not None:
            parts.append(table.reshape(-1))
            continue
        columns = [values[lattice.start + c :: lattice.stride][: lattice.rows] for c in lattice.columns]
        parts.append(columns[0] if len(columns) == 1 else np.stack(columns, axis=1).reshape(-1))
    return parts[1] if len(parts) == 2 else np.concatenate(parts)


def shifted(addresses: Addresses, by: int) -> Addresses:
    """The addresses that are so much further on."""
    if isinstance(addresses, Places):
        return Places(*(replace(lattice, start=lattice.start + by) for lattice in addresses.lattices))
    return addresses + by


def chained(parts: Sequence[Addresses]) -> Addresses:
    """The addresses of all parts one after another."""
    if all(isinstance(part, Places) for part in parts):
        return Places(*(lattice for part in parts if isinstance(part, Places) for lattice in part.lattices))
    return np.concatenate([np.asarray(part) for part in parts])


def side_by_side(*columns: Addresses) -> Places:
    """The addresses of one column each, as rows of them all."""
    parts = [column.lattices for column in columns if isinstance(column, Places)]
    if len(parts) == len(columns):
        found = [
            Lattice(first.start, first.rows, first.stride, tuple(part.start - first.start for part in row))
            for row in zip(*parts, strict=True)
            for first in row[:1]
        ]
    else:
        table = np.stack([np.asarray(column) for column in columns], axis=1).tolist()
        found = [Lattice(row[0], 1, 1, tuple(place - row[0] for place in row)) for row in table]
    return Places(*found)


def lists(
    first: NDArray[np.int64], lengths: NDArray[np.int64], skip: NDArray[np.int64], counts: NDArray[Any], unit: int = 1
) -> Addresses:
    """The addresses of ``counts[k]`` numbers from first[k] + skip[k] on, ``unit`` apart, for each record k.

    A record follows the one before it, and has the given length. Where they change seldom these are lattices.
    """
    changes = (lengths[1:] != lengths[:-1]) | (counts[1:] != counts[:-1]) | (skip[1:] != skip[:-1])
    cuts = (np.flatnonzero(changes) + 1).tolist()
    if len(cuts) > MOST_LATTICES:
        return ranges(first + skip, counts.astype(np.int64), unit)
    found = []
    for start, end in zip([0, *cuts], [*cuts, len(first)], strict=True):
        if start < end and counts[start]:
            columns = range(0, unit * int(counts[start]), unit)
            found.append(Lattice(int(first[start] + skip[start]), end - start, int(lengths[start]), columns))
    return Places(*found)


def ranges(first: NDArray[np.int64], count: NDArray[np.int64], step: int = 1) -> NDArray[np.int64]:
    """One after another the ranges first[k], first[k] + step, … of count[k] numbers each."""
    ends = np.cumsum(count)
    rank = np.arange(int(ends[-1]) if len(ends) else 0) - np.repeat(ends - count, count)
    return np.repeat(first, count) + step * rank
