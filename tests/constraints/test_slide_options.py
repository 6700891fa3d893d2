"""What may be given as slide=, feature_angle= and geometry=."""

from __future__ import annotations

import numpy as np
import pytest

from gmsnet import CellBlock, InputError, Mesh
from gmsnet.constraints.geometry import Polylines
from gmsnet.constraints.options import check_slide
from gmsnet.generate.random import random_mesh

MESH = random_mesh(20, "plate")


@pytest.mark.parametrize(
    ("slide", "names"),
    [
        (None, ()), (False, ()), (True, None), (np.True_, None), ("all", None), (["top", "all"], None),
        ("hole", ("hole",)), (["hole", "top", "hole"], ("hole", "top")), (("top",), ("top",)), ({"top"}, ("top",)),
        (np.array(["left", "top"]), ("left", "top")),
    ],
)  # fmt: skip
def test_forms_of_slide(slide, names):
    assert check_slide(MESH, slide) == names


@pytest.mark.parametrize("slide", [1, 0.5, [], [1], {"hole": 1}, b"hole", object()])
def test_other_forms_are_refused(slide):
    with pytest.raises(InputError, match="slide must be None, True, 'all' or names of markers"):
        check_slide(MESH, slide)


def test_unknown_names():
    with pytest.raises(InputError, match=r"no marker 'hol' to slide on; did you mean 'hole'\? it has 'domain', "):
        check_slide(MESH, ["top", "hol"])
    bare = Mesh(MESH.points, (CellBlock("triangle", MESH.cells[0].nodes, np.zeros(len(MESH.cells[0].nodes))),))
    with pytest.raises(InputError, match="the mesh has no markers"):
        check_slide(bare, "hole")


@pytest.mark.parametrize("angle", [0, 180, -1.0, 1e9, np.nan, True, None, "30"])
def test_angles_out_of_range(angle):
    with pytest.raises(InputError, match="must lie between 0 and 180, got"):
        check_slide(MESH, None, angle)


def test_geometry_needs_its_two_methods():
    assert check_slide(MESH, True, 30, Polylines({"hole": [[0.0, 0.0], [1.0, 1.0]]})) is None
    with pytest.raises(InputError, match="ndarray has no project"):
        check_slide(MESH, True, 30.0, np.zeros(3))


def test_meshes_in_space():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1]], float)
    mesh = Mesh(points, (CellBlock("triangle", [[0, 1, 2], [1, 3, 2]], [0, 0]),))
    assert check_slide(mesh, None) == ()
    assert check_slide(mesh, True) is None
    assert check_slide(mesh, True, 30.0, Polylines({"hole": [[0.0, 0.0], [1.0, 1.0]]})) is None
