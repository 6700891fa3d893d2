"""The scripts of the gallery run as they are, where what they are about is installed."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest
from support.optional import library

GALLERY = Path(__file__).parents[2] / "examples" / "gallery"
PEERS = ("pyvista", "gmsh", "skfem", "matplotlib")


@pytest.mark.parametrize("script", sorted(GALLERY.glob("*.py")), ids=lambda path: path.stem)
def test_a_script_of_the_gallery_runs(script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = script.read_text(encoding="utf-8")
    for name in PEERS:
        if re.search(rf"^(import|from) {name}\b", text, re.MULTILINE) or (
            name == "matplotlib" and "gmsnet.plot" in text
        ):
            library(name)
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script), run_name="__main__")
    assert len(list(tmp_path.glob("*.png"))) == text.count('.png"')
