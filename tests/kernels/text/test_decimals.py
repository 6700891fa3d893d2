"""Floats to decimals and back, against Python's own repr(), float() and exact integers."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.text import decimals
from gmsnet.kernels.text.text import FLOAT, SIGNED, UNSIGNED, print_rows


@kernel
def printed(values, out, ends):
    at = 0
    for k in range(len(values)):
        at = decimals.print_float(values[k], out, at)
        ends[k] = at


@kernel
def nearest(digits, scales, cut, bits):
    for k in range(len(digits)):
        bits[k] = decimals.nearest_float(digits[k], scales[k], cut)


@kernel
def high_products(a, b, out):
    for k in range(len(a)):
        out[k] = decimals.high_product(a[k], b[k])


def words_of(values: np.ndarray) -> list[str]:
    out, ends = np.full(decimals.WIDEST * len(values), 255, dtype=np.uint8), np.empty(len(values), dtype=np.int64)
    printed(values, out, ends)
    text = out.tobytes()
    return [text[a:b].decode() for a, b in zip([0, *ends[:-1].tolist()], ends.tolist(), strict=True)]


@given(st.lists(st.floats(), min_size=1))
def test_floats_are_printed_as_by_repr(values: list[float]) -> None:
    assert words_of(np.array(values)) == list(map(repr, values))


@given(st.lists(st.integers(0, 2**64 - 1), min_size=1))
def test_all_bit_patterns_are_printed_as_by_repr(bits: list[int]) -> None:
    values = np.array(bits, dtype=np.uint64).view(np.float64)
    assert words_of(values) == list(map(repr, values.tolist()))


@given(st.lists(st.tuples(st.integers(-(10**17), 10**17), st.integers(-330, 300)), min_size=1))
def test_short_decimals_stay_short(numbers: list[tuple[int, int]]) -> None:
    values = [float(f"{digits}e{scale}") for digits, scale in numbers]
    assert words_of(np.array(values)) == list(map(repr, values))


def test_many_floats_of_every_kind_are_printed_as_by_repr() -> None:
    random = np.random.default_rng(0)
    powers = np.exp2(np.arange(-1074.0, 1024.0))
    kinds = {
        "uniform": random.random(50_000),
        "bits": random.integers(0, 2**63, 50_000).view(np.float64),
        "powers of two": powers,
        "below them": np.nextafter(powers, 0.0),
        "above them": np.nextafter(powers, np.inf),
        "powers of ten": np.array([float(f"1e{k}") for k in range(-323, 309)]),
        "few digits": random.integers(0, 10**6, 50_000) / 10.0 ** random.integers(0, 12, 50_000),
        "whole": random.integers(0, 2**62, 50_000).astype(np.float64),
        "subnormal": random.integers(0, 2**52, 50_000).view(np.float64),
        "least": np.arange(2000) * 5e-324,
        "where the notation changes": np.nextafter(np.repeat([1e-5, 1e-4, 1e15, 1e16, 1e17], 2), [0.0, np.inf] * 5),
    }
    for kind, values in kinds.items():
        assert words_of(values) == list(map(repr, values.tolist())), kind


@given(st.lists(st.tuples(st.integers(0, 2**64 - 1), st.integers(0, 2**64 - 1)), min_size=1))
def test_high_product(pairs: list[tuple[int, int]]) -> None:
    a, b = np.array(pairs, dtype=np.uint64).T.copy()
    out = np.empty_like(a)
    high_products(a, b, out)
    assert out.tolist() == [x * y >> 64 for x, y in pairs]


def test_the_table_of_powers() -> None:
    for k, (high, low) in zip(range(decimals.LEAST, decimals.MOST + 1), decimals.POWERS.tolist(), strict=True):
        exponent = k * 217706 >> 16
        scaled = Fraction(10) ** k / Fraction(2) ** (exponent - 127)
        assert math.floor(scaled) == (high << 64) + low
        assert high >> 63 == 1  # so that the exponent is right, too


@given(st.lists(st.tuples(st.integers(1, 2**64 - 1), st.integers(-400, 400)), min_size=1), st.booleans())
def test_what_is_decided_is_the_nearest_float(numbers: list[tuple[int, int]], cut: bool) -> None:
    if cut:
        numbers = [(digits % (9 * 10**18) + 10**18, scale) for digits, scale in numbers]
    digits, scales = np.array([n for n, _ in numbers], dtype=np.uint64), np.array([k for _, k in numbers])
    bits = np.empty(len(numbers), dtype=np.int64)
    nearest(digits, scales, cut, bits)
    for (number, scale), found in zip(numbers, bits.tolist(), strict=True):
        if found != decimals.LONG:
            for rest in ("0", "5", "9" * 30) if cut else ("0",):
                assert np.int64(found).view(np.float64) == float(f"{number}.{rest}e{scale}")


@pytest.mark.parametrize(("cut", "most"), [(False, 400), (True, 3000)])
def test_few_numbers_are_left_undecided(cut: bool, most: int) -> None:
    random = np.random.default_rng(0)
    digits = random.integers(10**18, 9 * 10**18, 100_000).astype(np.uint64)
    bits = np.empty(len(digits), dtype=np.int64)
    nearest(digits, random.integers(-320, 280, len(digits)), cut, bits)
    assert np.count_nonzero(bits == decimals.LONG) < most


INTEGERS = st.integers(-(2**63), 2**63 - 1)


@given(st.lists(st.tuples(INTEGERS, st.floats(), st.integers(0, 2**64 - 1)), max_size=9))
def test_rows_of_numbers_and_words(rows: list[tuple[int, float, int]]) -> None:
    text = np.frombuffer(b"<,:>\n", dtype=np.uint8)
    whole = np.array([(a, np.uint64(c).astype(np.int64)) for a, _, c in rows], dtype=np.int64).reshape(-1, 2)
    real = np.array([b for _, b, _ in rows]).reshape(-1, 1)
    out = np.empty(100 * len(rows) + 1, dtype=np.uint8)
    length = print_rows(text, np.array([1, 2, 3, 5]), np.array([SIGNED, FLOAT, UNSIGNED]), whole, real, out)
    assert out[:length].tobytes().decode() == "".join(f"<{a},{b!r}:{c}>\n" for a, b, c in rows)
