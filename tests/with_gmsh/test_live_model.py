"""The mesh of a live model: each kind of cell, coordinates bit for bit, parameters, what is held, what is refused."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree

import gmsnet
import gmsnet.gmsh
from gmsnet.errors import InputError
from gmsnet.gmsh.live import read
from with_gmsh.conftest import ball_in_box, inside, places, plate, throw

KINDS = {
    "triangle": lambda gmsh: plate(gmsh),
    "quad": lambda gmsh: plate(gmsh, recombine=45.0),
    "mixed": lambda gmsh: plate(gmsh, recombine=12.0),
    "triangle, built-in kernel": lambda gmsh: plate(gmsh, kernel="geo"),
    "tetra": lambda gmsh: ball_in_box(gmsh),
}


def check_read_back(gmsh, result):
    """The model has the result's coordinates, all digits of them."""
    tags, points = places(gmsh)
    own = result.mesh.point_data["gmsh:node"]
    order = np.argsort(own)
    assert np.array_equal(own[order], tags)
    assert np.array_equal(result.points[order], points)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_cell_becomes_better_and_is_set_back_exactly(gmsh, kind):
    KINDS[kind](gmsh)
    space = kind == "tetra"
    throw(gmsh, 3 if space else 2, 0.02, axes=3 if space else 2)
    tags, before = places(gmsh)
    elements = [each.tolist() for each in gmsh.model.mesh.getElements()[2]]
    result = gmsnet.gmsh.smooth()
    check_read_back(gmsh, result)
    assert result.after.inverted == 0
    assert result.after.shape.min() > result.before.shape.min()
    assert [each.tolist() for each in gmsh.model.mesh.getElements()[2]] == elements
    on_shapes = np.setdiff1d(tags, inside(gmsh, 3 if space else 2))
    still = np.searchsorted(tags, on_shapes)
    assert np.array_equal(places(gmsh)[1][still], before[still])
    kinds = {block.kind for block in result.mesh.cells if block.dimension == (3 if space else 2)}
    assert kinds == {"mixed": {"triangle", "quad"}}.get(kind, {kind.partition(",")[0]})


@pytest.mark.parametrize("kind", KINDS)
def test_what_follows_keeps_the_nodes(gmsh, kind):
    """Gmsh puts nodes back by their parameters when it relocates them or raises the order."""
    KINDS[kind](gmsh)
    throw(gmsh, 3 if kind == "tetra" else 2, 0.02, axes=3 if kind == "tetra" else 2)
    gmsnet.gmsh.smooth()
    points = places(gmsh)[1]
    gmsh.model.mesh.relocateNodes()
    assert np.abs(places(gmsh)[1] - points).max() < 1e-14
    gmsh.model.mesh.setOrder(2)
    assert cKDTree(places(gmsh)[1]).query(points)[0].max() < 1e-14  # tags are others then


def test_without_parameters_gmsh_would_put_nodes_back(gmsh):
    """Why parameters are given at all: the trap is there still."""
    plate(gmsh)
    tags, before = places(gmsh)
    throw(gmsh, 2, 0.02)
    assert np.abs(places(gmsh)[1] - before).max() > 0.01
    gmsh.model.mesh.relocateNodes()
    assert np.abs(places(gmsh)[1] - before).max() < 1e-14
    assert len(tags) == len(before)


def test_second_order_cells_in_a_plane(gmsh):
    plate(gmsh, order=2)
    result = gmsnet.gmsh.smooth()
    check_read_back(gmsh, result)
    assert result.invalid_curved == 0
    assert {block.kind for block in result.mesh.cells} == {"vertex", "line3", "triangle6"}
    assert result.moved.any()


def test_the_slow_way_sets_the_same_bits(gmsh):
    """Without the C library at hand, Gmsh's Python function is called for each node."""
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    thrown = places(gmsh)

    class Module:
        model, logger = gmsh.model, gmsh.logger
        isInitialized = staticmethod(gmsh.isInitialized)

    gmsnet.gmsh.smooth(gmsh=Module)
    slow = places(gmsh)[1]
    for tag, place in zip(*thrown, strict=True):
        gmsh.model.mesh.setNode(int(tag), place, [])
    gmsnet.gmsh.smooth()
    assert np.array_equal(places(gmsh)[1], slow)


def test_a_model_by_its_name_and_the_current_one_stays(gmsh):
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    gmsh.model.add("other")
    assert gmsnet.gmsh.smooth("plate").moved.any()
    assert gmsh.model.getCurrent() == "other"
    with pytest.raises(InputError, match=r"no model 'plat'; it has .*'plate'"):
        gmsnet.gmsh.smooth("plat")
    with pytest.raises(InputError, match="no surface or volume elements"):
        gmsnet.gmsh.smooth()
    assert gmsh.model.getCurrent() == "other"


