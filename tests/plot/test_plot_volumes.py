"""Pictures of meshes of tetrahedra: the worst cells at their places, in their colours, and the right histograms."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import disturb, lattice_volume, random_volume
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

pytest.importorskip("matplotlib")
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from gmsnet import plot
from gmsnet.plot.view import INVERTED
from gmsnet.plot.volumes import WORST, volume_figure

MESH = random_volume(80, seed=1)


def maps_of(figure):
    return [axes for axes in figure.axes if axes.name == "3d"]


def cells_of(axes):
    """Corners of the facets of the worst cells, four each, and their colours."""
    shell, cells = (each for each in axes.collections if isinstance(each, Poly3DCollection))
    assert len(shell._faces) > 0
    return np.asarray(cells._faces).reshape(-1, 4, 3, 3), cells._facecolor3d[
        ::4, :3
    ]  # as given, before they are sorted by depth


def test_the_worst_cells_stand_where_they_are():
    after = gmsnet.smooth(MESH).mesh
    figure = volume_figure([MESH, after])
    rows = gmsnet.quality(MESH).worst(WORST)
    for axes, mesh in zip(maps_of(figure), (MESH, after), strict=True):
        facets, _ = cells_of(axes)
        places = mesh.points[mesh.cells[0].nodes[rows]].mean(axis=1)
        assert facets.mean(axis=(1, 2)) == pytest.approx(places)
        assert f"min {gmsnet.quality(mesh).shape.min():.3f}" in axes.get_title()
    labels = [axes.get_xlabel() for axes in figure.axes if axes.get_ylabel() == "share of cells (%)"]
    assert [label.split(";")[0] for label in labels] == [
        "η", "smallest dihedral angle (°)", "greatest dihedral angle (°)",
    ]  # fmt: skip


def test_inverted_cells_are_red_and_no_others():
    lattice = lattice_volume(3)
    inner = np.setdiff1d(np.arange(len(lattice.points)), lattice.cells[1].nodes)
    tangled = disturb(lattice, inner, 0.8, keep_valid=False)
    report = gmsnet.quality(tangled)
    assert 0 < report.inverted < WORST
    _, colours = cells_of(maps_of(volume_figure([tangled]))[0])
    red = np.isclose(colours, to_rgb(INVERTED)).all(axis=1)
    assert red.tolist() == (~report.valid[report.worst(WORST)]).tolist()


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")])
def test_formats(tmp_path, suffix, start):
    path = tmp_path / f"picture{suffix}"
    plot.plot_quality(MESH, path)
    assert path.read_bytes().startswith(start)


def test_volumes_of_other_kinds(tmp_path):
    corners = [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    mesh = Mesh(np.array(corners, dtype=float), (CellBlock("hexahedron", [list(range(8))], [0]),))
    plot.plot_quality(mesh, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    twice = Mesh(mesh.points, (CellBlock("hexahedron", [[0, 1, 2, 3, 4, 0, 1, 2]], [0]),))
    with pytest.raises(InputError, match="this mesh has none that is measured"):
        plot.plot_quality(twice, tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists()
