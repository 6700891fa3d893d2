"""The tokenizer and the numbers against Python's own split() and float()."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gmsnet.errors import FormatError
from gmsnet.io.text import Text, line_of, quoted

TEXT = st.binary(max_size=60) | st.text("0123456789.eEdD+- \t\r\n\v\fx", max_size=60).map(str.encode)


def tokens_of(*tokens: bytes) -> tuple[Text, np.ndarray]:
    text = Text(b" ".join(tokens))
    return text, text.tokens(0, len(tokens))[0]


@given(TEXT)
def test_the_tokens_are_those_of_split(data: bytes) -> None:
    expected, text = data.split(), Text(data)
    starts, end = text.tokens(0, len(expected))
    assert list(map(text.token, starts)) == expected
    assert not data[end:].strip()
    assert text.tokens(0)[0].tolist() == starts.tolist()
    with pytest.raises(FormatError, match=r"expected 3 more numbers, the file ends"):
        text.tokens(0, len(expected) + 3)


@given(TEXT, st.integers(0, 70), st.integers(0, 70))
def test_tokens_stay_within_their_section(data: bytes, start: int, stop: int) -> None:
    start, stop = sorted((min(start, len(data)), min(stop, len(data))))
    expected, text = data[start:stop].split(), Text(data, stop=stop)
    assert list(map(text.token, text.tokens(start, len(expected))[0])) == expected
    found = text.next(start)
    assert (data[slice(*found)] if found else None) == next(iter(expected), None)


@given(TEXT)
def test_rows_are_the_tokens_of_every_line(data: bytes) -> None:
    expected = [line.split() for line in re.split(rb"[\r\n]", data) if line.split()]
    text = Text(data)
    rows = text.rows(0)
    assert len(rows) == len(expected)
    assert [list(map(text.token, rows.row(k))) for k in range(len(rows))] == expected
    assert rows.lengths.tolist() == [len(line) for line in expected]
    assert not data[rows.end :].strip()
    for count in range(len(expected) + 1):
        part = text.rows(0, count)
        assert len(part) == count
        rest = text.rows(part.end)
        assert len(rest) == len(expected) - count
    with pytest.raises(FormatError, match=r"expected 2 more lines, the file ends"):
        text.rows(0, len(expected) + 2)


@given(TEXT)
def test_comments_run_to_the_end_of_their_line(data: bytes) -> None:
    plain = Text(re.sub(rb"x[^\r\n]*", lambda match: b" " * len(match[0]), data))
    text = Text(data, b"x")
    rows, expected = text.rows(0), plain.rows(0)
    assert rows.starts.tolist() == expected.starts.tolist()
    assert rows.first.tolist() == expected.first.tolist()
    assert rows.end == expected.end
    assert list(map(text.token, rows.starts)) == list(map(plain.token, rows.starts))


@given(st.lists(st.lists(st.integers(0, 99), min_size=2, max_size=4), min_size=1, max_size=9), st.integers(1, 4))
def test_rows_in_parts(table: list[list[int]], most: int) -> None:
    text = Text("\n".join(" ".join(map(str, row)) for row in table).encode())
    rows, seen = text.rows(0), []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gmsnet.io.text.MOST_ROWS", most)
        for k, part in rows.parts():
            assert k == len(seen)
            assert len(part) <= most
            numbers = text.integers(part.starts)
            assert [numbers[a:b].tolist() for a, b in zip(part.first, part.first[1:], strict=False)] == table[
                k : k + len(part)
            ]
            counts = part.lengths - 1
            assert part.inner(numbers, 1, counts).tolist() == [n for row in table[k : k + len(part)] for n in row[1:]]
            seen += part.column(1).tolist()
    assert text.integers(np.array(seen)).tolist() == [row[1] for row in table]
    assert text.integers(rows.columns(0, 2)).tolist() == [row[:2] for row in table]


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1), st.sampled_from("rgef"))
def test_numbers_are_rounded_correctly(values: list[float], kind: str) -> None:
    tokens = [(repr(v) if kind == "r" else format(v, f".20{kind}")).encode() for v in values]
    text, starts = tokens_of(*tokens)
    got, ends = text.spans(starts)
    assert got.tobytes() == np.array([float(t) for t in tokens]).tobytes()
    assert [text.data[a:b] for a, b in zip(starts, ends, strict=True)] == tokens
    fortran = Text(text.data.replace(b"e", b"D"))
    assert fortran.floats(starts).tobytes() == got.tobytes()


@given(st.from_regex(rb"[+-]?([0-9]{1,25}\.?[0-9]{0,25}|\.[0-9]{1,25})([eE][+-]?[0-9]{1,3})?", fullmatch=True))
def test_every_spelling_of_a_number_is_rounded_correctly(number: bytes) -> None:
    text, starts = tokens_of(number)
    if np.isinf(float(number)):
        with pytest.raises(FormatError, match="too large"):
            text.floats(starts)
    else:
        assert text.floats(starts).tobytes() == np.array([float(number)]).tobytes()


@given(st.integers(0, 2**64 - 1), st.integers(-360, 330))
def test_numbers_of_up_to_twenty_digits(digits: int, scale: int) -> None:
    number = f"{digits}e{scale}".encode()
    if np.isfinite(float(number)):
        assert tokens_of(number)[0].floats(np.array([0])).tolist() == [float(number)]


@given(st.floats(min_value=5e-324, allow_infinity=False), st.integers(-2, 2), st.integers(1, 60))
def test_what_is_near_half_way_between_two_numbers(value: float, off: int, digits: int) -> None:
    half = (Fraction(value) + Fraction(np.nextafter(value, 0.0))) / 2
    scale = digits - len(str(half.numerator // half.denominator))
    number = f"{round(half * Fraction(10) ** scale) + off}e{-scale}".encode()
    assume(np.isfinite(float(number)))
    assert tokens_of(number)[0].floats(np.array([0])).tolist() == [float(number)]


def test_halfway_cases_and_extremes_are_exact() -> None:
    words = [b"9007199254740993", b"9007199254740991", b"0.1", b"1e23", b"8.5e22", b"1e22", b"-0.0", b"5e-324", b".5",
             b"5.", b"+.5e+1", b"1.7976931348623157e308", b"0e9999", b"1e-9999", b"0." + b"3" * 5000,
             b"2.2250738585072011e-308", b"1" + b"0" * 300, b"9" * 19, b"9" * 20, b"18446744073709551615",
             b"0." + b"0" * 400 + b"1e+400", b"0" * 50 + b"1", b"1.797693134862315807e308"]  # fmt: skip
    text, starts = tokens_of(*words)
    assert text.floats(starts).tobytes() == np.array([float(w) for w in words]).tobytes()


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
        Text(data).floats(Text(data).tokens(0, 4)[0])


@given(st.text("0123456789.eEdD+-_nx", min_size=1, max_size=12))
def test_exactly_the_plain_numbers_are_accepted(text: str) -> None:
    found, starts = tokens_of(text.encode())
    plain = re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,4})?", text)
    finite = plain and np.isfinite(float(re.sub("[dD]", "e", text)))
    if finite:
        assert found.floats(starts)[0] == float(re.sub("[dD]", "e", text))
    else:
        with pytest.raises(FormatError, match=r"^line 1: (a number was expected|the number .* is too large)"):
            found.floats(starts)


def test_overflow_is_refused() -> None:
    for text in (b"1e309", b"-1e309", b"2" + b"0" * 400):
        found, starts = tokens_of(b"1", text)
        with pytest.raises(FormatError, match=r"too large for a float64"):
            found.floats(starts)


@given(st.lists(st.integers(-(10**18) + 1, 10**18 - 1), min_size=1))
def test_integers(values: list[int]) -> None:
    text, starts = tokens_of(*(str(v).encode() for v in values))
    assert text.integers(starts).tolist() == values
    slashed, starts = tokens_of(*(f"{v}//-1/+2".encode() for v in values))
    assert slashed.integers(starts, slash=True).tolist() == values


@pytest.mark.parametrize("bad", ["1.0", "1e3", "0x1", "1_0", "+", "-", "9" * 19, "1٣", "٣"])
def test_what_is_no_integer_is_refused_with_its_line(bad: str) -> None:
    data = b"1\r\n2\r\n" + bad.encode()
    with pytest.raises(FormatError, match=r"^line 3: an integer was expected, found '"):
        Text(data).integers(Text(data).tokens(0, 3)[0])


def test_shapes_are_kept() -> None:
    text, starts = tokens_of(*b"1 2 3 4 5 6".split())
    assert text.integers(starts.reshape(3, 2)).tolist() == [[1, 2], [3, 4], [5, 6]]
    assert text.floats(starts.reshape(2, 3)).tolist() == [[1, 2, 3], [4, 5, 6]]
    assert text.floats(starts[:0]).shape == (0,)
    assert text.integers(starts[::2]).tolist() == [1, 3, 5]


@given(st.lists(st.sampled_from(["1.5", "-2", "nan", "NaN", "+nan", "-inf", "Infinity", "inf", "nan(ind)"])))
def test_what_is_not_finite(words: list[str]) -> None:
    text, starts = tokens_of(*map(str.encode, words))
    expected = np.array([float(w.replace("(ind)", "")) for w in words])
    assert np.array_equal(text.any_floats(starts), expected, equal_nan=True)


@pytest.mark.parametrize("bad", ["info", "n", "-", "+i", "nano", "x"])
def test_what_is_no_number_of_any_kind(bad: str) -> None:
    text, starts = tokens_of(b"1", bad.encode())
    with pytest.raises(FormatError, match="a number was expected"):
        text.any_floats(starts)


def test_letters_and_patterns() -> None:
    text = Text(b"vertex V 12 OUTER loop", ends=b"x")
    starts = text.tokens(0)[0]
    assert [letters.tobytes() for letters in text.letters(starts, 2)] == [b"vV1Ol", b"e\x002Uo"]
    assert list(map(text.token, starts)) == [b"verte", b"V", b"12", b"OUTER", b"loop"]
    assert text.mismatch(starts, [b"verte", b"v", b"", b"outer", b"loop"]) == -1
    assert text.mismatch(starts, [b"verte", b"v", b"", b"out"]) == 3
    assert text.mismatch(starts, [b"vert"]) == 0
    assert text.mismatch(starts, [b"verte", b""]) == 2
    assert Text(text.data, stop=20).mismatch(starts, [b"", b"", b"", b"outer", b"loop"]) == 4


def test_false_counts_ask_for_no_memory() -> None:
    text = Text(b"1 2 3")
    with pytest.raises(FormatError, match="expected 999999999999997 more numbers, the file ends"):
        text.tokens(0, 10**15)
    with pytest.raises(FormatError, match="expected 999999999999999 more lines, the file ends"):
        text.rows(0, 10**15)
    with pytest.raises(FormatError, match="negative"):
        text.tokens(0, -1)
    with pytest.raises(FormatError, match="negative"):
        text.rows(0, -1)
    with pytest.raises(FormatError, match="the number of cells is negative: -4"):
        Text(b"-4").count(0, "cells")


def test_large_files_have_wide_positions(monkeypatch: pytest.MonkeyPatch) -> None:
    data = b"1.5 2\n3 4.25\n"
    monkeypatch.setattr("gmsnet.io.text.MOST_NARROW", len(data) - 1)
    text = Text(data)
    rows = text.rows(0)
    assert rows.starts.dtype == rows.first.dtype == np.int64
    assert text.floats(rows.columns(0, 2)).tolist() == [[1.5, 2.0], [3.0, 4.25]]
    assert text.integers(rows.starts[1:2]).tolist() == [2]
    monkeypatch.setattr("gmsnet.io.text.MOST_NARROW", len(data))
    assert Text(data).rows(0).starts.dtype == np.int32


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_lines_are_counted_whatever_ends_them(end: bytes) -> None:
    data = end.join([b"a", b"", b"b", b"c"])
    assert [line_of(data, data.index(c)) for c in (b"a", b"b", b"c")] == [1, 3, 4]


def test_words_in_messages_are_short_and_printable() -> None:
    data = b"\x00\xffab" + b"c" * 100
    assert quoted(data) == r"'\x00\xffab" + "c" * 20 + "…'"


@pytest.mark.parametrize("number", [10**18, 2**63 - 1, -(2**63), 2**63, -(2**63) - 1, 10**19])
def test_integers_of_all_64_bits(number: int) -> None:
    text = Text(b"7 %d -3 %d" % (number, number))
    starts, _ = text.tokens(0)
    if -(2**63) <= number < 2**63:
        assert text.integers(starts).tolist() == [7, number, -3, number]
    else:
        with pytest.raises(FormatError, match="line 1: an integer was expected"):
            text.integers(starts)
