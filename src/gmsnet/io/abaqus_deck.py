"""The lines of an Abaqus or CalculiX deck: keyword lines with their parameters, and the rows of data behind each.

A keyword line begins with one asterisk, a comment with two. A line that ends with a comma goes on in the next.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.contents import Data
from gmsnet.io.text import Rows, Starts, Text

MOST_KEYWORDS = 100_000  # each costs time
_LINE_END = re.compile(rb"\r\n?|\n")
_EMPTY_FIELD = re.compile(rb"[,\r\n][ \t]*,")
_PARAMETER = re.compile(r'\s*([^=,"]*)(?:=\s*("[^"]*"|[^,]*))?,?')
LONGEST = 4096  # characters of a keyword line


@dataclass(frozen=True)
class Section:
    """A keyword in capitals without blanks, its parameters (name in capitals → value), and where its data stand.

    at: the byte of its asterisk. begin: the end of its line. stop: where the next keyword's line begins.
    """

    name: str
    parameters: dict[str, str]
    at: int
    begin: int
    stop: int

    def get(self, name: str) -> str:
        """A parameter; nothing where it is not given."""
        return self.parameters.get(name, "")


class Deck:
    """A deck and its sections. Commas end tokens as blanks do, and lines of comments are none."""

    text: Text

    def __init__(self, data: Data) -> None:
        self.text = Text(data, comment=b"*", ends=b",")
        self.data = data

    def sections(self) -> list[Section]:
        """All keywords in their order. Raises FormatError where other lines come before the first."""
        heads = list(self._heads())
        first = self.text.until(heads[0][0] if heads else len(self.data)).rows(0)
        if len(first):
            self.text.fail(first.where(0), f"a keyword such as *NODE was expected, found {self._word(first.starts[0])}")
        stops = [*(start for start, _, _ in heads[1:]), len(self.data)][: len(heads)]
        found = []
        for (_, at, end), stop in zip(heads, stops, strict=True):
            name, _, rest = bytes(self.data[at + 1 : end]).decode("utf-8", "backslashreplace").partition(",")
            found.append(Section("".join(name.split()).upper(), _parameters(rest), at, end, stop))
        return found

    def _heads(self) -> Iterator[tuple[int, int, int]]:
        """The first byte of each keyword's line, its asterisk, and the end of the last line that it takes."""
        data, at, count = self.data, 0, 0
        while (found := data.find(b"*", at)) >= 0:
            start = 1 + max(data.rfind(b"\n", at, found), data.rfind(b"\r", at, found), at - 1)
            end = self._line_end(found)
            if not data[start:found].strip() and data[found + 1 : found + 2] != b"*":
                end = self._continued(found, end)
                count += 1
                if count > MOST_KEYWORDS:
                    self.text.fail(found, f"there are more than {MOST_KEYWORDS} keywords: this is no mesh")
                yield start, found, end
            at = end

    def _line_end(self, at: int) -> int:
        found = _LINE_END.search(self.data, at)
        return found.start() if found else len(self.data)

    def _continued(self, start: int, end: int) -> int:
        """Where a keyword's line ends together with those that it goes on in."""
        while bytes(self.data[start:end]).rstrip().endswith(b",") and end < len(self.data):
            end = self._line_end(_LINE_END.match(self.data, end).end())  # type: ignore[union-attr]
            if end - start > LONGEST:
                self.text.fail(start, f"a keyword line has more than {LONGEST} characters: this is no mesh")
        return end

    def _word(self, start: int) -> str:
        return self.text.word(start)

    def rows(self, section: Section) -> Rows:
        """The lines of data of a section."""
        return self.text.until(section.stop).rows(section.begin)

    def full_rows(self, section: Section) -> Rows:
        """The same where each field counts. Raises FormatError where one is empty, which says another number."""
        for empty in _EMPTY_FIELD.finditer(self.data, section.begin, section.stop):
            where = empty.end() - 1
            line = 1 + max(self.data.rfind(end, section.begin, where) for end in (b"\n", b"\r"))
            if bytes(self.data[line:where]).lstrip()[:2] != b"**":
                self.text.fail(where, "a field is empty here: write the number that it stands for, such as 0")
        return self.rows(section)

    def records(self, section: Section, width: int) -> Starts:
        """(records, width) the tokens of a section whose records are so wide, on one line or several.

        Raises FormatError where a record does not begin a line, or the last one is cut off.
        """
        rows = self.full_rows(section)
        total = len(rows.starts)
        begins = np.arange(0, total, width)
        if len(rows) != len(begins) or (rows.first[:-1] != begins).any():
            at = np.searchsorted(rows.first, begins)
            bad = np.flatnonzero(rows.first[at] != begins)
            if bad.size:
                k = int(begins[bad[0]])
                self.text.fail(int(rows.starts[k]), f"{section.name} takes {width} numbers a record, and here is one "
                                                    "more or less")  # fmt: skip
        if total % width:
            self.text.fail(int(rows.starts[-1]), f"a record of {section.name} has {total % width} numbers instead of "
                                                 f"{width}: is the file cut off?")  # fmt: skip
        return rows.starts.reshape(-1, width)

    def continued_records(self, section: Section) -> tuple[Starts, NDArray[np.int64]]:
        """The tokens of records of any length, and how many each has: a line that ends with a comma goes on."""
        rows = self.full_rows(section)
        ends = np.array([self._goes_on(rows, k) for k in range(len(rows))], dtype=bool)
        begins = np.concatenate([[True], ~ends[:-1]]) if len(rows) else np.empty(0, dtype=bool)
        first = rows.first[:-1][begins]
        return rows.starts, np.diff(np.append(first, len(rows.starts))).astype(np.int64)

    def _goes_on(self, rows: Rows, k: int) -> bool:
        last = int(rows.row(k)[-1])
        return bytes(self.data[last : self._line_end(last)]).rstrip().endswith(b",")


def _parameters(text: str) -> dict[str, str]:
    """``TYPE=C3D4, ELSET=a`` as {"TYPE": "C3D4", "ELSET": "a"}; a value may be quoted."""
    found: dict[str, str] = {}
    for key, value in _PARAMETER.findall(" ".join(text.split("\n"))):
        if name := "".join(key.split()).upper():
            found[name] = value.strip().strip('"')
    return found
