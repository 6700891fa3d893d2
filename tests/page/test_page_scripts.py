"""The scripts of a page, as files."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import gmsnet.page
from gmsnet.page.document import SCRIPTS

FOLDER = Path(gmsnet.page.__file__).parent


def test_all_scripts_of_the_folder_are_part_of_pages():
    assert sorted(path.name for path in FOLDER.glob("*.js")) == sorted(SCRIPTS)


@pytest.mark.parametrize("name", SCRIPTS)
def test_scripts_are_short_and_say_what_they_are_for(name):
    lines = (FOLDER / name).read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("// ")
    assert len(lines) <= 300
    assert not [line for line in lines if len(line) > 160 or line != line.rstrip() or "\t" in line]


def test_no_name_is_given_twice():
    text = "\n".join((FOLDER / name).read_text(encoding="utf-8") for name in SCRIPTS)
    names = re.findall(r"^(?:const|class|let|function) (\w+)", text, re.M)
    assert len(names) == len(set(names))


@pytest.mark.parametrize("name", SCRIPTS)
def test_scripts_can_be_parsed(name):
    node = shutil.which("node")
    if not node:
        pytest.skip("there is no node to parse scripts with; the browser does it where there is one")
    done = subprocess.run([node, "--check", str(FOLDER / name)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_what_the_style_names_is_in_pages(planar, volume, tangled):
    """A class or an element of the style that no page and no script has would be left over."""
    from gmsnet.page.document import pieces

    pages = "".join(b"".join(pieces(each)).decode() for each in (planar, volume, tangled))
    style = (FOLDER / "page.css").read_text(encoding="utf-8")
    body = re.sub(r"<style>.*?</style>", "", pages, flags=re.S)
    rules = re.sub(r"\{[^{}]*\}", " ", style)
    for kind in set(re.findall(r"\.([a-z]\w*)", rules)) - {f"k{k}" for k in range(8)} - {"now", "worse", "remark"}:
        assert re.search(rf"\b{kind}\b", body), kind
    for name in set(re.findall(r"#([a-z]\w*)", rules)) - {"unmended"}:
        assert f'id="{name}"' in body, name
