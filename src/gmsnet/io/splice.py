"""Writes new coordinates into the old file: every byte that is not a coordinate of a moved node stays as it was.

A reader tells where the coordinates stand (slots); this module alone replaces them, piece by piece. A node may stand in
several places (each triangle of an STL file repeats its corners), hence ``node``, the node of each row of slots; where
it is None, row k is node k.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.contents import Data
from gmsnet.io.pieces import Piece
from gmsnet.io.places import Lattice, Places
from gmsnet.io.text import Starts, Text
from gmsnet.kernels.text import text as kernels
from gmsnet.mesh.rounding import Rounding

_PIECE = 1 << 20  # bytes that are written at once
ROWS = 1 << 15  # of slots that are looked at together

Points = NDArray[np.float64]


class Slots(Protocol):
    """Where the coordinates of a file stand."""

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """The file with each coordinate of ``new`` (N×dim) that differs in value from ``old`` written in its slot."""
        ...


@dataclass(frozen=True)
class TextSlots:
    """Decimal numbers in a text. starts, ends: (rows × dim) byte span of each; node: (rows,) the node of each row.
    keep: what the text may hold of points (n × dim) and their nodes, where that is not all (see Rounding).
    """

    starts: Starts
    ends: Starts
    node: NDArray[np.int64] | None = None
    keep: Callable[[Points, NDArray[np.int64]], Points] | None = None

    def replace(self, data: Data, old: Points, new: Points) -> Iterator[Piece]:
        """See Slots. Numbers are written as the shortest decimal that reads back as the same float64."""
        raw, out, at = Text(data).raw, np.empty(_PIECE, dtype=np.uint8), 0
        for starts, ends, values in self._moved(old, new):
            done = 0
            while done < len(starts):
                if starts[done] - at > _PIECE // 2:
                    yield memoryview(data)[at : starts[done]]
                    at = int(starts[done])
                count, at, length = kernels.replace_floats(raw, at, starts[done:], ends[done:], values[done:], out)
                yield out.data[:length]
                done += count
        yield memoryview(data)[at:]

    def _moved(self, old: Points, new: Points) -> Iterator[tuple[Starts, Starts, Points]]:
        """Starts, ends and new values of the slots that change, in the order of the file."""
        flat = self.starts.reshape(-1)
        ascending = bool((flat[1:] > flat[:-1]).all())
        rows, dim = self.starts.shape
        step = ROWS if ascending else max(1, rows)
        differ = old != new
        for k in range(0, rows, step):
            some = slice(k, k + step)
            node = some if self.node is None else self.node[some]
            moved = differ[node, :dim]
            points = new[node, :dim]
            if self.keep is not None:
                points = self.keep(points, np.arange(len(new))[node])
            starts, ends, values = self.starts[some][moved], self.ends[some][moved], points[moved]
            order = slice(None) if ascending else np.argsort(starts)
            yield starts[order], ends[order], values[order]


def most_rounded(rounding: Rounding, old: Points, new: Points) -> float:
    """By how much the file that has the old points (N×dim) keeps one of the new ones differently, at most."""
    most = 0.0
    for k in range(0, len(new), ROWS):
        some = slice(k, k + ROWS)
        rounded = rounding.keep(new[some], np.arange(k, min(k + ROWS, len(new))))
        most = max(most, float(np.abs(rounded - new[some])[old[some] != new[some]].max(initial=0.0)))
    return most


@dataclass(frozen=True)
class BinarySlots:
    """Binary floats. places: of all coordinates, as many a row as points have; dtype: '<f4', '>f8', …; node: (rows,)
    see TextSlots.
    """

    places: Places
    dtype: str
    node: NDArray[np.int64] | None = None

    def replace(self, data: Data, old: Points, new: Points) -> Iterator[Piece]:
        """See Slots."""
        at, row, size, differ = 0, 0, np.dtype(self.dtype).itemsize, old != new
        for lattice in self.places.lattices:
            width = len(lattice.columns) // new.shape[1]  # rows of slots in one of the lattice
            for k in range(0, lattice.rows, ROWS):
                count = min(ROWS, lattice.rows - k)
                some = slice(row, row + count * width)
                row += count * width
                node = some if self.node is None else self.node[some]
                values = new[node].reshape(count, -1)
                moved = differ[node].reshape(count, -1)
                start = lattice.start + k * lattice.stride + min(lattice.columns)
                end = start + (count - 1) * lattice.stride + max(lattice.columns) - min(lattice.columns) + size
                yield memoryview(data)[at:start]
                block = bytearray(memoryview(data)[start:end])
                here = Lattice(-min(lattice.columns), count, lattice.stride)
                for j, column in enumerate(lattice.columns):
                    here.column(block, column, self.dtype)[moved[:, j]] = values[moved[:, j], j]
                yield memoryview(block)
                at = end
        yield memoryview(data)[at:]


@dataclass(frozen=True)
class Untouched:
    """No coordinates: they stand in the other files of the mesh."""

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """See Slots: the file as it is."""
        return [memoryview(data)]


@dataclass(frozen=True)
class Share:
    """The part of a mesh that one of several files holds. slots: in that file; node: the node of each of its points."""

    slots: Slots
    node: NDArray[np.int64]

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """See Slots. old, new: of all nodes of the mesh."""
        return self.slots.replace(data, old[self.node], new[self.node])


@dataclass(frozen=True)
class EncodedSlots:
    """Coordinates inside an encoded block (base64, compressed), which a function of the format writes again."""

    rewrite: Callable[[Data, Points, Points], Iterable[Piece]]

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """See Slots."""
        return self.rewrite(data, old, new)
