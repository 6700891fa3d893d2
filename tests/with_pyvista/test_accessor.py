"""``mesh.gmsnet``: smoothed, measured and reported in PyVista's manner, each kind of cell that smooth knows."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from support.entry_points import groups, installed

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import disturb, lattice_volume, random_mesh, random_quad_mesh, second_order

pv = pytest.importorskip("pyvista", minversion="0.48")
from gmsnet.pyvista import Accessor, accessor_of, grid_of  # noqa: E402

LATTICE = lattice_volume(3)
CURVED = second_order(random_mesh(60, seed=5))
MESHES = {
    "triangle": random_mesh(200, seed=1),
    "quad": random_quad_mesh(100, seed=2),
    "mixed": random_quad_mesh(100, cells="mixed", seed=3),
    "tetra": disturb(LATTICE, np.setdiff1d(np.arange(len(LATTICE.points)), LATTICE.cells[1].nodes), 0.3, seed=3),
    "triangle6": CURVED,
}


def square():
    """A random square as PolyData, in double precision."""
    mesh = MESHES["triangle"]
    (cells,) = (block.nodes for block in mesh.cells if block.kind == "triangle")
    return pv.PolyData(np.column_stack([mesh.points, np.zeros(len(mesh.points))]), np.insert(cells, 0, 3, axis=1))


@pytest.mark.parametrize("name", MESHES)
def test_each_kind_of_cell_is_smoothed_as_without_pyvista(name):
    mesh = MESHES[name]
    grid = grid_of(mesh)
    before = grid.copy()
    made = grid.gmsnet.smooth()
    wanted = gmsnet.smooth(mesh)
    assert wanted.moved.any()
    assert np.array_equal(made.points[:, : mesh.points.shape[1]], wanted.mesh.points)
    assert type(made) is pv.UnstructuredGrid
    assert grid == before
    assert np.array_equal(made.cells, before.cells)
    assert made.cell_data.keys() == before.cell_data.keys()


def test_polydata_chains_and_stays_as_it_is():
    mesh = square()
    before = mesh.copy()
    made = mesh.gmsnet.smooth("laplacian", max_sweeps=3).gmsnet.smooth("barrier", max_sweeps=2)
    assert type(made) is pv.PolyData
    assert mesh == before
    assert not np.array_equal(made.points, before.points)
    assert gmsnet.quality(made).shape.min() >= gmsnet.quality(before).shape.min()


def test_in_place_gives_the_same_object_the_new_points():
    mesh, twin = square(), square()
    faces = mesh.faces.copy()
    assert mesh.gmsnet.smooth(inplace=True) is mesh
    assert np.array_equal(mesh.points, twin.gmsnet.smooth().points)
    assert np.array_equal(mesh.faces, faces)


def test_single_precision_stays():
    mesh = square()
    mesh.points = mesh.points.astype(np.float32)
    for inplace in (False, True):
        made = mesh.gmsnet.smooth(inplace=inplace)
        assert made.points.dtype == np.float32
        assert gmsnet.quality(made).inverted == 0


def test_the_report_has_everything_and_the_data_set():
    mesh, looks = square(), []
    result = mesh.gmsnet.report("laplacian", max_sweeps=4, callback=lambda sweep: looks.append(sweep.index))
    assert isinstance(result, gmsnet.SmoothResult)
    assert type(result.mesh) is pv.PolyData
    assert looks == [sweep.index for sweep in result.history]
    assert len(looks) > 0


def test_a_true_answer_of_the_callback_stops():
    assert square().gmsnet.report("laplacian", callback=lambda sweep: True).sweeps == 1


@pytest.mark.parametrize("shown", [False, True])
def test_the_progress_bar_is_shown_if_asked_for(capfd, monkeypatch, shown):
    monkeypatch.setenv("FORCE_COLOR", "1")  # Rich takes the stream for a terminal then
    square().gmsnet.smooth("laplacian", max_sweeps=2)  # whatever is to be compiled
    capfd.readouterr()
    square().gmsnet.smooth("laplacian", max_sweeps=2, progress_bar=shown)
    out, err = capfd.readouterr()
    assert out == ""
    assert ("sweep 2 of at most 2" in err) is shown


@pytest.mark.parametrize("name", MESHES)
def test_quality_is_a_cell_array(name):
    mesh = MESHES[name]
    made = grid_of(mesh).gmsnet.quality()
    report = gmsnet.quality(mesh)
    wanted = np.full(made.n_cells, np.nan)
    wanted[report.cell] = report.shape
    assert np.array_equal(made.cell_data["gmsnet_shape"], wanted, equal_nan=True)


def test_quality_finds_its_cells_behind_polylines():
    """A line of three nodes is two cells of a Mesh; faces keep their numbers in the data set all the same."""
    mesh = square()
    faces = mesh.faces.reshape(-1, 4)[:, 1:]
    both = pv.PolyData(mesh.points, faces=mesh.faces, lines=[3, *faces[0].tolist()])
    before = both.copy()
    made = both.gmsnet.quality(["shape", "valid"])
    assert both == before
    shape = made.cell_data["gmsnet_shape"]
    assert np.isnan(shape[0])
    assert np.array_equal(shape[1:], gmsnet.quality(mesh).shape)
    assert made.cell_data["gmsnet_valid"][1:].all()
    assert both.gmsnet.quality(inplace=True) is both
    assert np.array_equal(both.cell_data["gmsnet_shape"], shape, equal_nan=True)


def test_all_measures_and_unknown_ones():
    made = square().gmsnet.quality("all")
    assert {"gmsnet_min_angle", "gmsnet_shape", "gmsnet_scaled_jacobian", "gmsnet_valid"} <= set(made.cell_data.keys())
    assert "gmsnet_volume" in grid_of(MESHES["tetra"]).gmsnet.quality("all").cell_data
    with pytest.raises(InputError, match=r"unknown measure 'shap': these cells have .*shape"):
        square().gmsnet.quality("shap")


def test_surfaces_in_space_move_and_strips_are_refused_in_words():
    sphere = pv.Sphere()
    made = sphere.gmsnet.smooth()
    assert made.n_cells == sphere.n_cells
    assert (made.points != sphere.points).any()
    assert gmsnet.quality(made).shape.min() >= gmsnet.quality(sphere).shape.min()
    with pytest.raises(InputError, match=r"call \.triangulate\(\) first"):
        pv.Sphere().strip().gmsnet.quality()


CODE = """
import sys, pyvista as pv
assert "gmsnet" not in sys.modules and "numba" not in sys.modules
mesh = pv.Plane(i_resolution=8, j_resolution=8).triangulate()
assert "gmsnet" in dir(mesh) and "gmsnet" not in sys.modules
print(type(mesh.gmsnet.smooth()).__name__, type(mesh.cast_to_unstructured_grid().gmsnet).__name__)
try:
    pv.ImageData(dimensions=(3, 3, 1)).gmsnet
