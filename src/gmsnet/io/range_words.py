"""The numbers of a binary file that is not in memory: those of its heads, a few at a time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.places import Addresses, Lattice, Places
from gmsnet.io.rows import Ranges, Rows
from gmsnet.io.words import ByteWords

AT_ONCE = 1 << 16  # bytes that are read together


class RangeWords(ByteWords):
    """See Words. What was read last is kept, as heads follow one another."""

    file: Ranges
    begin: int  # the first byte of ``data`` in the file

    def __init__(self, file: Ranges, order: str, at: int = 0) -> None:
        super().__init__(b"", order, at)
        self.file, self.begin, self.end = file, 0, file.size

    def values(self, addresses: Addresses, kind: str, finite: bool = True) -> NDArray[Any]:
        """See Words: of places alone."""
        assert isinstance(addresses, Places)
        parts = [self._part(each, kind, finite) for each in addresses.lattices if len(each)]
        return parts[0] if len(parts) == 1 else np.concatenate([np.empty(0, dtype=np.int64), *parts])

    def _part(self, lattice: Lattice, kind: str, finite: bool) -> NDArray[Any]:
        first = lattice.start + min(lattice.columns)
        last = lattice.start + (lattice.rows - 1) * lattice.stride + max(lattice.columns) + self.size(kind)
        if not self.begin <= first or last > self.begin + len(self.data):
            self.begin = first
            self.data = bytes(self.file.read(first, min(max(last - first, AT_ONCE), self.end - first)))
        return super().values(Places(replace(lattice, start=lattice.start - self.begin)), kind, finite)


def rows_of(lattice: Lattice, dtype: str) -> Rows:
    """Rows of numbers that follow each other."""
    return Rows(lattice.start + lattice.columns[0], lattice.rows, lattice.stride, dtype, len(lattice.columns))
