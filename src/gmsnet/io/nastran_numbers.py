"""Numbers in Nastran's fields: whole ones, reals such as ``1.5-3``, and how a real is written into so many columns."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.fields import LARGEST
from gmsnet.io.nastran_decimals import rounded
from gmsnet.io.nastran_lines import Bulk, Ints
from gmsnet.io.text import fail, quoted
from gmsnet.mesh.rounding import Rounding

Floats = NDArray[np.float64]
_AT_ONCE = 1 << 17  # fields
LONGEST = 32  # characters of a field between commas
_DIGITS, _SIGNS = np.frombuffer(b"0123456789", dtype=np.uint8), np.frombuffer(b"+-", dtype=np.uint8)
_WHOLE, _REAL = (np.isin(np.arange(256), list(letters)) for letters in (b"0123456789+- ", b"0123456789+-.eEdD "))


def whole(bulk: Bulk, starts: Ints, ends: Ints, what: str, blank: int | None = None) -> Ints:
    """(n,) the whole numbers in fields; ``blank`` for those that are empty or are not there (start −1).

    Raises FormatError, saying ``what`` was expected, for other contents.
    """
    out = np.empty(len(starts), dtype=np.int64)
    for k in range(0, len(starts), _AT_ONCE):
        some = slice(k, k + _AT_ONCE)
        table, empty = _table(bulk, starts[some], ends[some])
        if blank is None and empty.any():
            _refuse(bulk, starts[some], ends[some], int(np.argmax(empty)), what)
        table[empty] = ord(" ")
        table[empty, 0] = ord("0")
        out[some] = _numbers(bulk, table, starts[some], ends[some], _WHOLE, "i8", what)
        out[some][empty] = 0 if blank is None else blank
    return out


def reals(bulk: Bulk, starts: Ints, ends: Ints) -> Floats:
    """(n,) the reals in fields, 0 for empty ones. Raises FormatError for what is no finite number."""
    out = np.empty(len(starts))
    for k in range(0, len(starts), _AT_ONCE):
        some = slice(k, k + _AT_ONCE)
        table, empty = _table(bulk, starts[some], ends[some])
        table[empty, 0] = ord("0")
        values = _numbers(bulk, _with_exponents(table), starts[some], ends[some], _REAL, "f8", "a real number")
        if not np.isfinite(values).all():
            _refuse(bulk, starts[some], ends[some], int(np.argmin(np.isfinite(values))), "a finite number")
        out[some] = values
    return out


def lenient(bulk: Bulk, starts: Ints, ends: Ints) -> Ints:
    """(n,) the whole numbers in fields, −1 for all else."""
    table, _ = _table(bulk, starts, ends)
    found = np.full(len(starts), -1, dtype=np.int64)
    filled = np.isin(table, _DIGITS)
    runs = (np.diff(filled.astype(np.int8), axis=1, prepend=0) == 1).sum(axis=1)  # of digits
    good = (filled | (table == ord(" "))).all(axis=1) & (runs == 1) & (filled.sum(axis=1) < 19)
    found[good] = table[good].view(f"S{table.shape[1]}").ravel().astype(np.int64)
    return found


def _table(bulk: Bulk, starts: Ints, ends: Ints) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """(n, width) the bytes of fields, and which of them are empty."""
    width = int((ends - starts).max(initial=1))
    if width > LONGEST:
        bad = int(np.argmax(ends - starts))
        fail(bulk.data, int(starts[bad]), f"a field has {width} characters: there can be {LONGEST} at most")
    table = bulk.table(starts, ends, width)
    return np.ascontiguousarray(table), (table == ord(" ")).all(axis=1)


def _numbers(
    bulk: Bulk, table: NDArray[np.uint8], starts: Ints, ends: Ints, letters: NDArray[np.bool_], dtype: str, what: str
) -> NDArray[np.generic]:
    odd: NDArray[np.bool_] = np.logical_or.reduce(~letters[table], axis=1)
    words = table.view(f"S{table.shape[1]}").ravel()
    if not odd.any():
        try:
            with np.errstate(over="ignore"):
                return words.astype(dtype)
        except (ValueError, OverflowError):
            pass
    for k, word in enumerate(words.tolist()):  # which of them it is
        try:
            np.array([word]).astype(dtype)
        except (ValueError, OverflowError):
            odd[k] = True
        if odd[k]:
            break
    _refuse(bulk, starts, ends, int(np.argmax(odd)), what)
    return words  # not reached


def _refuse(bulk: Bulk, starts: Ints, ends: Ints, k: int, what: str) -> None:
    start, end = int(starts[k]), int(ends[k])
    if start < 0:
        line = int(np.searchsorted(bulk.starts, max(int(starts.max()), 0)))
        fail(bulk.data, int(bulk.starts[min(line, len(bulk.starts) - 1)]), f"a card ends before a field with {what}")
    fail(bulk.data, start, f"{what} was expected in this field, found {quoted(bytes(bulk.data[start:end]).strip())}")


def _with_exponents(table: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Reals as others write them: an E before the sign of an exponent that has none, and instead of D."""
    table[(table == ord("d")) | (table == ord("D"))] = ord("E")
    before = np.isin(table[:, :-1], _DIGITS) | (table[:, :-1] == ord("."))
    bare = before & np.isin(table[:, 1:], _SIGNS)
    out = np.full((len(table), table.shape[1] + 1), ord(" "), dtype=np.uint8)
    out[:, :-1] = table
    if bare.shape[1] == 0:
        return out
    column, there = 1 + np.argmax(bare, axis=1), bare.any(axis=1)
    for j in np.unique(column[there]).tolist():
        rows = np.flatnonzero(there & (column == j))
        out[rows, j + 1 :] = table[rows, j:]
        out[rows, j] = ord("E")
    return out