except AttributeError:
    print("no images")
grid = pv.read(sys.argv[1])
print(grid.n_points, grid.gmsnet.report(fixed="left").moved.any(), "meshio" in sys.modules)
"""


def test_pyvista_finds_it_by_the_entry_points_alone(tmp_path):
    path = tmp_path / "square.su2"
    gmsnet.write(MESHES["triangle"], path)
    done = subprocess.run(
        [sys.executable, "-c", CODE, str(path)], env=installed(tmp_path), capture_output=True, text=True, check=True
    )
    points = len(MESHES["triangle"].points)
    assert done.stdout.splitlines() == ["PolyData Accessor", "no images", f"{points} True False"]


def test_the_entry_points_name_what_there_is():
    assert groups()["pyvista.accessors"] == {"gmsnet": Accessor.__module__.rpartition(".")[0]}


@pytest.mark.parametrize(
    ("library", "said"),
    [
        ("raise ModuleNotFoundError('no', name='pyvista')", "is not installed"),
        ("__version__ = '0.47.9'", "no accessors"),
    ],
)
def test_without_a_pyvista_that_takes_accessors_the_mend_is_named(tmp_path, library, said):
    (tmp_path / "pyvista.py").write_text(library)
    code = "import gmsnet\ntry:\n    import gmsnet.pyvista\nexcept gmsnet.MissingExtraError as error:\n    print(error)"
    done = subprocess.run(
        [sys.executable, "-c", code], env=installed(tmp_path), capture_output=True, text=True, check=True
    )
    assert said in done.stdout
    assert "pip install 'pyvista>=0.48'" in done.stdout


def test_the_accessor_for_type_checkers_is_the_same():
    grid = grid_of(MESHES["triangle"])
    made = accessor_of(grid).smooth(max_sweeps=2)
    assert isinstance(accessor_of(grid), Accessor)
    assert np.array_equal(made.points, grid.gmsnet.smooth(max_sweeps=2).points)
