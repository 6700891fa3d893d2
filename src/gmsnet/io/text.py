"""Numbers in text files: where the tokens stand, what they are worth, and which line is to blame.

Every position is a byte offset into the file, so that new coordinates can be put in the place of the old ones. A token
is known by its first byte; positions are int32 as long as the file allows, because there are many of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.places import ranges
from gmsnet.kernels.text import text as kernels
from gmsnet.kernels.topology.weld import match_words

Starts = NDArray[Any]  # int32 or int64: the first byte of each token

_BLANKS, _LINE_ENDS = b" \t\v\f", b"\r\n"
_NOT_FINITE = re.compile(rb"(?i)([+-]?)(nan|inf(?:inity)?)(?:\([a-z]*\))?")
_LONG_INTEGER = re.compile(rb"[+-]?\d{19}")
MOST_NARROW = 2**31 - 1  # bytes of a file whose positions are int32
MOST_ROWS = 1 << 17  # that are looked at together: what belongs to them stays in the processor's cache


@dataclass(frozen=True)
class Rows:
    """Lines of a text that hold tokens.

    starts: (tokens,). first: (rows + 1,), row k has the tokens first[k] to first[k + 1] - 1. end: the byte behind the
    last token.
    """

    starts: Starts
    first: Starts
    end: int

    def __len__(self) -> int:
        return len(self.first) - 1

    @property
    def lengths(self) -> Starts:
        """(rows,) how many tokens each row has."""
        return np.diff(self.first)

    def row(self, k: int) -> Starts:
        """The tokens of row k."""
        return self.starts[self.first[k] : self.first[k + 1]]

    def column(self, j: int) -> Starts:
        """(rows,) the j-th token of each row; every row must have that many."""
        return self.columns(j, 1)[:, 0]

    def columns(self, j: int, count: int) -> Starts:
        """(rows, count) the tokens of each row from the j-th on; every row must have that many."""
        tokens: Starts = self.starts[self.first[:-1, None] + np.arange(j, j + count, dtype=self.first.dtype)]
        return tokens

    def inner(self, of_tokens: NDArray[Any], skip: int, counts: NDArray[Any]) -> NDArray[Any]:
        """What belongs to the ``counts[k]`` tokens of each row k that follow its first ``skip``, out of what belongs to
        each token.
        """
        if len(self) and (counts == counts[0]).all() and (self.lengths == self.lengths[0]).all():
            return of_tokens.reshape(len(self), -1)[:, skip : skip + int(counts[0])].reshape(-1)
        return of_tokens[ranges(self.first[:-1].astype(np.int64) + skip, counts.astype(np.int64))]

    def where(self, k: int) -> int:
        """The byte at which row k begins (to name its line)."""
        return int(self.starts[self.first[k]])

    def parts(self) -> Iterator[tuple[int, Rows]]:
        """The rows in turn, MOST_ROWS at a time, each time with the number of the first of them."""
        for k in range(0, len(self), MOST_ROWS):
            first = self.first[k : k + MOST_ROWS + 1]
            yield k, Rows(self.starts[first[0] : first[-1]], first - first[0], self.end)


class Text:
    """A text and its tokens, which white space separates.

    comment: the byte that begins a comment, which runs to the end of the line. stop: the text ends there. ends: bytes
    that end a token as a blank does.
    """

    data: Data
    comment: bytes
    ends: bytes
    stop: int

    def __init__(self, data: Data, comment: bytes = b"", stop: int | None = None, ends: bytes = b"") -> None:
        self.data, self.comment, self.ends = data, comment, ends
        self.stop = len(data) if stop is None else stop
        self._type = np.int32 if len(data) <= MOST_NARROW else np.int64
        self._kinds = np.full(256, kernels.WORD, dtype=np.uint8)
        for letters, kind in (
            (_BLANKS + ends, kernels.BLANK),
            (_LINE_ENDS, kernels.LINE_END),
            (comment, kernels.COMMENT),
        ):
            self._kinds[list(letters)] = kind

    @cached_property
    def raw(self) -> NDArray[np.uint8]:
        """The bytes of the whole file."""
        raw = np.frombuffer(self.data, dtype=np.uint8)
        raw.flags.writeable = False  # kernels are compiled once, for arrays that cannot be written
        return raw

    def until(self, stop: int) -> Text:
        """The text as if it ended at byte ``stop``."""
        same = copy(self)  # what is known of the bytes is shared
        same.stop = stop
        return same

    def tokens(self, at: int, count: int | None = None) -> tuple[Starts, int]:
        """The next ``count`` tokens (None: all) from byte ``at``, and the byte behind the last.

        Raises FormatError where the text ends before.
        """
        if count is not None and count < 0:
            self.fail(at, f"a count is negative: {count}")
        # No more tokens than there is room for: a false count asks for no memory.
        most = self._most(at)
        starts = self._room(most if count is None else min(count, most))
        _, found, end = kernels.find_rows(self.raw, self._kinds, at, self.stop, self.stop, starts, starts[:0])
        if count is not None and found < count:
            self.fail(self.stop, f"expected {count - found} more numbers, {self._ends()}")
        return starts[:found], end

    def rows(self, at: int, count: int | None = None) -> Rows:
        """The next ``count`` lines that are not empty (None: all), each with its tokens.

        ``at`` counts as the beginning of a line. Raises FormatError where there are fewer lines.
        """
        if count is not None and count < 0:
            self.fail(at, f"a count is negative: {count}")
        most = self._most(at)
        limit = most if count is None else min(count, most)
        starts, first = self._room(most), self._room(limit + 1)
        found, tokens, end = kernels.find_rows(self.raw, self._kinds, at, self.stop, limit, starts, first)
        if count is not None and found < count:
            self.fail(self.stop, f"expected {count - found} more lines, {self._ends()}")
        first[found] = tokens
        return Rows(starts[:tokens], first[: found + 1], end)

    def _most(self, at: int) -> int:
        return max(0, (self.stop - at + 1) // 2)

    def _room(self, count: int) -> Starts:
        """Memory that is not touched costs nothing: only as much of it is used as there are tokens."""
        return np.empty(count, dtype=self._type)

    def _ends(self) -> str:
        return "the file ends: is it cut off?" if self.stop == len(self.data) else "the section ends"

    def floats(self, starts: Starts) -> NDArray[np.float64]:
        """The numbers of tokens (any shape), correctly rounded to float64.

        An exponent may be written with E or, as Fortran does, with D. Raises FormatError naming the line where a token
        is not a plain decimal number (nan, inf, 1_0, 0x1) or too large for float64.
        """
        return self.spans(starts)[0]

    def spans(self, starts: Starts) -> tuple[NDArray[np.float64], Starts]:
        """The numbers of tokens as by ``floats``, and the byte behind each token."""
        flat = np.ascontiguousarray(starts.reshape(-1), dtype=self._type)
        values, ends, slow = np.empty(len(flat)), np.empty_like(flat), np.empty_like(flat)
        bad, left = kernels.parse_floats(self.raw, self._kinds, self.stop, flat, values.view(np.int64), ends, slow)
        if bad >= 0:
            found = self.word(flat[bad])
            self.fail(int(flat[bad]), f"a number was expected, found {found}: write a finite decimal number there")
        for k in slow[:left].tolist():
            values[k] = float(self.data[flat[k] : ends[k]].replace(b"D", b"e").replace(b"d", b"e"))
            if np.isinf(values[k]):
                self.fail(int(flat[k]), f"the number {self.word(flat[k])} is too large for a float64")
        return values.reshape(starts.shape), ends.reshape(starts.shape)

    def any_floats(self, starts: Starts) -> NDArray[np.float64]:
        """Like ``floats`` for data that are no coordinates: nan and inf are values too."""
        flat = starts.reshape(-1)
        if not len(flat):
            return np.empty(starts.shape)
        first = self.raw[flat]
        signed = (first == ord("+")) | (first == ord("-"))
        first = np.where(signed, self.raw[np.minimum(flat + 1, self.stop - 1)], first)
        special = np.isin(first, np.frombuffer(b"nNiI", dtype=np.uint8))
        values = np.empty(len(flat))
        values[~special] = self.floats(flat[~special])
        for k in np.flatnonzero(special).tolist():
            match = _NOT_FINITE.fullmatch(self.token(flat[k]))
            values[k] = float(match[1] + match[2]) if match else self.floats(flat[k])
        return values.reshape(starts.shape)

    def integers(self, starts: Starts, slash: bool = False) -> NDArray[np.int64]:
        """The integers of tokens (any shape). slash: those before the first slash of each token (``12/3/4`` → 12).

        Raises FormatError naming the line where a token is not a plain decimal integer of 64 bits, or where something
        but digits, signs and slashes follows the slash.
        """
        flat = np.ascontiguousarray(starts.reshape(-1), dtype=self._type)
        values = np.empty(len(flat), dtype=np.int64)
        at = 0
        while (bad := kernels.parse_integers(self.raw, self._kinds, self.stop, flat[at:], slash, values[at:])) >= 0:
            at += bad  # the kernel stops at more than 18 digits
            word = self.token(flat[at])
            if not _LONG_INTEGER.fullmatch(word) or not -(2**63) <= int(word) < 2**63:
                what = "numbers separated by slashes were" if b"/" in word and slash else "an integer was"
                self.fail(int(flat[at]), f"{what} expected, found {self.word(flat[at])}")
            values[at] = int(word)
            at += 1
        return values.reshape(starts.shape)

    def count(self, start: Any, what: str) -> int:
        """One token as a count, which is not negative. ``what`` names it in the message of FormatError."""
        value = int(self.integers(np.asarray(start)))
        if value < 0:
            self.fail(int(start), f"the number of {what} is negative: {value}")
        return value

    def next(self, at: int) -> tuple[int, int] | None:
        """The first byte of the next token and the byte behind it; None where there is none."""
        one = self._room(1)
        _, found, end = kernels.find_rows(self.raw, self._kinds, at, self.stop, 1, one, one[:0])
        return (int(one[0]), end) if found else None

    def token(self, start: Any) -> bytes:
        """The bytes of one token."""
        found = self.next(int(start))
        return self.data[slice(*found)] if found else b""

    def letters(self, starts: Starts, count: int) -> list[NDArray[np.uint8]]:
        """The first ``count`` bytes of tokens (n,), each as an array (n,); 0 stands where a token is shorter."""
        found: list[NDArray[np.uint8]] = []
        inside = np.ones(len(starts), dtype=bool)
        for k in range(count):
            letter = self.raw[np.minimum(starts + k, len(self.raw) - 1)]
            inside &= (starts + k < self.stop) & (self._kinds[letter] == kernels.WORD)
            found.append(np.where(inside, letter, np.uint8(0)))
        return found

    def mismatch(self, starts: Starts, pattern: Sequence[bytes]) -> int:
        """The number of the first token that is not the word of a pattern, which repeats, in capitals or not; or -1.

        pattern: words in lower case; an empty one stands for anything.
        """
        words, cuts = np.frombuffer(b"".join(pattern), dtype=np.uint8), np.cumsum([0, *map(len, pattern)])
        return int(match_words(self.raw, self._kinds, self.stop, starts, words, cuts))

    def word(self, start: Any) -> str:
        """One token in quotes for a message."""
        return quoted(self.token(start))

    def fail(self, offset: int, message: str) -> NoReturn:
        """Raises FormatError with the line of ``offset`` in front (``io.read`` puts the file's name before it)."""
        fail(self.data, offset, message)


def quoted(found: bytes) -> str:
    """A word for a message: printable and short, whatever bytes it has."""
    text = found[:24].decode("ascii", "backslashreplace")
    return repr(text + "…" * (len(found) > 24)).replace("\\\\", "\\")


def line_of(data: Data, offset: int) -> int:
    """The line (counted from 1) in which a byte stands; LF, CR LF and lone CR end a line."""
    before = data[:offset]
    return 1 + before.count(b"\n") + before.count(b"\r") - before.count(b"\r\n")


def fail(data: Data, offset: int, message: str) -> NoReturn:
    """Raises FormatError with the line of ``offset`` in front (the file's name is put before it by ``io.read``)."""
    raise FormatError(f"line {line_of(data, offset)}: {message}")