def fitted(value: float, width: int) -> str:
    """A real in so many columns, at least 8, as near to its value as they allow; with a point, as Nastran wants it."""
    if value == 0.0 or not abs(value) <= LARGEST:
        value = min(max(value, -LARGEST), LARGEST)
        if value == 0.0:
            return "-0." if np.signbit(value) else "0."
    plain = _plain(value, width)
    if plain is not None and 0.01 <= abs(value) < 10.0 ** (width - 3):  # an exponent would cost digits
        return plain
    short = _scientific(value, width)
    return min([short] if plain is None else [plain, short], key=lambda text: (abs(worth(text) - value), len(text)))


def worth(text: str) -> float:
    """The value of a real as ``fitted`` writes it."""
    mantissa, sign, exponent = text[:1], "", ""
    for k, letter in enumerate(text[1:], 1):
        if letter in "+-":
            sign, exponent = letter, text[k + 1 :]
            break
        mantissa += letter
    return float(f"{mantissa}e{sign}{exponent}" if sign else mantissa)


def _plain(value: float, width: int) -> str | None:
    """With a point and no exponent; None where there is no room."""
    size = abs(value)
    if size >= 10.0**width:
        return None
    most = width - (value < 0.0) - 1 - (len(str(int(size))) if size >= 1.0 else 0)  # one less where all nines round up
    for places in range(max(most, 0), -1, -1):
        text = _trimmed(f"{value:.{places}f}") if places else f"{value:.0f}."
        if len(text) <= width:
            return text if worth(text) != 0.0 else None
    return None


def _trimmed(text: str) -> str:
    """Without zeros that say nothing."""
    text = text.rstrip("0")
    sign, digits = text[: text.startswith("-")], text.lstrip("-")
    return sign + (digits[1:] if digits.startswith("0.") and len(digits) > 2 else digits)


def _scientific(value: float, width: int) -> str:
    """With an exponent, rounded towards 0 where the nearest number of so few digits is too large for a float64."""
    for places in range(16, -1, -1):
        mantissa, exponent = f"{value:.{places}e}".split("e")
        mantissa = mantissa.rstrip("0") if places else f"{mantissa}."
        text = f"{mantissa}{int(exponent):+d}"
        if len(text) <= width and math.isfinite(worth(text)):
            return text
    return f"{'-' * (value < 0.0)}1.+308"


def kept(widths: NDArray[np.int64], points: Floats, nodes: Ints) -> Floats:
    """The points as fields of ``widths[node]`` columns hold them (see Rounding.keep)."""
    flat, columns = points.reshape(-1), np.repeat(widths[nodes], points.shape[1])
    out, sure = rounded(flat, columns)
    zero = flat == 0.0
    out[zero] = flat[zero]
    left = np.flatnonzero(~sure & ~zero)
    out[left] = [worth(fitted(x, width)) for x, width in zip(flat[left].tolist(), columns[left].tolist(), strict=True)]
    return out.reshape(points.shape)


def rounding_of(widths: NDArray[np.int64], points: Floats) -> Rounding:
    """What the narrowest field loses of coordinates as large as these: half a unit of the last place.

    Nodes that leave the box of all others by more than a thousandth of it may lose more; ``smooth`` then compares
    meshes as they are written.
    """
    width = int(widths.min(initial=LONGEST))
    low, high = float(points.min(initial=0.0)), float(points.max(initial=0.0))
    margin = 1e-3 * (high / 2.0 - low / 2.0)
    grain = max(_last_place(low - margin, width), _last_place(high + margin, width))
    return Rounding(2.0**-53, 0.5 * grain, partial(kept, widths), f"fields of {width} columns")


def _last_place(value: float, width: int) -> float:
    """What one in the last place of a number of this size counts in a field."""
    room = width - (value < 0.0) - 1  # for digits
    exponent = math.floor(math.log10(min(abs(value), LARGEST))) if value else -1
    if exponent < room:
        return 10.0 ** -(room - max(exponent + 1, 0))
    return 10.0 ** min(exponent - (room - 1 - len(f"{exponent:+d}")), 308)
