"""What is in a page, and what cannot get into it."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.pages import Page

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.measure.figures import figures_of
from gmsnet.mesh.display import visible
from gmsnet.page import write_page
from gmsnet.page.document import SCRIPTS, pieces
from gmsnet.page.markup import json_block, text

HOSTILE = [
    "<script>alert(1)</script>",
    "\"><img src=x onerror='alert(1)'>",
    "</script><script>alert(2)</script>",
    "<!--", "]]>", "javascript:alert(3)", "a\x1b[31mred\x00", "‮txt.exe", "&lt;b&gt;", "\udcff broken", "${1+1}`",
]  # fmt: skip


def page_of(contents) -> Page:
    return Page(b"".join(pieces(contents)))


def policy_of(page: Page) -> dict[str, str]:
    metas = [attributes for tag, attributes in page.tags if tag == "meta"]
    policy = next(m["content"] for m in metas if m.get("http-equiv") == "Content-Security-Policy")
    return dict(part.strip().split(" ", 1) for part in policy.split(";"))


def hash_of(content: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()}'"


@pytest.mark.parametrize("name", ["planar", "volume", "tangled"])
def test_the_policy_lets_in_the_script_and_the_style_of_the_page_alone(name, request):
    page = page_of(request.getfixturevalue(name))
    assert policy_of(page) == {
        "default-src": "'none'",
        "script-src": hash_of(page.running[0]),
        "style-src": hash_of(page.styles[0]),
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    assert len(page.running) == len(page.styles) == 1


@pytest.mark.parametrize("name", ["planar", "volume", "tangled"])
def test_nothing_in_a_page_could_load_or_run_anything_else(name, request):
    for tag, attributes in page_of(request.getfixturevalue(name)).tags:
        assert tag not in {"link", "img", "iframe", "object", "embed", "base", "form", "a", "video", "audio"}
        assert not [key for key in attributes if key.startswith("on") or key in {"src", "href", "style", "srcdoc"}]


def test_the_policy_stands_before_all_that_it_is_for(planar):
    tags = [(tag, attributes.get("http-equiv")) for tag, attributes in page_of(planar).tags]
    at = tags.index(("meta", "Content-Security-Policy"))
    assert at < tags.index(("style", None))
    assert at < tags.index(("script", None))


def test_names_are_those_of_one_element_each(volume):
    names = [attributes["id"] for _, attributes in page_of(volume).tags if "id" in attributes]
    assert len(names) == len(set(names))


def test_figures_are_those_of_the_reports(planar):
    page = page_of(planar)
    rows = [attributes["data-path"] for tag, attributes in page.tags if tag == "tr" and "data-path" in attributes]
    figures = figures_of([planar.before.summary(), planar.after.summary()])
    assert rows == [".".join(figure.path) for figure in figures]
    for figure in figures:
        assert "".join([figure.label, *figure.texts]) in page.texts["figures"]


def test_the_page_carries_the_whole_document(planar):
    document = page_of(planar).block("report")
    assert document["after"]["shape"]["min"] == planar.after.shape.min()
    assert document["moved"] == planar.document["moved"]
    assert document["history"][-1]["index"] == planar.document["sweeps"]


def test_the_verdict_the_command_and_the_version_are_told(tangled):
    page = page_of(tangled)
    assert page.texts["verdict"].lower().startswith(tangled.verdict[:20].lower())
    assert page.texts["command"] == tangled.command
    assert page.texts["version"] == gmsnet.__version__
    assert tangled.faults[0][:60] in page.texts["faults"]


def test_cells_that_could_not_be_mended_are_listed_with_the_reason(tangled):
    page = page_of(replace(tangled, unmended=[(7, "no <b>room</b>"), *((k, "why") for k in range(8, 200))]))
    assert "7no <b>room</b>" in page.texts["unmended"]
    assert "And 93 more" in page.texts["unmended"]


def test_held_nodes_are_counted_by_reason(planar):
    page = page_of(planar)
    for reason, ids in planar.held.items():
        assert f"{reason} {len(ids):,}" in page.texts["held"]


@pytest.mark.parametrize("harm", HOSTILE)
def test_no_text_becomes_markup(harm, planar):
    plain, held = page_of(planar), {harm: planar.held["boundary"]}
    contents = replace(
        planar, title=harm, verdict=harm, command=harm, notes=[harm], faults=[harm], held=held, facts=[(harm, harm)],
        unmended=[(1, harm)], document={harm: harm},
    )  # fmt: skip
    page = page_of(contents)
    shown = visible(harm).encode("utf-8", errors="backslashreplace").decode()
    for name in ("command", "faults", "notes", "unmended", "held"):
        assert shown in page.texts[name]
    assert page.running == plain.running
    more = {"ul", "li", "dt", "dd", "dl", "section", "h2", "div", "table", "caption", "thead", "tbody", "tr", "th"}
    assert {tag for tag, _ in page.tags} <= {tag for tag, _ in plain.tags} | more | {"button", "td"}
    assert [key.encode("utf-8", errors="backslashreplace").decode() for key in page.block("report")]


@given(st.text(max_size=60))
def test_any_text_is_read_as_it_is_shown(value):
    shown = visible(value).encode("utf-8", errors="backslashreplace").decode().replace("\r", "\n")
    page = Page(f'<p id="p" title="{text(value)}">{text(value)}</p>'.encode("utf-8", errors="backslashreplace"))
    assert page.texts.get("p", "") == shown
    assert page.tags == [("p", {"id": "p", "title": shown})]


@given(
    st.recursive(st.text(max_size=20) | st.floats() | st.none(), lambda part: st.lists(part, max_size=3), max_leaves=6)
)
def test_any_values_are_read_as_they_are_written(value):
    def strict(each):
        if isinstance(each, list):
            return [strict(part) for part in each]
        return None if isinstance(each, float) and not np.isfinite(each) else each

    made = json_block("data", value)
    assert made.count("<") == 2
    assert Page(made.encode()).block("data") == strict(value)


def test_scripts_hold_nothing_that_ends_them_or_asks_for_anything(planar):
    (script,) = page_of(planar).running
    for word in ("</", "<!--", "fetch(", "XMLHttpRequest", "WebSocket", "import(", "eval(", "innerHTML", "Function("):
        assert word not in script
    assert len(SCRIPTS) == len(set(SCRIPTS))


def test_a_mesh_without_measured_cells_has_a_page():
    lines = Mesh(np.array([[0.0, 0.0], [1.0, 0.0]]), (CellBlock("line", np.array([[0, 1]]), np.array([1])),))
    from gmsnet.page import Contents

    contents = Contents("lines", "nothing", lines, gmsnet.quality(lines), {}, "gmsnet", ())
    page = page_of(contents)
    assert page.running == []
    assert "script-src" not in policy_of(page)
    assert "no cells that could be drawn" in page.texts["view"]


def test_writing_leaves_an_old_page_where_it_fails(planar, tmp_path, monkeypatch):
    path = tmp_path / "page.html"
    path.write_bytes(b"old")

    def broken(contents):
        yield b"half"
        raise MemoryError("none left")

    monkeypatch.setattr("gmsnet.page.write.pieces", broken)
    with pytest.raises(MemoryError):
        write_page(path, planar)
    assert path.read_bytes() == b"old"
    assert [each.name for each in tmp_path.iterdir()] == ["page.html"]


@pytest.mark.parametrize("name", ["page.txt", "page", "page.png", ".html/"])
def test_what_is_no_name_of_a_page_is_refused(planar, tmp_path, name):
    with pytest.raises(gmsnet.InputError):
        write_page(f"{tmp_path}/{name}", planar)
    assert not list(tmp_path.iterdir())


def test_a_folder_is_not_replaced_by_a_page(planar, tmp_path):
    folder = tmp_path / "folder.html"
    folder.mkdir()
    with pytest.raises(gmsnet.InputError, match="this is a folder"):
        write_page(folder, planar)


def test_the_same_contents_make_the_same_bytes(volume):
    assert b"".join(pieces(volume)) == b"".join(pieces(volume))