def test_nodes_are_held_by_tags_and_by_names(gmsh):
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    gmsh.model.addPhysicalGroup(2, [gmsh.model.getEntities(2)[0][1]], name="metal")
    some = inside(gmsh, 2)[:7]
    result = gmsnet.gmsh.smooth(fixed=some)
    tags = result.mesh.point_data["gmsh:node"]
    assert sorted(tags[result.held["fixed by the user"]]) == sorted(some)
    assert not gmsnet.gmsh.smooth(fixed="metal").moved.any()
    surface = f"surface {gmsh.model.getEntities(2)[0][1]}"
    assert not gmsnet.gmsh.smooth(fixed=[surface]).moved.any()
    with pytest.raises(InputError, match="no node with the tag 99999"):
        gmsnet.gmsh.smooth(fixed={99999})
    with pytest.raises(InputError, match="fixed must be tags of nodes or names"):
        gmsnet.gmsh.smooth(fixed=[0.5])
    with pytest.raises(InputError, match="'mettal'"):
        gmsnet.gmsh.smooth(fixed="mettal")


def test_curves_between_surfaces_and_inside_of_one_are_held(gmsh):
    gmsh.model.add("two")
    maker = gmsh.model.occ
    maker.fragment([(2, maker.addRectangle(0, 0, 0, 1, 1))], [(2, maker.addRectangle(1, 0, 0, 1, 1))])
    line = maker.addLine(maker.addPoint(0.2, 0.5, 0), maker.addPoint(0.8, 0.5, 0))
    maker.synchronize()
    gmsh.model.mesh.embed(1, [line], 2, 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
    gmsh.model.mesh.generate(2)
    throw(gmsh, 2, 0.02)
    curves = np.concatenate([inside(gmsh, 1), inside(gmsh, 0)])
    tags, before = places(gmsh)
    gmsnet.gmsh.smooth()
    still = np.searchsorted(tags, curves)
    assert np.array_equal(places(gmsh)[1][still], before[still])


def test_interfaces_of_partitions_are_no_shape(gmsh):
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    free = len(places(gmsh)[0]) - sum(map(len, gmsnet.gmsh.smooth(max_sweeps=0).held.values()))
    gmsh.model.mesh.partition(3)
    result = gmsnet.gmsh.smooth()
    check_read_back(gmsh, result)
    assert len(result.points) - sum(map(len, result.held.values())) == free
    assert not any(block.dimension == 1 and block.kind != "line" for block in result.mesh.cells)


def test_a_mesh_in_another_plane(gmsh):
    plate(gmsh)
    gmsh.model.occ.rotate(gmsh.model.getEntities(2), 0, 0, 0, 1, 0, 0, np.pi / 2)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(2)
    assert read(gmsh, None).mesh.plane == (0, 2)
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    check_read_back(gmsh, result)
    radius = np.hypot(result.points[:, 0] - 0.5, result.points[:, 2] - 0.5)
    on = [
        len(gmsh.model.mesh.getNodes(1, t)[0])
        for _, t in gmsh.model.getEntities(1)
        if gmsh.model.getType(1, t) != "Line"
    ]
    assert np.count_nonzero(np.abs(radius - 0.2) < 1e-12) == sum(on) + 1


def test_what_cannot_be_smoothed_is_said(gmsh):
    ball_in_box(gmsh)
    with pytest.raises(InputError, match=r"dim must be 3, .* or None, got 2"):
        gmsnet.gmsh.smooth(dim=2)
    with pytest.raises(InputError, match='on_geometry must be "hold" or "slide", got \'glide\''):
        gmsnet.gmsh.smooth(on_geometry="glide")
    with pytest.raises(InputError, match='slide and geometry are of use with on_geometry="slide" alone'):
        gmsnet.gmsh.smooth(slide=True)
    with pytest.raises(InputError, match="must be the module"):
        gmsnet.gmsh.smooth(gmsh=gmsh.model)


def test_without_gmsh_at_work_the_mend_is_named():
    code = (
        "import sys, gmsnet.gmsh\nassert 'gmsh' not in sys.modules\n"
        "try:\n    gmsnet.gmsh.smooth()\nexcept gmsnet.InputError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "import gmsh, call gmsh.initialize()" in done.stdout


def test_gmsh_must_be_initialised(gmsh):
    class Asleep:
        model = gmsh.model

        @staticmethod
        def isInitialized():
            return 0

    with pytest.raises(InputError, match=r"call gmsh\.initialize\(\)"):
        gmsnet.gmsh.smooth(gmsh=Asleep)


def test_an_interruption_leaves_the_model_as_it_was(gmsh):
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    before = places(gmsh)[1]

    def stop(sweep):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gmsnet.gmsh.smooth(callback=stop)
    assert np.array_equal(places(gmsh)[1], before)
