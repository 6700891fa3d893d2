"""The cells beside walls of the whole mesh on the first rank: few beside all others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.part import Part, lowest_of
from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL, Simplices
from gmsnet.preserve.wall_edges import Beside
from gmsnet.preserve.wall_heights import height_note
from gmsnet.topology.stars import Ints
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WallCells:
    """Of a mesh in a plane. part: of this rank; places: of its nodes that are corners of such cells.

    beside: the cells, in memory order of the whole mesh, with numbers of their nodes alone, on the first rank; None
    elsewhere. How they are wound is left out. number: the numbers of the nodes that come from the ranks, one after the
    other.
    """

    part: Part
    places: Ints
    beside: Beside | None
    number: NDArray[np.intp]

    @classmethod
    def of(cls, part: Part, topology: Topology, rows: Ints, rim: NDArray[np.uint8]) -> WallCells:
        """rows: of the simplices of the part, all with two nodes of the boundary or more. rim: as of a survey."""
        simplices, comm = topology.simplices, part.comm
        lowest = lowest_of(simplices)[rows]
        own = part.moves[lowest]  # all cells with one lowest node come from one rank, in their order
        rows, lowest = rows[own], lowest[own]
        ids = part.around.nodes.ids[topology.memory]
        found = Beside.of(simplices, rows, rim)
        places, corners = np.unique(found.simplices.rows, return_inverse=True)
        parcel = (
            part.codes[lowest], ids[lowest], corners.reshape(-1, 3),
            _shapes(found.simplices), ids[places], found.boundary[places],
        )  # fmt: skip
        came = comm.gather(parcel)
        if came is None:
            return cls(part, places, None, np.empty(0, dtype=np.intp))
        codes, first, cells, shapes, nodes, boundary = zip(*came, strict=True)
        _, number = np.unique(np.concatenate(nodes), return_inverse=True)
        begin = np.cumsum([0, *map(len, nodes)])
        order = np.lexsort((np.concatenate(first), np.concatenate(codes)))  # stable
        numbered = [number[start:][each] for start, each in zip(begin, cells, strict=False)]
        on_boundary = np.zeros(int(number.max(initial=-1)) + 1, dtype=bool)
        on_boundary[number] = np.concatenate(boundary)
        rows, forth = np.concatenate(numbered)[order].astype(np.int32), np.ones(len(order), dtype=np.int8)
        whole = Simplices(rows, forth, np.concatenate(shapes)[order])
        return cls(part, places, Beside(whole, on_boundary), number)

    def at(self, points: Floats) -> Floats | None:
        """Points of the part, in memory order, by the numbers of ``beside``; None elsewhere than on the first rank."""
        came = self.part.comm.gather(points[self.places, :2])
        if came is None or self.beside is None:
            return None
        found = np.empty((len(self.beside.boundary), 2))
        found[self.number] = np.concatenate(came)
        return found

    def note(self, before: Floats, now: Floats) -> list[str]:
        """See ``height_note``. before, now: points of the part, in memory order."""
        then, last = self.at(before), self.at(now)
        found = None
        if self.beside is not None and then is not None and last is not None:
            found = height_note(self.beside, then, last)
        notes: list[str] = self.part.comm.bcast(found)
        return notes


def _shapes(simplices: Simplices) -> NDArray[np.uint8]:
    """As of Simplices, where other ranks may have other cells."""
    return np.full(len(simplices.rows), EQUILATERAL, dtype=np.uint8) if simplices.shapes is None else simplices.shapes
