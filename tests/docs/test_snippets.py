"""The Python of pages runs as it is printed, all of a page in turn, where what the page is about is installed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from support.optional import library

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {"gmsh.md": "gmsh", "pyvista.md": "pyvista"}  # page → the package that it needs


@pytest.mark.parametrize("page", PAGES)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch):
    library(PAGES[page])
    monkeypatch.chdir(tmp_path)
    text = (DOCS / page).read_text(encoding="utf-8")
    blocks = list(re.finditer(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
    assert len(blocks) > 0
    names: dict[str, object] = {}
    for block in blocks:
        line = text[: block.start(1)].count("\n")
        exec(compile("\n" * line + block[1], str(DOCS / page), "exec"), names)
