"""Small files that ask for much: refused in words, or read, with 200 MB beyond their own length, and in the end."""

from __future__ import annotations

import re
import sys

import pytest

from fuzz.bombs import bombs, huge_counts, with_little_memory
from gmsnet.io.formats import FORMATS

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the limit of memory is that of Linux")


def test_little_memory_is_enough() -> None:
    given = list(bombs())
    found = with_little_memory([(key, data) for key, _, data, _ in given])
    wrong = [
        (key, what, said)
        for (key, what, _, match), (said, _, _) in zip(given, found, strict=True)
        if not re.search(match, said)
    ]
    assert not wrong


def test_counts_that_lie_ask_for_no_memory() -> None:
    given = [(key, data) for key in FORMATS for data in huge_counts(key)]
    assert {key for key, _ in given} == set(FORMATS)
    found = with_little_memory(given)
    assert not [(key, said) for (key, _), (said, _, _) in zip(given, found, strict=True) if "memory" in said]
