"""Pictures of surfaces: the cells at their places, inverted ones red, feature edges, the worst place."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.generate import cylinder, disturb_on, torus_surface

pytest.importorskip("matplotlib")
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from gmsnet import plot
from gmsnet.plot.surfaces import INVERTED, surface_figure


def drawn(figure):
    """Of each picture in space, its polygons and their colours."""
    maps = [axes for axes in figure.axes if axes.name == "3d"]
    found = [next(each for each in axes.collections if isinstance(each, Poly3DCollection)) for axes in maps]
    return maps, [(each._faces, np.asarray(each._facecolor3d)[:, :3]) for each in found]


@pytest.mark.parametrize("make", [lambda: torus_surface(800, cells="quad"), lambda: cylinder(300)])
def test_cells_and_feature_edges_are_where_they_are(make):
    shaped = disturb_on(make(), 0.3, seed=1)
    after = gmsnet.smooth(shaped.mesh).mesh
    maps, pictures = drawn(surface_figure([shaped.mesh, after]))
    assert len(maps) == 4
    assert maps[0].get_title().startswith(f"before:  1/q  min {gmsnet.quality(shaped.mesh).shape.min():.3f}")
    rows = shaped.mesh.cells[0].nodes
    for mesh, (polygons, colours) in zip((shaped.mesh, after), (pictures[0], pictures[2]), strict=True):
        centres = {tuple(np.round(corners.mean(axis=0), 9)) for corners in mesh.points[rows]}
        black = (colours == 0).all(axis=1)
        faces = [np.asarray(each, dtype=float) for each, dark in zip(polygons, black, strict=True) if not dark]
        shown = [tuple(np.round(each[: rows.shape[1]].mean(axis=0), 9)) for each in faces]
        assert set(shown) <= centres
        assert 0.3 * len(rows) < len(shown) < 0.8 * len(rows)  # those on the other side are hidden
        assert black.any() == ("bottom" in shaped.faces)


def test_turned_cells_are_red(tmp_path):
    mesh = torus_surface(800).mesh
    points, row = mesh.points.copy(), mesh.cells[0].nodes[7]
    points[row[0]] += 2.2 * (points[row[1:]].mean(axis=0) - points[row[0]])
    _, pictures = drawn(surface_figure([mesh, mesh.with_points(points)]))
    hue = np.array(to_rgb(INVERTED)) / max(to_rgb(INVERTED))
    red = [
        np.isclose(colours / colours.max(axis=1)[:, None], hue, atol=1e-6).all(axis=1).sum() for _, colours in pictures
    ]
    assert red[0] == red[1] == 0
    plot.plot_smoothing(mesh, mesh.with_points(points), tmp_path / "a.png")
    plot.plot_quality(mesh, tmp_path / "b.svg")
    assert (tmp_path / "a.png").stat().st_size > 10_000
    assert (tmp_path / "b.svg").stat().st_size > 10_000
