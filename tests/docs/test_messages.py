"""docs/messages.md names all messages there are; it is generated, so that somebody reads what has changed."""

from __future__ import annotations

import importlib.util
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "docs" / "messages.py"


def test_the_page_is_that_of_these_sources():
    spec = importlib.util.spec_from_file_location("messages", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page = module.page()
    assert "- {…}: there is no such file" in page
    assert module.TARGET.read_text(encoding="utf-8") == page, "run python docs/messages.py and read what has changed"
