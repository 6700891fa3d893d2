"""Pages in a browser: they are drawn, they are silent, and what one does with them is seen."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from support.pages import Page

import gmsnet
from gmsnet.cli import main
from gmsnet.generate import random_mesh
from gmsnet.measure.figures import figures_of
from gmsnet.measure.worst import worst_cells
from gmsnet.page import Contents
from gmsnet.page.document import pieces
from gmsnet.page.groups import groups_of

INVERTED = (0xD1, 0x00, 0x1F)


def share(pixels: np.ndarray, colour: tuple[int, int, int]) -> float:
    return float((np.abs(pixels.astype(int) - colour).max(axis=2) <= 3).mean())


def changed(one: np.ndarray, other: np.ndarray) -> float:
    return float((one != other).any(axis=2).mean())


def set_to(page, name: str, value: object) -> None:
    page.evaluate(
        """([name, value]) => {
          const element = document.getElementById(name);
          element.value = value;
          element.dispatchEvent(new Event("input"));
        }""",
        [name, value],
    )


@pytest.mark.parametrize("name", ["planar", "volume", "tangled"])
def test_the_mesh_fills_the_picture_and_the_paper_is_seen_around_it(name, request, seen):
    pixels = seen(request.getfixturevalue(name)).pixels()
    paper = share(pixels, tuple(pixels[0, 0]))
    assert 0.1 < paper < 0.8
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20


def test_the_numbers_are_those_of_the_json_report(browser, tmp_path, capsys):
    path, out = tmp_path / "in.vtk", tmp_path / "out.vtk"
    gmsnet.write(random_mesh(150, seed=5), path)
    page_path = tmp_path / "page.html"
    assert main(["smooth", str(path), str(out), "--report", str(page_path), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["report"] == str(page_path)
    page = browser.new_page()
    page.goto(page_path.as_uri())
    rows = page.evaluate(
        "[...document.querySelectorAll('#figures tbody tr')].map("
        "(row) => [row.dataset.path, ...[...row.cells].slice(1).map((cell) => cell.textContent)])"
    )
    figures = figures_of([document["before"], document["after"]])
    assert rows == [[".".join(figure.path), *figure.texts] for figure in figures]
    held = page.evaluate("[...document.querySelectorAll('#held b')].map((b) => [b.dataset.reason, b.textContent])")
    assert held == [[reason, f"{count:,}"] for reason, count in document["held"].items()]
    cells = page.evaluate("[...document.querySelectorAll('#worst-after .go')].map((b) => Number(b.dataset.cell))")
    assert cells[: len(document["worst"])] == [cell["cell"] for cell in document["worst"]]
    assert page.evaluate("JSON.parse(document.getElementById('report').textContent)") == document
    page.close()


@pytest.mark.parametrize("name", ["planar", "volume"])
def test_the_slider_changes_the_picture_and_back(name, request, seen):
    found = seen(request.getfixturevalue(name))
    after = found.pixels()
    set_to(found.page, "mix", 0)
    before = found.pixels()
    assert changed(before, after) > 0.05
    set_to(found.page, "mix", 50)
    assert min(changed(found.pixels(), before), changed(found.pixels(), after)) > 0.02
    set_to(found.page, "mix", 100)
    assert changed(found.pixels(), after) == 0.0


def test_inverted_cells_are_red_and_only_where_there_are_any(planar, tangled, seen):
    assert share(seen(tangled).pixels(), INVERTED) > 1e-4
    found = seen(planar)
    set_to(found.page, "mix", 0)
    assert share(found.pixels(), INVERTED) == 0.0


@pytest.mark.parametrize("name", ["planar", "volume"])
def test_each_colour_draws_another_picture(name, request, seen):
    found = seen(request.getfixturevalue(name))
    pictures = []
    for colour in found.page.evaluate("[...document.getElementById('colour').options].map((option) => option.value)"):
        set_to(found.page, "colour", colour)
        pictures.append(found.pixels())
    assert len(pictures) == 3
    assert all(changed(one, other) > 0.02 for k, one in enumerate(pictures) for other in pictures[:k])


def test_edges_can_be_taken_away(planar, seen):
    found = seen(planar)
    with_edges = found.pixels()
    found.page.click("#edges")
    assert changed(found.pixels(), with_edges) > 0.02


@pytest.mark.parametrize("name", ["planar", "volume"])
def test_the_worst_cells_zoom_and_say_their_figures(name, request, seen):
    contents = request.getfixturevalue(name)
    found = seen(contents)
    whole = found.pixels()
    found.page.click("#worst-before .go >> nth=0")
    assert found.page.input_value("#mix") == "0"
    worst = contents.worst_before[0]
    said = found.page.inner_text("#said")
    assert f" {worst['cell']} at " in said
    assert f"{worst['shape']:.3f} → " in said
    assert found.page.get_attribute("#worst-before .go >> nth=0", "aria-pressed") == "true"
    found.page.wait_for_selector("#over path >> nth=1", state="attached")  # drawn in its own time
    assert found.page.locator("#over path").count() == 2
    assert changed(found.pixels(), whole) > 0.1
    found.page.click("#whole")
    assert found.page.locator("[aria-pressed=true]").count() == 0
    set_to(found.page, "mix", 100)
    if name == "volume":
        set_to(found.page, "axis", "")
    assert changed(found.pixels(), whole) == 0.0


@pytest.mark.parametrize("name", ["planar", "volume"])
def test_a_click_tells_the_cell_below_it(name, request, seen):
    contents = request.getfixturevalue(name)
    found = seen(contents)
    found.page.click("#worst-after .go >> nth=2")
    if name == "volume":  # a plane that looks at the cell is drawn with others before it: any cell will do
        found.page.click("#whole")
    else:  # the picture is drawn in its own time
        found.page.wait_for_selector("#over path", state="attached")
    box = found.page.locator("#canvas").bounding_box()
    corners = found.page.evaluate(
        "(document.querySelector('#over path') || {getAttribute: () => ''}).getAttribute('d').match(/[-0-9.]+/g)"
    )
    at = [box["width"] / 2, box["height"] / 2]
    if name == "planar":
        at = np.array(corners, dtype=float).reshape(-1, 2).mean(axis=0).tolist()
        found.page.keyboard.press("Escape")
    found.page.mouse.click(box["x"] + at[0], box["y"] + at[1])
    said = found.page.inner_text("#said")
    cell = int(said.split()[1])
    row = int(np.flatnonzero(contents.after.cell == cell)[0])
    assert f"→ {contents.after.shape[row]:.3f}" in said
    if name == "planar":
        assert cell == contents.worst_after[2]["cell"]


@pytest.mark.parametrize("name", ["planar", "volume"])
def test_the_keyboard_does_all_that_the_mouse_does(name, request, seen):
    found = seen(request.getfixturevalue(name))
    pictures = [found.pixels()]
    found.page.focus("#canvas")
    for key in ("ArrowLeft", "+", "ArrowUp", "-", "Shift+ArrowRight", " ", "n", "n", "p"):
        found.page.keyboard.press(key)
        pictures.append(found.pixels())
        assert changed(pictures[-1], pictures[-2]) > 0.005, key
    assert found.page.evaluate("document.activeElement.id") == "canvas"
    found.page.focus("#mix")
    found.page.keyboard.press("Home")
    assert found.page.input_value("#mix") == "0"
    found.page.keyboard.press("ArrowRight")
    assert found.page.input_value("#mix") == "1"
    found.page.keyboard.press("Tab")
    assert found.page.evaluate("document.activeElement.id") == "colour"


def test_held_nodes_are_dots_that_can_be_shown_by_reason(planar, seen):
    found = seen(planar)
    without = found.pixels()
    found.page.check("#held input >> nth=0")
    with_dots = found.pixels()
    assert share(with_dots, (0xE4, 0x57, 0x2E)) > share(without, (0xE4, 0x57, 0x2E)) + 1e-4
    found.page.uncheck("#held input >> nth=0")
    assert changed(found.pixels(), without) == 0.0


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_cut_shows_the_cells_that_it_cuts_and_counts_them(axis, volume, seen):
    found = seen(volume)
    whole = found.pixels()
    set_to(found.page, "axis", axis)
    set_to(found.page, "cut", 400)
    with_cells = found.pixels()
    said = found.page.inner_text("#said")
    place = volume.after.cells.points[:, "xyz".index(axis)]
    (group,) = groups_of(volume.mesh)[0]
    offset = place.min() + 0.4 * np.ptp(place)
    beyond = (place[group.nodes] > offset).sum(axis=1)
    assert said.startswith(f"{np.count_nonzero((beyond > 0) & (beyond < 4)):,} cells are cut at {axis} = ")
    found.page.click("#inner")
    assert changed(found.pixels(), with_cells) > 0.02
    assert changed(with_cells, whole) > 0.02
    set_to(found.page, "axis", "")
    assert changed(found.pixels(), whole) == 0.0


def test_volumes_turn_by_the_mouse_and_look_along_axes(volume, seen):
    found = seen(volume)
    box = found.page.locator("#canvas").bounding_box()
    pictures = [found.pixels()]
    found.page.mouse.move(box["x"] + 300, box["y"] + 200)
    found.page.mouse.down()
    found.page.mouse.move(box["x"] + 380, box["y"] + 230, steps=4)
    found.page.mouse.up()
    pictures.append(found.pixels())
    for axis in "xyz":
        found.page.click(f"[data-look={axis}]")
        pictures.append(found.pixels())
    assert all(changed(one, other) > 0.02 for k, one in enumerate(pictures) for other in pictures[:k])


def test_the_wheel_scrolls_the_page_until_the_picture_is_chosen(planar, seen):
    found = seen(planar)
    box = found.page.locator("#canvas").bounding_box()
    whole = found.pixels()
    found.page.mouse.move(box["x"] + 200, box["y"] + 200)
    found.page.mouse.wheel(0, 40)
    assert changed(found.pixels(), whole) == 0.0
    found.page.focus("#canvas")
    found.page.mouse.wheel(0, -200)
    assert changed(found.pixels(), whole) > 0.05


def test_a_surface_alone_has_a_picture_that_turns(seen):
    mesh = random_mesh(150, seed=2)
    x, y = mesh.points.T
    mesh = gmsnet.Mesh(np.column_stack([x, y, 0.3 * np.sin(3 * x) * y]), mesh.cells)
    report = gmsnet.quality(mesh)
    found = seen(Contents("surface", "", mesh, report, {}, "", worst_cells(mesh, report, count=3)))
    whole = found.pixels()
    assert found.page.locator("#mix").count() == 0
    found.page.focus("#canvas")
    found.page.keyboard.press("ArrowRight")
    assert changed(found.pixels(), whole) > 0.05


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_follows_the_colours_of_the_system(scheme, planar, seen):
    found = seen(planar, color_scheme=scheme)
    paper = found.page.evaluate("getComputedStyle(document.body).backgroundColor")
    bright = sum(map(int, paper.removeprefix("rgb(").removesuffix(")").split(","))) > 380
    assert bright == (scheme == "light")
    assert (found.pixels()[0, 0].sum() > 380) == (scheme == "light")


def test_what_is_printed_is_light(planar, seen):
    found = seen(planar, color_scheme="dark")
    assert found.page.pdf(format="A4").startswith(b"%PDF")
    found.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert found.pixels()[0, 0].sum() > 380
    found.page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert found.pixels()[0, 0].sum() < 380


@pytest.mark.parametrize(
    "harm", ["<script>document.title = 'taken'</script>", '"><img src=x onerror="document.title=\'taken\'">']
)
def test_names_do_nothing_but_be_read(harm, planar, seen):
    contents = replace(planar, title=harm, verdict=harm, notes=[harm], held={harm: planar.held["boundary"]})
    found = seen(replace(contents, faults=[harm], unmended=[(1, harm)], command=harm))
    assert found.page.title() == f"{harm} – gmsnet report"
    assert found.page.inner_text("h1") == harm
    assert found.page.inner_text("#command") == harm
    found.page.check("#held input")


def test_what_is_put_into_a_page_later_does_not_run(planar, browser, tmp_path):
    """The policy holds: scripts and styles that are not the page's are refused, and so is every request."""
    content = b"".join(pieces(planar)).replace(b"</body>", b"<script>document.title='taken'</script></body>")
    path = tmp_path / "changed.html"
    path.write_bytes(content)
    page = browser.new_page()
    page.goto(path.as_uri())
    assert page.title() != "taken"
    refused = page.evaluate("fetch('https://example.org/').then(() => 'answered', () => 'refused')")
    assert refused == "refused"
    page.close()


def test_of_a_mesh_that_is_too_large_the_page_says_what_is_drawn(planar, seen, monkeypatch):
    monkeypatch.setattr("gmsnet.page.scene.MOST_CELLS", 100)
    monkeypatch.setattr("gmsnet.page.selection.FEW_CELLS", 60)
    found = seen(planar)
    assert found.page.inner_text("#remark").startswith(f"The mesh has {len(planar.after.cell):,} cells, more than")
    found.page.click("#worst-after .go >> nth=3")
    assert f" {planar.worst_after[3]['cell']} at " in found.page.inner_text("#said")


def test_without_a_scene_the_page_still_tells_the_figures(planar):
    """A browser that runs no scripts shows all but the picture: it is no part of the scripts."""
    page = Page(b"".join(pieces(planar)))
    assert f"{planar.after.shape.min():.4f}" in page.texts["figures"]
    assert "needs JavaScript" in page.texts["view"]
