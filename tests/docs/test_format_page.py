"""docs/formats.md tells what each format keeps: it is measured again here, and nothing may be lost without a word."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

import gmsnet

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def formats():
    sys.path.insert(0, str(DOCS))
    try:
        import formats

        yield formats
    finally:
        sys.path.remove(str(DOCS))


def test_the_page_is_what_is_measured(formats, tmp_path):
    page = formats.page(tmp_path)
    assert page.count("| yes ") > 300
    assert page.count("| kept") > 200
    shown = formats.TARGET.read_text(encoding="utf-8").partition(formats.format_peers.TITLE)[0]
    assert shown == page, "run python docs/formats.py and read what has changed"
    assert re.findall(r"\*\*(changed|reads differently)\*\*|refused:", page) == []
    converted, _, beyond = page.partition("## Converting")[2].partition("### What is in the file")
    assert "**silent**" not in converted
    rows = [row.strip("| ").split(" | ") for row in beyond.splitlines() if row.startswith("| ")]
    silent = {row[0] for row in rows[1:] if row[2] != "–"}
    assert silent == {"comments", "line ends", "blanks", "node numbers", "cell numbers", "entities"}


def test_a_change_that_is_made_on_purpose_is_seen(formats, tmp_path, monkeypatch):
    variant = next(v for v in formats.VARIANTS if v.title == "SU2")
    assert formats.entry(variant, "comments", tmp_path) == "kept"
    splice = gmsnet.io.file_source.FileSource.splice
    monkeypatch.setattr(
        gmsnet.io.file_source.FileSource,
        "splice",
        lambda self, points: {suffix: [bytes(pieces).upper()] for suffix, pieces in splice(self, points).items()},
    )
    assert formats.entry(variant, "comments", tmp_path) == "**changed**"


LOST = {  # format: a fact that is in the file alone, and words of what is said when it is converted
    "su2": ("more", ["the keyword AOA, the keyword FFD_NBOX, the keyword FFD_TAG"]),
    "gmsh": ("more", ["$Periodic"]),
    "vtk": ("more", ["the field 'TIME' of the whole grid"]),
    "vtu": ("more", ["the field 'TIME'"]),
    "medit": ("more", ["Ridges"]),
    "triangle": ("node numbers", ["the numbers of nodes"]),
    "stl": ("cell data", ["attributes of triangles"]),
    "obj": ("more", ["normals (vn), the library of its materials (mtllib)"]),
    "off": ("point data", ["normals, colours or texture of points"]),
    "ply": ("more", ["the element 'material'"]),
    "ugrid": ("more", ["what follows the volumes"]),
    "nastran": ("more", ["the card MAT1"]),
    "abaqus": ("more", ["the keyword *MATERIAL, the keyword *ELASTIC"]),
}


@pytest.mark.parametrize("key", LOST)
def test_what_only_the_file_holds_is_named_when_it_is_converted(formats, key, tmp_path):
    fact, words = LOST[key]
    title = "STL, binary" if key == "stl" else None
    variant = next(v for v in formats.VARIANTS if v.key == key and title in (None, v.title))
    facts = {fact, *formats.NEEDS.get(fact, ())}
    for named in (True, False):
        some = facts if named else facts - {fact}
        mesh = gmsnet.read(formats.saved(variant.make(some, formats.points_of(some)), tmp_path / "in"))
        lost = gmsnet.write(mesh, tmp_path / ("out.vtk" if key == "vtu" else "out.vtu"))
        said = [each for each in lost if each.startswith("only the ")]
        title = gmsnet.io.FORMATS[key].title
        assert said == [f"only the {title} file that was read holds {found}: left out" for found in words] * named or (
            key == "triangle" and named and len(said) == 1 and words[0] in said[0]
        )
