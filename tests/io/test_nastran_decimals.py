"""Many fields at once: the same decimals as one by one, wherever they are said to be certain."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.io.nastran_decimals import rounded, texts
from gmsnet.io.nastran_numbers import fitted, worth

WIDTHS = st.sampled_from([8, 9, 12, 16, 20])
NUMBERS = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.floats(-1e5, 1e5),
    st.integers(-(10**8), 10**8).map(lambda n: n / 2048.0),  # ties among them
    st.sampled_from([0.0, -0.0, 0.01, 0.99999999999999989, 9.9999999999999982, 99999.5, 0.009999999, 0.1, -0.1, 1e13]),
)


@given(st.lists(st.tuples(NUMBERS, WIDTHS), min_size=1, max_size=50))
def test_they_are_those_of_one_by_one(rows: list[tuple[float, int]]) -> None:
    values, widths = np.array([v for v, _ in rows]), np.array([w for _, w in rows])
    kept, sure = rounded(values, widths)
    columns = (texts(values, widths), values.tolist(), widths.tolist(), kept.tolist(), sure.tolist())
    for text, value, width, back, good in zip(*columns, strict=True):
        assert (text is not None) == good
        if good:
            expected = fitted(float(value), int(width))
            assert text == expected
            assert back == worth(expected)


def test_nearly_all_usual_coordinates_are_certain() -> None:
    random = np.random.default_rng(0)
    for width in (8, 16):
        values = random.normal(size=20_000) * 10.0 ** random.integers(0, 4, 20_000)
        values = values[np.abs(values) >= 0.01]
        _, sure = rounded(values, np.full(len(values), width))
        assert sure.mean() > 0.999
        for value, text in list(zip(values.tolist(), texts(values, np.full(len(values), width)), strict=True))[:4000]:
            assert text is None or text == fitted(value, width)
