"""Pictures: the right cells in the right colours, in every format, without a display, at any size."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from gmsnet.errors import InputError, MissingExtraError
from gmsnet.generate import random_mesh, random_quad_mesh, structured_mesh
from gmsnet.generate.curved import disc_of_quads, on_circle, second_order
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("matplotlib")
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from gmsnet import plot
from gmsnet.plot import smoothing
from gmsnet.plot.view import BAD_TO_GOOD, INVERTED, PARTS, View

SMALL = random_mesh(60, seed=2)
LARGE = random_mesh(4000, seed=2)


def view(mesh, title=""):
    return View.of(mesh, title, plot.AFTER)


def cells_of(axes):
    """The collection of triangles: the last polygons that were drawn."""
    return [each for each in axes.collections if isinstance(each, PolyCollection)][-1]


def blueness(colour):
    return colour[2] - (colour[0] + colour[1]) / 2


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".SVG", b"<?xml"), (".pdf", b"%PDF")])
def test_formats(tmp_path, suffix, start):
    path = tmp_path / f"picture{suffix}"
    plot.plot_smoothing(SMALL, SMALL.with_points(SMALL.points * 1.1), path)
    assert path.read_bytes().startswith(start)
    plot.plot_quality(SMALL, path)
    assert path.read_bytes().startswith(start)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def test_good_cells_are_blue_bad_ones_yellow_inverted_ones_red():
    points = [[0, 0], [1, 0], [0.5, 0.866], [0.5, -0.02], [4, 0], [5, 0], [4.5, 0.9], [4.5, 1.2]]
    # An equilateral triangle with a sliver below; beside them, a node pulled out through its star's rim.
    cells = [[0, 1, 2], [0, 3, 1], [4, 5, 7], [5, 6, 7], [6, 4, 7]]
    mesh = Mesh(np.array(points), (CellBlock("triangle", np.array(cells), np.zeros(5)),))
    drawn = view(mesh)
    assert drawn.report.sign.tolist() == [1, 1, 1, -1, -1]
    cells_drawn = cells_of(smoothing._figure([drawn]).axes[0])
    order = np.argsort(-drawn.report.shape, kind="stable").tolist()
    colours = dict(zip(order, cells_drawn.get_facecolor().tolist(), strict=True))
    assert blueness(colours[0]) > 0.2
    assert blueness(colours[1]) < -0.4
    assert tuple(colours[3][:3]) == pytest.approx(to_rgb(INVERTED))
    assert tuple(colours[4][:3]) == pytest.approx(to_rgb(INVERTED))


def test_the_scale_runs_from_yellow_to_blue():
    shades = [blueness(to_rgb(colour)) for colour in BAD_TO_GOOD]
    assert shades == sorted(shades)
    assert shades[0] < -0.5 < 0.2 < shades[-1]


def test_every_cell_is_drawn_once_and_the_worst_on_top():
    axes = smoothing._figure([view(SMALL)]).axes[0]
    drawn = np.array([path.vertices[:3].mean(axis=0) for path in cells_of(axes).get_paths()])
    report = view(SMALL).report
    centres = report.centre[np.argsort(-report.shape, kind="stable")][:, :2]
    assert drawn == pytest.approx(centres)


def test_a_zoom_on_the_worst_cell_where_cells_are_small():
    assert smoothing._surroundings(view(SMALL), 1.0) is None
    large = view(LARGE)
    window = smoothing._surroundings(large, 1.0)
    worst = large.report.centre[large.report.worst(1)[0], :2]
    assert (window[0] <= worst).all()
    assert (worst <= window[1]).all()
    assert (window[0] >= -1e-12).all()
    assert (window[1] <= 1 + 1e-12).all()
    inside = ((large.report.centre[:, :2] >= window[0]) & (large.report.centre[:, :2] <= window[1])).all(axis=1)
    assert 50 < inside.sum() < 300
    titles = [axes.get_title() for axes in smoothing._figure([large]).axes]
    assert "around its worst cell" in titles


def test_the_titles_name_the_figures():
    after = SMALL.with_points(SMALL.points)
    figure = smoothing._figure([view(SMALL, "before"), view(after, "after")])
    report = view(SMALL).report
    text = f"1/q  min {report.shape.min():.3f}, mean {report.shape.mean():.3f}"
    assert [axes.get_title() for axes in figure.axes[:2]] == [f"before:  {text}", f"after:  {text}"]


def test_histograms_count_every_cell():
    figure = smoothing._figure([view(SMALL, "before"), view(SMALL, "after")])
    for axes in figure.axes[-2:]:
        bars = sum(patch.get_height() for patch in axes.patches if hasattr(patch, "get_height"))
        assert bars == pytest.approx(200)


@pytest.mark.parametrize(("mesh", "best"), [
    (SMALL, 60.0), (structured_mesh(6), 90.0), (random_quad_mesh(60, cells="mixed", seed=1), 90.0)
])  # fmt: skip
def test_histograms_of_angles_go_to_the_best_angle(mesh, best):
    axes = smoothing._figure([view(mesh)]).axes[-1]
    assert axes.get_xlim()[1] == best
    bars = sum(patch.get_height() for patch in axes.patches if hasattr(patch, "get_height"))
    assert bars == pytest.approx(100)


@pytest.mark.parametrize("flat", [0, 1, 2])
def test_any_plane(flat):
    planar = SMALL.points[:, :2]
    mesh = Mesh(np.insert(planar, flat, 3.0, axis=1), SMALL.cells)
    assert view(mesh).points.tolist() == planar.tolist()
    assert view(mesh).report.shape == pytest.approx(view(SMALL).report.shape, rel=1e-12)


@pytest.mark.parametrize("stretch", [(9.0, 1.0), (1.0, 9.0), (1e-9, 1e-9), (1e9, 1e9)])
def test_any_proportions(tmp_path, stretch):
    mesh = SMALL.with_points(SMALL.points * np.resize([*stretch, 1.0], SMALL.points.shape[1]))
    plot.plot_smoothing(mesh, mesh, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_other_cells_are_shown_too(tmp_path):
    points = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
    other = CellBlock("polygon", np.array([[0, 1, 5, 4, 3]]), np.zeros(1))
    quads = CellBlock("quad", np.array([[0, 1, 4, 3]]), np.zeros(1))
    triangles = CellBlock("triangle", np.array([[1, 2, 5], [1, 5, 4]]), np.zeros(2))
    mesh = Mesh(np.array(points), (other, quads, triangles))
    collections = [
        each for each in smoothing._figure([view(mesh)]).axes[0].collections if isinstance(each, PolyCollection)
    ]
    assert [len(each.get_paths()) for each in collections] == [1, 3]


def test_the_mesh_after_is_wound_as_the_mesh_before(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(smoothing, "_figure", drawn.extend)
    monkeypatch.setattr(smoothing, "_save", lambda figure, path: None)
    points = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    before = Mesh(points, (CellBlock("triangle", np.array([[0, 1, 2], [1, 3, 2]]), np.zeros(2)),))
    plot.plot_smoothing(before, before.with_points(points * [-1, 1]), tmp_path / "p.png")
    assert [each.report.sign.tolist() for each in drawn] == [[1, 1], [-1, -1]]
    other = Mesh(points, (CellBlock("triangle", np.array([[0, 1, 2]]), np.zeros(1)),))
    with pytest.raises(InputError, match="two meshes of the same cells"):
        plot.plot_smoothing(before, other, tmp_path / "p.png")


@pytest.mark.long
def test_a_hundred_thousand_cells(tmp_path):
    mesh = random_mesh(50_000, seed=1)
    assert len(mesh.cells[0].nodes) > 99_000
    plot.plot_smoothing(mesh, mesh, tmp_path / "large.svg")
    assert 10_000 < (tmp_path / "large.svg").stat().st_size < 20_000_000


@pytest.mark.parametrize(
    ("mesh", "name", "message"),
    [
        (SMALL, "p.bmp", r"the suffix '\.bmp': name it \.png, \.svg or \.pdf"),
        (SMALL, "p", "no suffix"),
        (SMALL, "nowhere/p.png", "does not exist"),
        (Mesh(np.eye(3), (CellBlock("line", np.array([[0, 1]]), np.zeros(1)),)), "p.png", "has none"),
    ],
)
def test_what_cannot_be_drawn(tmp_path, mesh, name, message):
    with pytest.raises(InputError, match=message):
        plot.plot_quality(mesh, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_without_matplotlib_the_command_to_install_it_is_named(monkeypatch):
    for name in [name for name in sys.modules if name.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)

    class Missing:
        def find_spec(self, name, path=None, target=None):
            if name == "matplotlib":
                raise ModuleNotFoundError("No module named 'matplotlib'", name="matplotlib")

    monkeypatch.setattr(sys, "meta_path", [Missing(), *sys.meta_path])
    with pytest.raises(MissingExtraError, match=r'extra "view", .* by pip install "\.\[view\]"'):
        plot.check_target("p.png")
    with pytest.raises(MissingExtraError, match=r'extra "view", .* by pip install "\.\[view\]"'):
        plot.new_figure(1.0, 1.0)


def test_no_global_state_and_no_display(tmp_path):
    code = (
        "import sys; from gmsnet.generate import random_mesh; from gmsnet.plot import plot_quality;"
        "assert 'matplotlib' not in sys.modules;"
        f"plot_quality(random_mesh(20), {str(tmp_path / 'p.png')!r});"
        "print('matplotlib.pyplot' in sys.modules)"
    )
    env = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "MPLBACKEND")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env, check=True)
    assert done.stdout.strip() == "False"


def test_edges_with_a_middle_node_are_drawn_through_it():
    mesh = second_order(disc_of_quads(2), quads="quad8", project=on_circle(1.0), bend=0.1)
    shown = View.of(mesh)
    rows = np.arange(len(shown.corners))
    drawn = shown.outlines(rows).reshape(len(rows), 4, PARTS, 2)
    quads = next(block.nodes for block in mesh.cells if block.kind == "quad8")
    assert (drawn[:, :, 0] == mesh.points[quads[:, :4]]).all()
    assert np.abs(drawn[:, :, PARTS // 2] - mesh.points[quads[:, 4:]]).max() < 1e-15
    between = 0.375 * mesh.points[quads[:, :4]] - 0.125 * mesh.points[np.roll(quads[:, :4], -1, axis=1)]
    assert np.abs(drawn[:, :, PARTS // 4] - between - 0.75 * mesh.points[quads[:, 4:]]).max() < 1e-15
    lines = next(block.nodes for block in mesh.cells if block.kind == "line3")
    curves = np.array(shown.curves(np.ones(len(lines), dtype=bool)))
    assert np.abs(curves[:, [0, PARTS // 2, PARTS]] - mesh.points[lines[:, [0, 2, 1]]]).max() < 1e-15


def test_straight_cells_and_edges_beside_bent_ones_stay_straight():
    bent = second_order(random_mesh(40, seed=1), bend=0.2)
    count = len(bent.points)
    straight = CellBlock("triangle", np.array([[count, count + 1, count + 2]]), np.zeros(1))
    points = np.concatenate([bent.points, [[2.0, 0.0], [3.0, 0.0], [2.0, 1.0]]])
    mesh = Mesh(points, (*bent.cells, straight))
    shown = View.of(mesh)
    (last,) = shown.outlines(np.arange(len(shown.corners)))[(shown.corners >= count).all(axis=1)]
    assert (last[[0, PARTS, 2 * PARTS]] == points[-3:]).all()
    assert (last[:PARTS, 1] == 0.0).all()
    alone = View.of(Mesh(mesh.points, mesh.cells[-1:]))
    assert alone.outlines(np.array([0])).shape == (1, 3, 2)


def test_triangles_of_second_order_beside_quads():
    mesh = second_order(random_quad_mesh(60, cells="mixed", seed=1), quads="quad8", bend=0.2)
    shown = View.of(mesh)
    triangles = next(block.nodes for block in mesh.cells if block.kind == "triangle6")
    drawn = shown.outlines(np.arange(len(shown.corners)))[shown.corners[:, 2] == shown.corners[:, 3]]
    drawn = drawn.reshape(len(triangles), 4, PARTS, 2)
    assert len(triangles) > 5
    assert np.abs(drawn[:, [0, 1, 3], PARTS // 2] - mesh.points[triangles[:, 3:]]).max() < 1e-15
    assert np.abs(drawn[:, 2] - mesh.points[triangles[:, 2]][:, None]).max() < 1e-15
