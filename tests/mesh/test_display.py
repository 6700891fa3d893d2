"""Counts, figures and tables as they read."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gmsnet.mesh.display import amount, html_table, listed, plain, text_table


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (100.0, "100"), (99.97, "100"), (1257.3, "1,260"), (999.6, "1,000"), (0.01234, "0.0123"), (12.34, "12.3"),
        (3.0, "3"), (-3.14159, "-3.14"), (0.0, "0"), (5e-7, "5e-07"), (2.5e10, "2.5e+10"), (math.inf, "inf"),
    ],
)  # fmt: skip
def test_plain_figures(value, text):
    assert plain(value) == text


@given(value=st.floats(1.1e-4, 0.9e9), sign=st.sampled_from([1.0, -1.0]), digits=st.integers(1, 6))
def test_a_plain_figure_is_the_rounded_value_without_an_exponent(value, sign, digits):
    text = plain(sign * value, digits)
    assert float(text.replace(",", "")) == float(f"{sign * value:.{digits}g}")
    assert "e" not in text


def test_amounts_and_lists():
    assert amount(1, "cell") == "1 cell"
    assert amount(1200, "cell") == "1,200 cells"
    assert listed("ab") == "'a', 'b'"
    assert listed("abcdefgh") == "'a', 'b', 'c', 'd', 'e', 'f' and 2 more"


def test_tables_line_up_and_html_is_escaped():
    rows = [("", "before"), ("1/q", "0.5")]
    assert text_table(rows) == "     before\n1/q     0.5"
    assert html_table("<b>", rows, ["a & b"]) == (
        "<table><caption>&lt;b&gt;</caption><thead><tr><th></th><th>before</th></tr></thead>"
        "<tbody><tr><th>1/q</th><td>0.5</td></tr></tbody></table><div>a &amp; b</div>"
    )
