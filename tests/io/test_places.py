"""Addresses in rows: the same as one by one, in texts and in binary files."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.io import places
from gmsnet.io.places import Lattice, Places, chained, lists, pick, ranges, shifted, side_by_side
from gmsnet.io.text import Text
from gmsnet.io.words import ByteWords, TextWords

LATTICES = st.lists(
    st.tuples(st.integers(5, 40), st.integers(0, 5), st.integers(1, 7), st.sets(st.integers(-5, 6), min_size=1)).map(
        lambda given: Lattice(given[0], given[1], given[2], tuple(sorted(given[3], key=lambda c: c % 4)))
    ),
    max_size=4,
)
NUMBERS = np.random.default_rng(0).integers(-(2**59), 2**59, 100)


def one_by_one(lattices: list[Lattice]) -> list[int]:
    return [part.start + k * part.stride + c for part in lattices for k in range(part.rows) for c in part.columns]


@given(LATTICES, st.integers(0, 9))
def test_lattices_are_their_addresses(lattices: list[Lattice], by: int) -> None:
    found, expected = Places(*lattices), one_by_one(lattices)
    assert list(found) == expected
    assert len(found) == len(expected)
    assert pick(NUMBERS, found).tolist() == NUMBERS[expected].tolist()
    assert list(shifted(found, by)) == [address + by for address in expected]
    assert list(chained([found, Places(), found])) == expected * 2
    assert list(chained([found, np.array([3, 4])])) == [*expected, 3, 4]


@given(st.integers(0, 9), st.integers(0, 4), st.integers(0, 30), st.integers(1, 4), st.integers(0, 3))
def test_wide_rows_are_taken_at_once(start: int, rows: int, columns: int, step: int, gap: int) -> None:
    wide = Lattice(start, rows, columns * step + gap, range(0, columns * step, step))
    numbers = np.arange(9 + 4 * (30 * 4 + 3), dtype=np.uint8)
    table = wide.table(numbers, numbers.dtype) if len(wide) else None
    assert (table is not None) == (len(wide) > 0 and columns > rows)
    expected = numbers[one_by_one([wide])].tolist()
    assert pick(numbers, Places(wide)).tolist() == expected
    assert ByteWords(numbers.tobytes(), "<").values(Places(wide), "u1").tolist() == expected


@given(LATTICES)
def test_words_at_lattices(lattices: list[Lattice]) -> None:
    found, expected = Places(*lattices), one_by_one(lattices)
    text = Text(b" ".join(b"%d" % number for number in NUMBERS.tolist()))
    words = TextWords(text, text.tokens(0)[0])
    assert words.values(found, "i8").tolist() == words.values(np.array(expected, dtype=int), "i8").tolist()
    for order, kind in itertools.product("<>", ("i4", "u8", "f4")):
        data = ByteWords(NUMBERS.astype(order + "i8").tobytes(), order)
        one = b"".join(data.data[address : address + data.size(kind)] for address in expected)
        with np.errstate(invalid="ignore"):
            numbers = np.frombuffer(one, order + kind).astype("f8" if kind == "f4" else "i8")
        for addresses in (found, np.array(expected, dtype=int)):
            assert np.array_equal(data.values(addresses, kind, finite=False), numbers, equal_nan=True)


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 3), st.integers(0, 2)), max_size=12), st.integers(0, 3))
def test_lists_in_records(records: list[tuple[int, int, int]], most: int) -> None:
    skip, counts, rest = (np.array([record[k] for record in records], dtype=np.int64) for k in range(3))
    lengths = skip + counts + rest
    first = np.cumsum(lengths) - lengths + 7
    expected = [int(first[k] + skip[k]) + j for k in range(len(records)) for j in range(counts[k])]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(places, "MOST_LATTICES", most)
        assert list(lists(first, lengths, skip, counts)) == expected
    assert ranges(first + skip, counts).tolist() == expected
    assert ranges(first + skip, counts, 4).tolist() == [
        int(first[k] + skip[k]) + 4 * j for k in range(len(records)) for j in range(counts[k])
    ]


def test_columns_side_by_side() -> None:
    columns = [Places(Lattice(start, 3, 10), Lattice(start + 100, 2, 20)) for start in (4, 0, 7)]
    expected = [address for row in zip(*columns, strict=True) for address in row]
    assert list(side_by_side(*columns)) == expected
    assert list(side_by_side(*map(np.array, columns))) == expected


def test_three_to_a_row() -> None:
    flat = Places(Lattice(5, 6, 4), Lattice(50, 2, 9, (0, 2, 4)))
    assert list(flat.in_threes()) == list(flat)
    assert [len(lattice.columns) for lattice in flat.in_threes().lattices] == [3, 3]
