"""Files of formats that PyVista has no reader for, as its grids: cells, regions and names arrive, and come back."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from support.entry_points import groups

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.generate import lattice_volume, random_mesh, random_quad_mesh
from gmsnet.io.formats import BY_SUFFIX
from gmsnet.mesh.adapters import to_mesh

pv = pytest.importorskip("pyvista", minversion="0.48")
from gmsnet.pyvista import grid_of  # noqa: E402
from gmsnet.pyvista.grid import read  # noqa: E402

READERS = groups()["pyvista.readers"]
NAMED = random_mesh(40, seed=0)


def test_each_reader_is_one_that_pyvista_lacks():
    from pyvista.core.utilities.reader import CLASS_READERS

    assert len(READERS) >= 4
    for suffix, value in READERS.items():
        module, _, name = value.partition(":")
        assert getattr(import_module(module), name) is read
        assert suffix not in CLASS_READERS
        assert suffix in BY_SUFFIX


def runs(mesh):
    """The kind, nodes and region of each cell in turn."""
    return [
        (block.kind, nodes, region)
        for block in mesh.cells
        for nodes, region in zip(block.nodes.tolist(), block.regions.tolist(), strict=True)
    ]


@pytest.mark.parametrize("suffix", READERS)
@pytest.mark.parametrize("mesh", [NAMED, lattice_volume(2)], ids=["planar", "volume"])
def test_what_is_read_is_what_gmsnet_reads(tmp_path, suffix, mesh):
    path = tmp_path / f"mesh{suffix}"
    if suffix == ".off" and mesh.has_volumes:
        pytest.skip("OFF holds faces alone")
    gmsnet.write(mesh, path)
    found, wanted = read(path), gmsnet.read(path)
    assert np.array_equal(found.points[:, : wanted.points.shape[1]], wanted.points)
    back = to_mesh(found)[0]
    assert runs(back) == runs(wanted)  # one block a marker becomes one block of all lines
    assert back.region_names == wanted.region_names


def test_names_of_regions_survive_copies_and_hold_nodes(tmp_path):
    path = tmp_path / "square.vtu"
    grid = grid_of(NAMED)
    grid.copy().save(path)
    for each in (grid, grid.copy(), pv.read(path)):
        assert set(to_mesh(each)[0].markers) == set(NAMED.markers)
        assert to_mesh(each)[0].region_names == NAMED.region_names


def test_mixed_cells_and_single_precision():
    mesh = random_quad_mesh(30, cells="mixed", seed=1)
    made = gmsnet.Mesh(mesh.points.astype(np.float32), mesh.cells, single=True)
    grid = grid_of(made)
    assert grid.points.dtype == np.float32
    assert grid.n_cells == sum(len(block.nodes) for block in mesh.cells)
    assert to_mesh(grid)[0].single


def test_other_texts_in_the_field_of_names_name_nothing():
    grid = grid_of(NAMED)
    grid.field_data["gmsnet:region_names"] = ["wall", "1 x y", "1 99 nowhere"]
    assert to_mesh(grid)[0].region_names == {}


def test_cells_that_vtk_lacks_are_refused_by_name():
    cells = gmsnet.CellBlock("triangle10", np.arange(10).reshape(1, 10), [0])
    with pytest.raises(FormatError, match="VTK cannot hold cells of type 'triangle10'"):
        grid_of(gmsnet.Mesh(np.random.default_rng(0).random((10, 2)), (cells,)))


def test_real_files(real_meshes: Path):
    for name in ("mesh_NACA0012_inv.su2", "island.mesh", "cleaver_alpha.node", "hemisphere.off"):
        grid, mesh = read(real_meshes / name), gmsnet.read(real_meshes / name)
        assert grid.n_points == len(mesh.points)
        assert grid.n_cells == sum(len(block.nodes) for block in mesh.cells)
