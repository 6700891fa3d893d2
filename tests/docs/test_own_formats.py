"""The measured table of docs/own-formats.md is what is measured now, and nothing in it is changed."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
from support.optional import library


def test_the_table_is_what_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    library("h5py")
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "docs")
    own_formats = importlib.import_module("own_formats")
    table = own_formats.table()
    assert "**" not in table
    assert table in own_formats.TARGET.read_text(encoding="utf-8"), "run python docs/own_formats.py"
