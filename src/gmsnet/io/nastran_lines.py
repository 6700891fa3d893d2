"""The lines of Nastran's bulk data as cards with fields: of 8 columns, of 16 (``GRID*``), or between commas.

A card goes on in lines that begin with a blank, ``+`` or ``*`` (or a comma). Each line has 8 fields of data, of 16
columns 4. What stands behind ``$`` is a comment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.text import fail

Ints = NDArray[np.int64]
_BEGIN = re.compile(rb"(?i)(?:\A|(?<=[\r\n]))[ \t]*BEGIN[ \t]+(?:BULK|SUPER|AUXMODEL)[^\r\n]*")
_END = re.compile(rb"(?i)(?:\A|(?<=[\r\n]))[ \t]*ENDDATA")
_CONTROL = re.compile(rb"(?i)(?:\A|(?<=[\r\n]))[ \t]*(?:CEND|SOL[ \t])")
_CONTINUED = np.isin(np.arange(256), list(b" +*,\t"))
MOST_NAMES = 10_000  # each costs time
NAME, WIDTH, LARGE = 8, 8, 16  # columns of the name, of a field, of a large one


@dataclass(frozen=True)
class Cards:
    """Cards of one name and one form. line: (n,) the first line of each; count: (n,) how many lines it has.

    large: the fields have 16 columns. free: they are between commas.
    """

    name: str
    line: Ints
    count: Ints
    large: bool
    free: bool

    @property
    def per_line(self) -> int:
        """How many fields of data a line has."""
        return 4 if self.large else 8

    def some(self, chosen: NDArray[np.bool_]) -> Cards:
        """Some of the cards."""
        return Cards(self.name, self.line[chosen], self.count[chosen], self.large, self.free)


class Bulk:
    """The bulk data of a file. starts, ends: (lines,) of those that are neither empty nor comments."""

    raw: NDArray[np.uint8]
    starts: Ints
    ends: Ints
    odd_cards: set[int]

    def __init__(self, data: Data) -> None:
        self.data = data
        self.raw = np.frombuffer(data, dtype=np.uint8)
        low, high = self._part()
        breaks = low + np.flatnonzero((self.raw[low:high] == 10) | (self.raw[low:high] == 13))
        starts, ends = np.append(low, breaks + 1), np.append(breaks, high)
        dollars = low + np.flatnonzero(self.raw[low:high] == ord("$"))
        np.minimum.at(ends, np.searchsorted(starts, dollars, side="right") - 1, dollars)
        filled = ends > starts
        starts, ends = starts[filled], ends[filled]
        some = np.zeros(len(self.raw) + 1, dtype=bool)
        some[:-1] = self.raw > ord(" ")
        told = np.add.reduceat(some, np.stack([starts, ends], axis=1).ravel())[::2] > 0 if len(starts) else filled[:0]
        self.starts, self.ends = starts[told], ends[told]

    def _part(self) -> tuple[int, int]:
        """Where the bulk data begin and end. Raises FormatError where they are cut off or several."""
        begins = list(_BEGIN.finditer(self.data))
        if len(begins) > 1:
            fail(self.data, begins[1].start(), "a second BEGIN BULK: superelements are not read: give each its file")
        low = begins[0].end() if begins else 0
        end = _END.search(self.data, low)
        if begins and not end:
            raise FormatError("ENDDATA is missing behind BEGIN BULK: the file is cut off")
        if not begins and (control := _CONTROL.search(self.data)):
            fail(self.data, control.start(), "case control without BEGIN BULK behind it: the file is cut off")
        return low, end.start() if end else len(self.data)

    @cached_property
    def commas(self) -> Ints:
        """The bytes of all commas."""
        return np.flatnonzero(self.raw == ord(","))

    @cached_property
    def first_comma(self) -> Ints:
        """(lines,) the index of the first comma that is not before a line."""
        return np.searchsorted(self.commas, self.starts)

    @cached_property
    def comma_count(self) -> Ints:
        """(lines,) how many commas each has."""
        return np.searchsorted(self.commas, self.ends) - self.first_comma

    def cards(self) -> Iterator[Cards]:
        """All cards, those of one name and form together. Raises FormatError where lines of a card differ in form."""
        if not len(self.starts):
            return
        continued = _CONTINUED[self.raw[self.starts]]
        if continued[0]:
            self.fail_at_line(0, "the first line of the bulk data continues no card")
        first = np.flatnonzero(~continued)
        count = np.diff(np.append(first, len(self.starts)))
        names, starred = self._names(first)
        free = self.comma_count > 0
        large = self.raw[self.starts] == ord("*")
        large[first] = starred
        owner = np.repeat(np.arange(len(first)), count)
        key = np.unique(names, return_inverse=True)[1] * 4 + 2 * large[first] + free[first]
        known, group = np.unique(key, return_inverse=True)
        if len(known) > MOST_NAMES:
            raise FormatError(f"there are cards of more than {MOST_NAMES} names: these are no bulk data")
        order = np.argsort(group, kind="stable")
        cuts = np.searchsorted(group[order], np.arange(len(known) + 1))
        odd = (large != large[first][owner]) | (free != free[first][owner])
        self.odd_cards = {int(first[k]) for k in np.unique(owner[odd]).tolist()}
        for k in range(len(known)):
            some = order[cuts[k] : cuts[k + 1]]
            name = names[some[0]].decode("ascii", "backslashreplace")
            yield Cards(name, first[some], count[some], bool(known[k] & 2), bool(known[k] & 1))

    def _names(self, lines: Ints) -> tuple[NDArray[np.bytes_], NDArray[np.bool_]]:
        """The names of cards in capitals, and whether an asterisk follows."""
        table = self.table(self.starts[lines], np.minimum(self.starts[lines] + NAME, self.ends[lines]))
        table[np.cumsum(table == ord(","), axis=1) > 0] = 0
        starred = (table == ord("*")).any(axis=1)
        table[np.cumsum(table <= ord(" "), axis=1) > 0] = 0
        table[table == ord("*")] = 0
        lower = (table >= ord("a")) & (table <= ord("z"))
        table[lower] -= 32
        return table.view(f"S{NAME}").ravel(), starred

    def table(self, starts: Ints, ends: Ints, width: int = NAME) -> NDArray[np.uint8]:
        """(n, width) the bytes of spans, filled up with blanks."""
        at = starts[:, None] + np.arange(width)
        return np.where(at < ends[:, None], self.raw[np.minimum(at, len(self.raw) - 1)], np.uint8(ord(" ")))

    def check(self, cards: Cards) -> None:
        """Raises FormatError where cards cannot be taken apart: tabs, two forms, continuations in another order."""
        lines = np.concatenate([cards.line[cards.count > k] + k for k in range(int(cards.count.max(initial=0)))]
                               or [cards.line])  # fmt: skip
        for line in self.odd_cards.intersection(cards.line.tolist()):
            self.fail_at_line(line, f"{cards.name} has lines of several forms: write all with fields of one width")
        tabs = np.flatnonzero(self.raw == ord("\t"))
        if len(tabs) and len(bad := np.flatnonzero(np.searchsorted(tabs, self.ends[lines])
                                                   > np.searchsorted(tabs, self.starts[lines]))):  # fmt: skip
            self.fail_at_line(int(lines[bad[0]]), f"{cards.name} has a tab: columns are counted, so write blanks")
        if not cards.free:
            self._check_order(cards)

    def _check_order(self, cards: Cards) -> None:
        column = NAME + 64
        for k in range(int(cards.count.max(initial=1)) - 1):
            line = cards.line[cards.count > k + 1] + k
            start = self.starts[line] + column
            here = self.table(start + 1, np.minimum(start + NAME, self.ends[line]), NAME - 1)
            there = self.starts[line + 1]
            following = self.table(there + 1, np.minimum(there + NAME, self.ends[line + 1]), NAME - 1)
            named = (here > ord(" ")).any(axis=1) & (following > ord(" ")).any(axis=1)
            if len(bad := np.flatnonzero(named & (here != following).any(axis=1))):
                self.fail_at_line(int(line[bad[0]]) + 1, "this line continues another card than the one before it: "
                                                         "put them in order")  # fmt: skip

    def field(self, cards: Cards, number: int) -> tuple[Ints, Ints]:
        """(n,) where field ``number`` (counted from 1, without the name) begins and ends; before its line's end.

        −1 stands for both where the line, or the card, ends before.
        """
        k, j = divmod(number - 1, cards.per_line)
        there = cards.count > k
        line = np.where(there, cards.line + k, cards.line)
        if cards.free:
            there &= self.comma_count[line] > j
            comma = np.where(there, self.first_comma[line] + j, 0)
            begin = self.commas[comma] + 1
            following = np.where(self.comma_count[line] > j + 1, comma + 1, comma)
            end = np.where(following > comma, self.commas[following], self.ends[line])
        else:
            width = LARGE if cards.large else WIDTH
            begin = self.starts[line] + NAME + j * width
            end = np.minimum(begin + width, self.ends[line])
            there &= begin < end
        return np.where(there, begin, -1), np.where(there, end, -1)

    def fail_at_line(self, line: int, message: str) -> None:
        """Raises FormatError with the line of the file in front."""
        fail(self.data, int(self.starts[line]), message)
