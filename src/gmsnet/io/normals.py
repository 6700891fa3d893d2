"""Normals in a file, computed anew; the module of each format tells where they stand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.contents import Data
from gmsnet.io.pieces import Piece
from gmsnet.io.places import Places, pick
from gmsnet.io.splice import BinarySlots, Points, Slots, TextSlots
from gmsnet.io.text import Starts, Text
from gmsnet.io.words import ByteWords, TextWords, Words
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.normals import Ids, renewed

DIGITS = 7  # behind the point, of normals in a text


@dataclass(frozen=True)
class Normals:
    """what: in words. values: (R, 3) as the file has them. slots: where they stand. row: (C,) which of them each corner
    of the faces of the mesh has, -1 for none (see ``FaceCorners``)."""

    what: str
    values: Points
    slots: Slots
    row: Ids

    def rewritten(self, data: Data, cells: Sequence[CellBlock], old: Points, new: Points) -> bytes:
        """The file with normals computed anew. old, new: (N, 3) the points of the mesh before and now."""
        fresh = renewed(self.values, self.row, cells, old, new)
        if isinstance(self.slots, TextSlots):
            fresh = np.where(fresh == self.values, fresh, np.round(fresh, DIGITS) + 0.0)  # no -0
        return b"".join(self.slots.replace(data, self.values, fresh))


# What the module of a format may have as ``normals``: those in the files (suffix → bytes) of a mesh with these cells.
# FormatError naming the line where they are damaged.
Find = Callable[[Mapping[str, Data], Sequence[CellBlock]], list[Normals]]


def all_rewritten(
    pieces: Iterable[Piece], suffix: str, find: Find, cells: Sequence[CellBlock], old: Points, new: Points
) -> list[Piece]:
    """A file, given in pieces, with all its normals computed anew. suffix: its own. old, new: (N, 3)."""
    data = b"".join(map(bytes, pieces))
    found = find({suffix: data}, cells)
    for k in range(len(found)):
        data = found[k].rewritten(data, cells, old, new)
        if k + 1 < len(found):
            found = find({suffix: data}, cells)  # places move as numbers get longer
    return [memoryview(data)]


def in_text(what: str, text: Text, starts: Starts, row: NDArray[np.int64]) -> Normals:
    """Those whose numbers are tokens (R × 3) of a text; those that are no numbers stay as they are."""
    values = text.any_floats(starts)
    finite = np.flatnonzero(np.isfinite(values).all(axis=1))
    _, ends = text.spans(starts[finite])
    return Normals(what, values, TextSlots(starts[finite], ends, finite), row)


def in_words(what: str, words: Words, places: Places, kind: str, row: NDArray[np.int64]) -> Normals:
    """Those whose numbers, of a type, stand at places (three to each) of a file that is text or binary."""
    if isinstance(words, TextWords):
        return in_text(what, words.text, pick(words.starts, places).reshape(-1, 3), row)
    values = words.values(places, kind, finite=False).reshape(-1, 3)
    assert isinstance(words, ByteWords)
    return Normals(what, values, BinarySlots(places.in_threes(), words.order + kind), row)
