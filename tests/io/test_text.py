"""The tokenizer and the numbers against Python's own split() and float()."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.errors import FormatError
from gmsnet.io.text import blank, gather, line_of, scan, scan_rows, to_count, to_floats, to_ints, word

TEXT = st.binary(max_size=60) | st.text("0123456789.eEdD+- \t\r\n\v\fx", max_size=60).map(str.encode)


def spans_of(*tokens: bytes) -> tuple[bytes, np.ndarray]:
    data = b" ".join(tokens)
    return data, scan(data, 0, len(tokens))


@given(TEXT)
def test_scan_finds_the_tokens_of_split(data: bytes) -> None:
    expected = data.split()
    spans = scan(data, 0, len(expected))
    assert [data[a:b] for a, b in spans.tolist()] == expected
    with pytest.raises(FormatError, match=r"expected 3 more numbers, the file ends"):
        scan(data, 0, len(expected) + 3)


@given(TEXT, st.integers(0, 70), st.integers(0, 70))
def test_scan_stays_within_its_section(data: bytes, start: int, stop: int) -> None:
    start, stop = sorted((min(start, len(data)), min(stop, len(data))))
    expected = data[start:stop].split()
    assert [data[a:b] for a, b in scan(data, start, len(expected), stop).tolist()] == expected


@given(TEXT)
def test_scan_rows_finds_the_tokens_of_every_line(data: bytes) -> None:
    expected = [line.split() for line in re.split(rb"[\r\n]", data) if line.split()]
    rows = scan_rows(data, 0)
    assert len(rows) == len(expected)
    assert [[data[a:b] for a, b in rows.row(k).tolist()] for k in range(len(rows))] == expected
    assert rows.lengths.tolist() == [len(line) for line in expected]
    assert not data[rows.end :].strip()
    for count in range(len(expected) + 1):
        part = scan_rows(data, 0, count)
        assert len(part) == count
        rest = scan_rows(data, part.end)
        assert len(rest) == len(expected) - count
    with pytest.raises(FormatError, match=r"expected 2 more lines, the file ends"):
        scan_rows(data, 0, len(expected) + 2)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1), st.sampled_from("rgef"))
def test_numbers_are_rounded_correctly(values: list[float], kind: str) -> None:
    tokens = [(repr(v) if kind == "r" else format(v, f".20{kind}")).encode() for v in values]
    data, spans = spans_of(*tokens)
    got = to_floats(data, spans)
    assert got.tobytes() == np.array([float(t) for t in tokens]).tobytes()
    fortran = data.replace(b"e", b"D")
    assert to_floats(fortran, spans).tobytes() == got.tobytes()


@given(st.from_regex(rb"[+-]?([0-9]{1,25}\.?[0-9]{0,25}|\.[0-9]{1,25})([eE][+-]?[0-9]{1,2})?", fullmatch=True))
def test_every_spelling_of_a_number_is_rounded_correctly(text: bytes) -> None:
    data, spans = spans_of(text)
    assert to_floats(data, spans)[0] == float(text)


def test_halfway_cases_and_extremes_are_exact() -> None:
    words = [b"9007199254740993", b"9007199254740991", b"0.1", b"1e23", b"8.5e22", b"1e22", b"-0.0", b"5e-324", b".5",
             b"5.", b"+.5e+1", b"1.7976931348623157e308", b"0e9999", b"1e-9999", b"0." + b"3" * 5000,
             b"2.2250738585072011e-308", b"1" + b"0" * 300]  # fmt: skip
    data, spans = spans_of(*words)
    assert to_floats(data, spans).tobytes() == np.array([float(w) for w in words]).tobytes()


@pytest.mark.parametrize(
    "bad",
    [
        "nan",
        "inf",
        "-inf",
        "Infinity",
        "1_0",
        "0x1",
        "1e",
        "1e+",
        "e5",
        ".",
        "+",
        "-",
        "+-1",
        "1.2.3",
        "1,5",
        "1/2",
        "1e5.0",
        "1e12345",
        "--1",
        "١",
    ],
)
def test_what_is_no_plain_number_is_refused_with_its_line(bad: str) -> None:
    data = b"1 2\n" + bad.encode() + b" 4"
    with pytest.raises(FormatError, match=r"^line 2: a number was expected, found '"):
        to_floats(data, scan(data, 0, 4))


@given(st.text("0123456789.eEdD+-_nx", min_size=1, max_size=12))
def test_exactly_the_plain_numbers_are_accepted(text: str) -> None:
    data, spans = spans_of(text.encode())
    plain = re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,4})?", text)
    finite = plain and np.isfinite(float(re.sub("[dD]", "e", text)))
    if finite:
        assert np.isfinite(to_floats(data, spans)[0])
    else:
        with pytest.raises(FormatError, match=r"^line 1: (a number was expected|the number .* is too large)"):
            to_floats(data, spans)


def test_overflow_is_refused() -> None:
    for text in (b"1e309", b"-1e309", b"2" + b"0" * 400):
        data, spans = spans_of(b"1", text)
        with pytest.raises(FormatError, match=r"too large for a float64"):
            to_floats(data, spans)


@given(st.lists(st.integers(-(10**18) + 1, 10**18 - 1), min_size=1))
def test_integers(values: list[int]) -> None:
    data, spans = spans_of(*(str(v).encode() for v in values))
    assert to_ints(data, spans).tolist() == values


@pytest.mark.parametrize("bad", ["1.0", "1e3", "0x1", "1_0", "+", "-", "9" * 19, "1٣", "٣"])
def test_what_is_no_integer_is_refused_with_its_line(bad: str) -> None:
    data = b"1\r\n2\r\n" + bad.encode()
    with pytest.raises(FormatError, match=r"^line 3: an integer was expected, found '"):
        to_ints(data, scan(data, 0, 3))


def test_shapes_are_kept() -> None:
    data, spans = spans_of(*b"1 2 3 4 5 6".split())
    assert to_ints(data, spans.reshape(3, 2, 2)).tolist() == [[1, 2], [3, 4], [5, 6]]
    assert to_floats(data, spans.reshape(2, 3, 2)).tolist() == [[1, 2, 3], [4, 5, 6]]
    assert gather(data, spans[::2]).tolist() == [b"1", b"3", b"5"]
    assert to_floats(data, spans[:0]).shape == (0,)
    assert to_ints(data, spans[::2]).tolist() == [1, 3, 5]


def test_false_counts_ask_for_no_memory() -> None:
    data = b"1 2 3"
    with pytest.raises(FormatError, match="expected 999999999999997 more numbers, the file ends"):
        scan(data, 0, 10**15)
    with pytest.raises(FormatError, match="expected 999999999999999 more lines, the file ends"):
        scan_rows(data, 0, 10**15)
    with pytest.raises(FormatError, match="negative"):
        scan(data, 0, -1)
    with pytest.raises(FormatError, match="negative"):
        scan_rows(data, 0, -1)
    with pytest.raises(FormatError, match="the number of cells is negative: -4"):
        to_count(b"-4", scan(b"-4", 0, 1)[0], "cells")


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_lines_are_counted_whatever_ends_them(end: bytes) -> None:
    data = end.join([b"a", b"", b"b", b"c"])
    assert [line_of(data, data.index(c)) for c in (b"a", b"b", b"c")] == [1, 3, 4]


@given(TEXT)
def test_blank_keeps_every_other_byte_in_its_place(data: bytes) -> None:
    got = blank(data, rb"x[^\n]*")
    assert len(got) == len(data)
    inside = False
    for old, new in zip(data, got, strict=True):
        inside = (inside or old == ord("x")) and old != ord("\n")
        assert new == (32 if inside and old not in b"\r\n" else old)


def test_words_in_messages_are_short_and_printable() -> None:
    data = b"\x00\xffab" + b"c" * 100
    assert word(data, scan(data, 0, 1)[0]) == r"'\x00\xffab" + "c" * 20 + "…'"
