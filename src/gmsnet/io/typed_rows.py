"""Elements that each have their type in front of their nodes: those of one type as rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.rows import Listed, Ranges
from gmsnet.kernels.text.typed import typed_starts

Ints = NDArray[np.int64]

AT_ONCE = 1 << 18  # numbers between two marks


@dataclass(frozen=True, eq=False)
class TypedRows:
    """The nodes of all elements of one type. listed: the numbers of elements of all types, one in a row. sizes: of each
    code the number of nodes, 0 where it is not known. marks: (m,) the first number of an element, at the end that
    behind the last one. before: (m,) how many elements of this type are in front of each.
    """

    listed: Listed
    code: int
    sizes: Ints
    marks: Ints
    before: Ints

    @property
    def rows(self) -> int:
        """How many there are."""
        return int(self.before[-1])

    @property
    def width(self) -> int:
        """Nodes of each."""
        return int(self.sizes[self.code])

    @property
    def dtype(self) -> str:
        """Of all numbers."""
        return self.listed.dtype

    def of(self, file: Ranges, first: int, last: int) -> Ints:
        """(last − first, width) the numbers of some rows."""
        begin, end = self._mark(first), int(np.searchsorted(self.before, last))
        values, starts = _elements(file, self.listed, int(self.marks[begin]), int(self.marks[end]), self.sizes)
        rows = starts[values[starts] == self.code][first - self.before[begin] : last - self.before[begin]]
        if len(rows) < last - first:
            raise FormatError(f"{self.where(first)}: the types of elements are no more what they were")
        found: Ints = values[rows[:, None] + np.arange(1, self.width + 1)]
        return found

    def where(self, row: int) -> str:
        """Of a row, for messages."""
        return f"{self.listed.where(int(self.marks[self._mark(row)]))} or behind"

    def _mark(self, row: int) -> int:
        """The last one in front of a row."""
        return int(np.searchsorted(self.before, row, side="right")) - 1


def typed_rows(file: Ranges, listed: Listed, sizes: Ints) -> dict[int, TypedRows] | None:
    """Type → its elements, by ascending types. listed, sizes: see TypedRows. None where a type is not known, or the
    last element ends behind the numbers."""
    at, marks, counts = 0, [0], [np.zeros(len(sizes), dtype=np.int64)]
    while at < listed.rows:
        values, starts = _elements(file, listed, at, min(at + AT_ONCE, listed.rows), sizes)
        if not len(starts):
            return None
        codes = values[starts]
        at += int(starts[-1]) + 1 + int(sizes[codes[-1]])
        marks.append(at)
        counts.append(counts[-1] + np.bincount(codes, minlength=len(sizes)))
    if at != listed.rows:
        return None
    before = np.array(counts)
    return {code: TypedRows(listed, code, sizes, np.array(marks), before[:, code].copy())
            for code in np.flatnonzero(before[-1]).tolist()}  # fmt: skip


def _elements(file: Ranges, listed: Listed, begin: int, end: int, sizes: Ints) -> tuple[Ints, Ints]:
    """The numbers from one to another, and where elements begin in them, up to the first of no known type."""
    values = listed.of(file, begin, end)[:, 0].astype(np.int64)
    starts = np.empty(len(values), dtype=np.int64)
    found, _ = typed_starts(values, sizes, 0, starts)
    return values, starts[:found]
