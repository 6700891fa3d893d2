"""Faces of a file that ranks share, each with the cells on its two sides: what a format tells that lists no cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.foam_cells import Faces, Ints, Sides, turned
from gmsnet.io.places import ranges
from gmsnet.io.rows import Ranges
from gmsnet.mesh.cell_block import CellBlock


class SomeFaces(NamedTuple):
    """sizes: (n,) how many nodes each has; nodes: of all, one face after another, as the file lists them. owner, other:
    (n,) its cells; other is −1 where there is but one. inward: (n,) which are listed with their normal into the owner.
    markers: (n,) of those with one cell, and of others that may have one."""

    sizes: Ints
    nodes: Ints
    owner: Ints
    other: Ints
    inward: NDArray[np.bool_]
    markers: Ints

    def take(self, rows: Ints) -> SomeFaces:
        """Some of them."""
        first = (np.cumsum(self.sizes) - self.sizes)[rows]
        nodes = self.nodes[ranges(first, self.sizes[rows])]
        owner, other, inward, markers = self.owner[rows], self.other[rows], self.inward[rows], self.markers[rows]
        return SomeFaces(self.sizes[rows], nodes, owner, other, inward, markers)

    @classmethod
    def joined(cls, parts: Sequence[SomeFaces]) -> SomeFaces:
        """All of them, one part after another."""
        return cls(*(np.concatenate(each) for each in zip(*parts, strict=True)))

    @property
    def outward(self) -> Faces:
        """Each with its normal out of its owner."""
        return Faces(self.sizes, turned(self.sizes, self.nodes, self.inward), self.owner, self.other)


class FaceLists(Protocol):
    """How the faces of a file lie. A process reads some of them, and what it reads of zones is one share of so many."""

    @property
    def count(self) -> int:
        """How many there are."""
        ...

    @property
    def periodic(self) -> Sequence[int]:
        """Markers of faces whose nodes must match others."""
        ...

    def some(self, file: Ranges, first: int, last: int) -> SomeFaces:
        """The faces from one to another. Raises FormatError where they are damaged."""
        ...

    def cells(self, faces: Faces, sides: Sides, regions: Ints, before: int) -> list[CellBlock]:
        """The cells on these sides. regions: of each. before: how many cells of the mesh come before them."""
        ...

    def regions(self, rank: int, ranks: int, count: int) -> Sequence[tuple[int, Ints]]:
        """Regions with cells of each. Of a cell that several name the last one counts. count: of all cells."""
        ...

    def held(self, rank: int, ranks: int) -> tuple[Ints, Ints]:
        """Faces and points whose nodes are to be held."""
        ...
