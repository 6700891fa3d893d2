"""Meshes of tetrahedra in every form: what goes in comes out, smoothed, with everything else as it was."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import disturb, lattice_volume
from gmsnet.mesh.adapters import to_mesh

LATTICE = lattice_volume(3)
OUTER = np.unique(LATTICE.cells[1].nodes)
INNER = np.setdiff1d(np.arange(len(LATTICE.points)), OUTER)
MESH = disturb(LATTICE, INNER, 0.3, seed=3)
POINTS, TETRA, FACES = MESH.points, MESH.cells[0].nodes, MESH.cells[1].nodes
WANTED = gmsnet.smooth(MESH).mesh.points


def check_points(found):
    """Those of the Mesh: the boundary to the bit, the inside moved alike."""
    assert np.array_equal(found, WANTED)
    assert np.array_equal(found[OUTER], POINTS[OUTER])
    assert (found[INNER] != POINTS[INNER]).any(axis=1).all()


@pytest.mark.parametrize(
    ("cells", "make"),
    [
        ([("tetra", TETRA), ("triangle", FACES)], tuple),
        ([("tetra", TETRA)], list),
        ({"tetra": TETRA, "triangle": FACES}, tuple),
        (("tetra", TETRA), tuple),
    ],
)
def test_arrays(cells, make):
    found = gmsnet.smooth(make((POINTS, cells))).mesh
    assert type(found) is make
    check_points(found[0])
    assert found[1] is cells


def test_single_precision_stays():
    points, cells = gmsnet.smooth((POINTS.astype(np.float32), [("tetra", TETRA)])).mesh
    assert points.dtype == np.float32
    assert gmsnet.quality((points, cells)).inverted == 0


def test_a_mapping_with_regions_and_markers():
    regions = np.where(POINTS[TETRA].mean(axis=1)[:, 0] < 0.5, 1, 2)
    thing = {"points": POINTS, "cells": {"tetra": TETRA}, "regions": regions, "markers": {"probe": INNER[:2]}}
    result = gmsnet.smooth(thing, fixed="probe")
    assert type(result.mesh) is dict
    assert {name: value is thing[name] for name, value in result.mesh.items()} == {
        "points": False, "cells": True, "regions": True, "markers": True,
    }  # fmt: skip
    faces = np.sort(TETRA[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    _, number = np.unique(faces, axis=0, return_inverse=True)
    low, high = np.full(number.max() + 1, 9), np.zeros(number.max() + 1, dtype=int)
    np.minimum.at(low, number.ravel(), np.repeat(regions, 4))
    np.maximum.at(high, number.ravel(), np.repeat(regions, 4))
    between = np.unique(faces[(low < high)[number.ravel()]])
    still = np.union1d(np.union1d(OUTER, between), INNER[:2])
    assert len(between) > 0
    assert np.array_equal(result.mesh["points"][still], POINTS[still])
    assert result.moved.sum() > 0


def test_tetrahedra_without_a_name_are_not_guessed():
    with pytest.raises(InputError, match=r'may be quads or tetrahedra .* \[\("tetra", cells\)\]'):
        gmsnet.smooth((POINTS, TETRA))


@pytest.mark.parametrize("library", ["meshio", "meshlane"])
def test_meshio(library):
    meshio = pytest.importorskip(library)
    tags = [np.ones(len(TETRA), dtype=int), MESH.cells[1].regions.copy()]
    thing = meshio.Mesh(
        POINTS.copy(), [("tetra", TETRA.copy()), ("triangle", FACES.copy())],
        point_data={"speed": POINTS[:, 0].copy()}, cell_data={"gmsh:physical": tags},
        field_data={"left": np.array([1, 2])},
    )  # fmt: skip
    found = gmsnet.smooth(thing).mesh
    assert type(found) is type(thing)
    check_points(found.points)
    assert np.array_equal(thing.points, POINTS)
    assert [(b.type, b.data.tolist()) for b in found.cells] == [("tetra", TETRA.tolist()), ("triangle", FACES.tolist())]
    assert np.array_equal(found.point_data["speed"], POINTS[:, 0])
    assert set(to_mesh(thing)[0].region_names) == {(2, 1)}


def test_pyvista():
    pyvista = pytest.importorskip("pyvista")
    cells = np.concatenate([np.insert(TETRA, 0, 4, axis=1).ravel(), np.insert(FACES, 0, 3, axis=1).ravel()])
    types = np.repeat([pyvista.CellType.TETRA, pyvista.CellType.TRIANGLE], [len(TETRA), len(FACES)])
    grid = pyvista.UnstructuredGrid(cells, types, POINTS.copy())
    grid.cell_data["number"] = np.arange(len(types))
    found = gmsnet.smooth(grid).mesh
    assert type(found) is type(grid)
    check_points(np.asarray(found.points))
    assert np.array_equal(grid.points, POINTS)
    assert np.array_equal(found.cells, grid.cells)
    assert np.array_equal(found.celltypes, grid.celltypes)
    assert np.array_equal(found.cell_data["number"], np.arange(len(types)))


def test_tetrahedra_need_three_coordinates_that_vary():
    for points in (POINTS[:, :2], POINTS * [1.0, 1.0, 0.0]):
        with pytest.raises(InputError, match="the mesh has volumes, but all its nodes lie in one plane"):
            gmsnet.smooth((points, [("tetra", TETRA)]))
        with pytest.raises(InputError, match="the mesh has volumes, but all its nodes lie in one plane"):
            gmsnet.quality((points, [("tetra", TETRA)]))
