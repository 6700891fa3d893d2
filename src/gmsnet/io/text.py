"""Numbers in text files: where the tokens stand, what they are worth, and which line is to blame.

Every position is a byte offset into the file, so that new coordinates can be put in the place of the old ones.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.kernels import text as kernels

Spans = NDArray[np.int64]  # (n, 2): first byte and byte behind the last of each token

_ALL_BLANK = bytes(c if c in b"\r\n" else 32 for c in range(256))
_WIDE = 64  # longer numbers are converted one by one: one token of a megabyte must not widen all the others


@dataclass(frozen=True)
class Rows:
    """Lines of a text that hold tokens.

    spans: (tokens, 2). first: (rows + 1,), row k has the tokens first[k] to first[k + 1] - 1. end: the byte behind the
    last token.
    """

    spans: Spans
    first: NDArray[np.int64]
    end: int

    def __len__(self) -> int:
        return len(self.first) - 1

    @property
    def lengths(self) -> NDArray[np.int64]:
        """(rows,) how many tokens each row has."""
        return np.diff(self.first)

    def row(self, k: int) -> Spans:
        """The spans of the tokens of row k."""
        return self.spans[self.first[k] : self.first[k + 1]]

    def column(self, j: int) -> Spans:
        """(rows, 2) the j-th token of each row; every row must have that many."""
        return self.spans[self.first[:-1] + j]

    def where(self, k: int) -> int:
        """The byte at which row k begins (to name its line)."""
        return int(self.spans[self.first[k], 0])


def scan(data: bytes, start: int, count: int, stop: int | None = None) -> Spans:
    """The spans (count, 2) of the next ``count`` tokens from byte ``start``, which white space of any kind separates.

    Raises FormatError where the text ends (or reaches ``stop``) before.
    """
    stop = len(data) if stop is None else stop
    if count < 0:
        fail(data, start, f"a count is negative: {count}")
    room = max(0, (stop - start + 1) // 2)  # no more tokens than that can follow: a false count asks for no memory
    spans = np.empty((min(count, room), 2), dtype=np.int64)
    found = int(kernels.find_tokens(_bytes(data), start, stop, spans))
    if found < count:
        place = "the file ends: is it cut off?" if stop == len(data) else "the section ends"
        fail(data, stop, f"expected {count - found} more numbers, {place}")
    return spans


def scan_rows(data: bytes, start: int, count: int | None = None, stop: int | None = None) -> Rows:
    """The next ``count`` lines that are not empty (None: all up to ``stop``), each with its tokens.

    ``start`` counts as the beginning of a line. Raises FormatError where there are fewer lines.
    """
    stop = len(data) if stop is None else stop
    if count is not None and count < 0:
        fail(data, start, f"a count is negative: {count}")
    raw, none = _bytes(data), np.empty((0, 2), dtype=np.int64)
    limit = len(data) if count is None else min(count, len(data))
    rows, tokens, end = map(int, kernels.find_rows(raw, start, stop, limit, none, none[:, 0]))
    if count is not None and rows < count:
        place = "the file ends: is it cut off?" if stop == len(data) else "the section ends"
        fail(data, stop, f"expected {count - rows} more lines, {place}")
    spans, first = np.empty((tokens, 2), dtype=np.int64), np.full(rows + 1, tokens, dtype=np.int64)
    kernels.find_rows(raw, start, stop, limit, spans, first[:rows])
    return Rows(spans, first, end)


def to_floats(data: bytes, spans: Spans) -> NDArray[np.float64]:
    """The numbers of tokens (any leading shape, last axis the span), correctly rounded to float64.

    An exponent may be written with E or, as Fortran does, with D. Raises FormatError naming the line where a token is
    not a plain decimal number (nan, inf, 1_0, 0x1) or too large for float64.
    """
    shape, spans = spans.shape[:-1], np.ascontiguousarray(spans.reshape(-1, 2))
    values, state = np.empty(len(spans)), np.empty(len(spans), dtype=np.uint8)
    kernels.parse_floats(_bytes(data), spans, kernels.POWERS, values, state)
    bad = np.flatnonzero(state == kernels.BAD)
    if bad.size:
        found = word(data, spans[bad[0]])
        fail(data, int(spans[bad[0], 0]), f"a number was expected, found {found}: write a finite decimal number there")
    slow = np.flatnonzero(state == kernels.LONG)
    wide = (spans[slow, 1] - spans[slow, 0]) > _WIDE
    for k in slow[wide].tolist():
        values[k] = float(data[spans[k, 0] : spans[k, 1]].replace(b"D", b"e").replace(b"d", b"e"))
    slow = slow[~wide]
    if slow.size:
        text = gather(data, spans[slow])
        letters = text.view(np.uint8)
        letters[(letters == ord("d")) | (letters == ord("D"))] = ord("e")
        values[slow] = text.astype(np.float64)
    huge = np.flatnonzero(~np.isfinite(values))
    if huge.size:
        fail(data, int(spans[huge[0], 0]), f"the number {word(data, spans[huge[0]])} is too large for a float64")
    return values.reshape(shape)


def to_ints(data: bytes, spans: Spans) -> NDArray[np.int64]:
    """The integers of tokens (any leading shape, last axis the span).

    Raises FormatError naming the line where a token is not a plain decimal integer of at most 18 digits.
    """
    shape, spans = spans.shape[:-1], np.ascontiguousarray(spans.reshape(-1, 2))
    values = np.empty(len(spans), dtype=np.int64)
    bad = int(kernels.parse_ints(_bytes(data), spans, values))
    if bad >= 0:
        fail(data, int(spans[bad, 0]), f"an integer was expected, found {word(data, spans[bad])}")
    return values.reshape(shape)


def to_count(data: bytes, span: Spans, what: str) -> int:
    """The one token of span (2,) as a count, which is not negative. ``what`` names it in the message of FormatError."""
    value = int(to_ints(data, span))
    if value < 0:
        fail(data, int(span[0]), f"the number of {what} is negative: {value}")
    return value


def gather(data: bytes, spans: Spans) -> NDArray[np.bytes_]:
    """Tokens (n, 2) as an array of bytes strings of one width, that of the longest."""
    width = max(1, int((spans[:, 1] - spans[:, 0]).max(initial=1)))
    out = np.zeros((len(spans), width), dtype=np.uint8)
    kernels.gather_tokens(_bytes(data), np.ascontiguousarray(spans), out)
    return out.view(f"S{width}").reshape(-1)


def before_slash(data: bytes, spans: Spans) -> Spans:
    """The part of each token before its first slash (``12/3/4`` → ``12``).

    Raises FormatError naming the line where something but numbers and slashes follows.
    """
    cut = np.array(spans, order="C")
    bad = int(kernels.cut_at_slash(_bytes(data), cut))
    if bad >= 0:
        fail(data, int(spans[bad, 0]), f"numbers separated by slashes were expected, found {word(data, spans[bad])}")
    return cut


def token(data: bytes, span: Spans) -> bytes:
    """The bytes of one token (2,)."""
    return data[int(span[0]) : int(span[1])]


def word(data: bytes, span: Spans) -> str:
    """One token (2,) in quotes for a message: printable and short, whatever bytes it has."""
    found = token(data, span)
    text = found[:24].decode("ascii", "backslashreplace")
    return repr(text + "…" * (len(found) > 24)).replace("\\\\", "\\")


def line_of(data: bytes, offset: int) -> int:
    """The line (counted from 1) in which a byte stands; LF, CR LF and lone CR end a line."""
    if b"\r" not in data:
        return data.count(b"\n", 0, offset) + 1
    return 1 + len(re.findall(rb"\r\n?|\n", data[:offset]))


def fail(data: bytes, offset: int, message: str) -> NoReturn:
    """Raises FormatError with the line of ``offset`` in front (the file's name is put before it by ``io.read``)."""
    raise FormatError(f"line {line_of(data, offset)}: {message}")


def replace_numbers(data: bytes, spans: Spans, values: NDArray[np.float64]) -> bytes:
    """A copy with the shortest decimals that read back as ``values`` (n,) in the place of the tokens (n, 2)."""
    order = np.argsort(spans[:, 0], kind="stable")
    spans = np.ascontiguousarray(spans[order])
    text = " ".join(map(repr, values[order].tolist())).encode()
    words = scan(text, 0, len(values))
    out = np.empty(len(data) + int((np.diff(words) - np.diff(spans)).sum()), dtype=np.uint8)
    kernels.replace_spans(_bytes(data), spans, _bytes(text), words, out)
    return out.tobytes()


def blank(data: bytes, pattern: bytes) -> bytes:
    """A copy in which what matches the regular expression is spaces; line ends stay, and every byte keeps its place."""
    return re.sub(pattern, lambda match: match[0].translate(_ALL_BLANK), data)


def _bytes(data: bytes) -> NDArray[np.uint8]:
    return np.frombuffer(data, dtype=np.uint8)
