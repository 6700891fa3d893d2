"""The page about ``preserve`` has a sentence and a picture for each choice."""

from __future__ import annotations

import re
from pathlib import Path

from gmsnet.preserve.protection import PRESERVE

DOCS = Path(__file__).parents[2] / "docs"


def test_each_choice_has_a_sentence_and_a_picture():
    text = (DOCS / "preserve.md").read_text(encoding="utf-8")
    for name in PRESERVE:
        (picture,) = re.findall(rf'`preserve="{name}"`[^\n]*\.\n\n!\[{name}\]\(([^)]*)\)', text)
        assert (DOCS / picture).read_bytes().startswith(b"\x89PNG")
        assert re.search(rf"^\| {name} \|", text, re.MULTILINE)
