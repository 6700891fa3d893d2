from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.errors import InputError


@pytest.mark.parametrize(("spacing", "each"), [(0.5, 40), (1.0, 20), (2.0, 10)])
@pytest.mark.parametrize("boundary", ["even", "random"])
def test_spacing_on_the_boundary_of_a_square(spacing, each, boundary):
    mesh = gmsnet.random_mesh(400, boundary=boundary, boundary_spacing=spacing, seed=3)
    on_side = np.sort(mesh.points[mesh.markers["bottom"], 0])
    if boundary == "even":
        assert on_side == pytest.approx(np.linspace(0, 1, each + 1))
    else:
        assert len(on_side) >= each + 1  # more where an edge of the boundary was split to be an edge of the mesh
    assert len(mesh.points) - len(np.unique(mesh.cells[1].nodes)) == 400


def test_spacing_on_a_circle():
    mesh = gmsnet.random_mesh(400, "circle", boundary_spacing=2.0)
    assert len(mesh.markers["circle"]) == 35  # π / (2·√(π/4/400))


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, np.inf])
def test_bad_spacing_is_named(spacing):
    with pytest.raises(InputError, match="the spacing on the boundary must be a positive number"):
        gmsnet.random_mesh(10, boundary_spacing=spacing)
