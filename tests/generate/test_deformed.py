from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import moved_hole_mesh, sheared_mesh, swirled_mesh, terrain_mesh, zigzag_mesh

GRIDS = [sheared_mesh, swirled_mesh, zigzag_mesh]


@pytest.mark.parametrize("cells", ["triangle", "quad"])
@pytest.mark.parametrize("make", GRIDS)
def test_grids_are_deformed_inside_alone_and_stay_valid(make, cells):
    mesh = make(20, 30, cells=cells)
    even = sheared_mesh(20, 30, amplitude=0.0, cells=cells)
    assert mesh.cells[0].kind == cells
    assert len(mesh.cells[0].nodes) == 20 * 30 * (2 if cells == "triangle" else 1)
    rim = (even.points == 0).any(axis=1) | (even.points == 1).any(axis=1)
    np.testing.assert_allclose(mesh.points[rim], even.points[rim], atol=1e-15)
    report = gmsnet.quality(mesh)
    assert report.valid.all()
    assert report.shape.mean() < gmsnet.quality(even).shape.mean() - 0.01
    assert {"bottom", "right", "top", "left"} <= set(mesh.markers)


def test_moved_holes_are_where_they_should_be():
    mesh = moved_hole_mesh(0.05, shift=1.0, squash=0.5)
    hole = mesh.points[mesh.markers["hole"]]
    np.testing.assert_allclose(hole.mean(axis=0), [0.65, 0.5], atol=1e-3)
    np.testing.assert_allclose(np.ptp(hole, axis=0), [0.3, 0.15], rtol=0.02)
    assert gmsnet.quality(moved_hole_mesh(0.05, shift=0.5)).valid.all()


def test_terrain_is_stretched_along_its_lines():
    mesh = terrain_mesh(6, ratio=5.0, seed=2)
    assert gmsnet.quality(mesh).valid.all()
    assert gmsnet.quality(mesh).shape.mean() < 0.6
    assert terrain_mesh(6, ratio=5.0, seed=2).points.tobytes() == mesh.points.tobytes()


@pytest.mark.parametrize(
    "call",
    [
        lambda: sheared_mesh(1),
        lambda: sheared_mesh(4, amplitude=1.0),
        lambda: sheared_mesh(4, waves=0),
        lambda: sheared_mesh(4, cells="hexagon"),
        lambda: swirled_mesh(4, angle=9.0),
        lambda: zigzag_mesh(4, height=0.5),
        lambda: moved_hole_mesh(1.0),
        lambda: terrain_mesh(0),
        lambda: terrain_mesh(ratio=0.5),
    ],
)
def test_numbers_out_of_range_are_refused(call):
    with pytest.raises(InputError):
        call()
