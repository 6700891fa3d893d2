"""Where the coordinates of Nastran's GRID cards stand, and how new ones are put into their fields."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.io import splice
from gmsnet.io.contents import Data
from gmsnet.io.nastran_decimals import texts
from gmsnet.io.nastran_lines import LARGE, WIDTH, Bulk, Cards, Ints
from gmsnet.io.nastran_numbers import fitted
from gmsnet.io.pieces import Piece
from gmsnet.io.splice import Points

AXES = 3


@dataclass(frozen=True)
class FieldSlots:
    """Fields of text. starts, ends: (N × dim) the bytes of each. widths: (N,) how many columns there are. free: (N,)
    between commas.
    """

    starts: Ints
    ends: Ints
    widths: NDArray[np.int64]
    free: NDArray[np.bool_]

    def replace(self, data: Data, old: Points, new: Points) -> Iterator[Piece]:
        """See Slots."""
        flat = self.starts.reshape(-1)
        step = splice.ROWS if bool((flat[1:] > flat[:-1]).all()) else max(1, len(new))
        view, at = memoryview(data), 0
        for first in range(0, len(new), step):
            some = slice(first, first + step)
            node, axis = np.nonzero(old[some] != new[some])
            order = np.argsort(self.starts[some][node, axis], kind="stable")
            node, axis = first + node[order], axis[order]
            values, widths, pieces = new[node, axis], self.widths[node], list[Piece]()
            rows = zip(self.starts[node, axis].tolist(), self.ends[node, axis].tolist(), texts(values, widths),
                       values.tolist(), widths.tolist(), self.free[node].tolist(), strict=True)  # fmt: skip
            for start, end, text, value, width, free in rows:
                number = (fitted(value, width) if text is None else text).encode()
                pieces += [view[at:start], self._field(view[start:end].tobytes(), number, width, free)]
                at = end
            yield b"".join(pieces)
        yield view[at:]

    @staticmethod
    def _field(old: bytes, text: bytes, width: int, free: bool) -> bytes:
        """A field with another number in it, at the side where the old one was."""
        if free:
            word = old.strip()
            return old.replace(word, text) if word else text
        if len(old) < width:  # at the end of a line, which may become longer
            return text.rjust(len(old)) if old[:1] == b" " and old.strip() else text
        return text.rjust(width) if old[:1] == b" " and old[-1:] != b" " else text.ljust(width)


def places_of_grids(bulk: Bulk, grids: list[Cards]) -> FieldSlots:
    """The slots of all GRID cards, in their order here."""
    starts, ends, widths, free = [], [], [], []
    for cards in grids:
        spans = [bulk.field(cards, 3 + axis) for axis in range(AXES)]
        starts.append(np.stack([start for start, _ in spans], axis=1))
        ends.append(np.stack([end for _, end in spans], axis=1))
        usual = LARGE if cards.large else WIDTH
        if cards.free:  # where longer numbers stand there is room for them
            words = [len(bytes(bulk.data[a:b]).strip()) for a, b in zip(starts[-1].ravel().tolist(),
                     ends[-1].ravel().tolist(), strict=True) if a >= 0]  # fmt: skip
            usual = max(usual, *words) if words else usual
        widths.append(np.full(len(cards.line), usual))
        free.append(np.full(len(cards.line), cards.free))
    return FieldSlots(*(np.concatenate(parts) for parts in (starts, ends, widths, free)))
