"""Nodes that slide on the curves of a live model, or on arcs through the mesh where there are none."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
import gmsnet.gmsh
from gmsnet.errors import InputError
from gmsnet.gmsh import snapping
from gmsnet.gmsh.curve import CadCurve
from with_gmsh.conftest import ball_in_box, inside, places, plate, throw

KERNELS = ["occ", "geo"]


def said(result):
    """The notes that nodes are kept off the geometry."""
    return [note for note in result.notes if snapping.KEPT in note]


def waved(gmsh, kernel, size=0.06):
    """A plate whose lower side is a spline."""
    gmsh.model.add("waved")
    maker = getattr(gmsh.model, kernel)
    at = ((0, 0), (0.3, 0.4), (0.8, -0.1), (1.4, 0.2), (1.4, 1.5), (0, 1.5))
    points = [maker.addPoint(x, y, 0) for x, y in at]
    spline = maker.addSpline(points[:4])
    lines = [maker.addLine(a, b) for a, b in ((points[3], points[4]), (points[4], points[5]), (points[5], points[0]))]
    maker.addPlaneSurface([maker.addCurveLoop([spline, *lines])])
    maker.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(2)
    return spline


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_circle_keeps_its_radius_and_sides_their_coordinate(gmsh, kernel):
    plate(gmsh, kernel=kernel)
    throw(gmsh, 2, 0.02)
    tags, before = places(gmsh)
    held = gmsnet.gmsh.smooth(max_sweeps=0).before
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    assert result.after.shape.min() > held.shape.min()
    after = places(gmsh)[1]
    for _, curve in gmsh.model.getEntities(1):
        rows = np.searchsorted(tags, gmsh.model.mesh.getNodes(1, curve)[0])
        if gmsh.model.getType(1, curve) == "Line":
            same = np.ptp(before[rows], axis=0) == 0.0
            assert same.sum() == 2
            assert np.array_equal(after[rows][:, same], before[rows][:, same])
        else:
            assert np.abs(np.hypot(*(after[rows, :2] - 0.5).T) - 0.2).max() < 1e-12
        assert (after[rows] != before[rows]).any()
    points = np.searchsorted(tags, [gmsh.model.mesh.getNodes(0, t)[0][0] for _, t in gmsh.model.getEntities(0)
                                    if len(gmsh.model.mesh.getNodes(0, t)[0])])  # fmt: skip
    assert np.array_equal(after[points], before[points])


@pytest.mark.parametrize("kernel", KERNELS)
def test_nodes_of_a_spline_are_on_it_in_all_digits_and_stay_there(gmsh, kernel):
    spline = waved(gmsh, kernel)
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    assert not said(result)
    nodes, points, parameters = gmsh.model.mesh.getNodes(1, spline, False, True)
    assert np.isin(nodes, result.mesh.point_data["gmsh:node"][result.moved]).any()
    value = np.asarray(gmsh.model.getValue(1, spline, parameters))
    assert np.abs(value - points).max() < 1e-15
    assert (np.diff(parameters) > 0.0).all()
    before = places(gmsh)[1]
    gmsh.model.mesh.relocateNodes()
    assert np.abs(places(gmsh)[1] - before).max() < 1e-14
    assert gmsnet.quality(result.mesh).inverted == 0


def test_places_on_curves_are_kept_off_where_cells_would_suffer(gmsh, monkeypatch):
    waved(gmsh, "occ")
    genuine = CadCurve.project

    def far(self, points):
        at, parameters = genuine(self, points)
        return at + np.array([0.0, 5.0, 0.0]), parameters

    genuine_snapping, seen = snapping.on_geometry, []

    def on_geometry(module, live, curves, result, target):
        seen.append(result)
        with monkeypatch.context() as patch:
            patch.setattr(CadCurve, "project", far)
            return genuine_snapping(module, live, curves, result, target)

    monkeypatch.setattr(snapping, "on_geometry", on_geometry)
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    assert "at most 5 away" in said(result)[0]
    assert np.array_equal(result.points, seen[0].points)


def test_only_nodes_whose_cells_would_suffer_are_kept_off(gmsh, monkeypatch):
    spline = waved(gmsh, "occ")
    genuine = CadCurve.project

    def far(self, points):
        """All nodes of the left half go astray."""
        at, parameters = genuine(self, points)
        return at + np.where(points[:, :1] < 0.7, 5.0, 0.0) * np.array([0.0, 1.0, 0.0]), parameters

    genuine_snapping = snapping.on_geometry

    def on_geometry(*given):
        with monkeypatch.context() as patch:
            patch.setattr(CadCurve, "project", far)
            return genuine_snapping(*given)

    monkeypatch.setattr(snapping, "on_geometry", on_geometry)
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    assert said(result)
    _, points, parameters = gmsh.model.mesh.getNodes(1, spline, False, True)
    points = points.reshape(-1, 3)
    off = np.linalg.norm(np.asarray(gmsh.model.getValue(1, spline, parameters)).reshape(-1, 3) - points, axis=1)
    assert off[points[:, 0] > 0.8].max() < 1e-15
    assert off.max() < 1e-3
    assert result.after.shape.min() >= result.before.shape.min()


def test_nodes_of_the_rim_of_a_hole_through_a_thin_sheet_are_on_it(gmsh):
    """Edges across the sheet are short beside those of the hole: the tolerance from facets is less than the bulge."""
    gmsh.model.add("sheet")
    maker = gmsh.model.occ
    maker.cut([(3, maker.addBox(0, 0, 0, 2, 1, 0.02))], [(3, maker.addCylinder(1, 0.5, -0.1, 0, 0, 0.3, 0.2))])
    maker.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 16)
    gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.model.mesh.generate(2)
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    assert not said(result)
    assert result.after.shape.min() >= result.before.shape.min()
    circles = [tag for _, tag in gmsh.model.getEntities(1) if gmsh.model.getType(1, tag) == "Circle"]
    assert len(circles) == 2
    for circle in circles:
        nodes, points, _ = gmsh.model.mesh.getNodes(1, circle)
        assert np.isin(nodes, result.mesh.point_data["gmsh:node"][result.moved]).any()
        assert np.abs(np.hypot(*(points.reshape(-1, 3)[:, :2] - [1.0, 0.5]).T) - 0.2).max() < 1e-12


def test_only_the_curves_that_are_named_slide(gmsh):
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    (circle,) = (t for _, t in gmsh.model.getEntities(1) if gmsh.model.getType(1, t) != "Line")
    gmsh.model.addPhysicalGroup(1, [circle], name="hole")
    tags, before = places(gmsh)
    for name in (f"curve {circle}", "hole"):
        gmsnet.gmsh.smooth(on_geometry="slide", slide=[name])
        after = places(gmsh)[1]
        for _, curve in gmsh.model.getEntities(1):
            rows = np.searchsorted(tags, gmsh.model.mesh.getNodes(1, curve)[0])
            assert (after[rows] != before[rows]).any() == (curve == circle)


def test_in_volumes_nodes_slide_on_surfaces_and_are_on_them_in_all_digits(gmsh):
    ball_in_box(gmsh, size=0.15)
    throw(gmsh, 3, 0.01, axes=3)
    tags, before = places(gmsh)
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    assert not said(result)
    assert result.after.inverted == 0
    assert result.after.shape.min() >= result.before.shape.min()
    after = places(gmsh)[1]
    for _, surface in gmsh.model.getEntities(2):
        nodes, points, parameters = gmsh.model.mesh.getNodes(2, surface, False, True)
        rows = np.searchsorted(tags, nodes)
        assert (after[rows] != before[rows]).any()
        if gmsh.model.getType(2, surface) == "Sphere":
            assert np.abs(np.linalg.norm(points.reshape(-1, 3) - 0.5, axis=1) - 0.25).max() < 1e-12
        else:
            same = np.ptp(before[rows], axis=0) == 0.0
            assert same.sum() == 1
            assert np.array_equal(after[rows][:, same], before[rows][:, same])
        assert np.abs(gmsh.model.getValue(2, surface, parameters) - points).max() < 1e-12
    gmsh.model.mesh.relocateNodes()
    assert np.abs(places(gmsh)[1] - after).max() < 1e-12


def test_periodic_curves_stay_matched(gmsh):
    gmsh.model.add("periodic")
    maker = gmsh.model.geo
    corners = [maker.addPoint(x, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    bottom, right, top, left = (maker.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4))
    maker.addPlaneSurface([maker.addCurveLoop([bottom, right, top, left])])
    maker.synchronize()
    gmsh.model.mesh.setPeriodic(1, [right], [left], [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
    gmsh.model.mesh.generate(2)
    throw(gmsh, 2, 0.03)
    tags, before = places(gmsh)
    gmsnet.gmsh.smooth(on_geometry="slide")
    after = places(gmsh)[1]
    for curve, moves in ((bottom, True), (right, False), (top, True), (left, False)):
        rows = np.searchsorted(tags, gmsh.model.mesh.getNodes(1, curve)[0])
        assert (after[rows] != before[rows]).any() == moves


def test_without_a_geometry_nodes_slide_on_arcs_through_the_mesh(gmsh, tmp_path):
    """Gmsh's nearest places on discrete curves are all at the origin; they are not asked for."""
    plate(gmsh, size=0.05)
    throw(gmsh, 2, 0.01)
    path = str(tmp_path / "plate.msh")
    gmsh.write(path)
    gmsh.clear()
    gmsh.open(path)
    assert {gmsh.model.getType(1, t) for _, t in gmsh.model.getEntities(1)} == {"Discrete curve"}
    result = gmsnet.gmsh.smooth(on_geometry="slide")
    assert len(result.held["boundary"]) < 10
    radius = np.hypot(*(result.points[:, :2] - 0.5).T)
    on = np.abs(radius - 0.2) < 1e-6
    assert result.moved[on].any()
    assert np.abs(radius[on] - 0.2).max() < 1e-9
    assert np.array_equal(places(gmsh)[1], result.points[np.argsort(result.mesh.point_data["gmsh:node"])])


def test_discrete_curves_beside_others_are_refused_by_name(gmsh):
    plate(gmsh)
    tags, points = places(gmsh)
    cells = np.concatenate([each.reshape(-1, 3) for each in gmsh.model.mesh.getElements(2)[2]]).astype(np.int64)
    middle = int(inside(gmsh, 2)[0])
    around = np.setdiff1d(cells[(cells == middle).any(axis=1)], middle)
    way = points[np.searchsorted(tags, around)] - points[np.searchsorted(tags, middle)]
    one, other = np.unravel_index(
        np.argmin(way @ way.T / np.outer(*[np.linalg.norm(way, axis=1)] * 2)), (len(way),) * 2
    )
    curve = gmsh.model.addDiscreteEntity(1)
    gmsh.model.mesh.addElementsByType(curve, 1, [], [around[one], middle, middle, around[other]])
    with pytest.raises(InputError, match=rf"\(curve {curve}\) of the mesh is no curve of Gmsh's geometry"):
        gmsnet.gmsh.smooth(on_geometry="slide", feature_angle=80.0)
    (circle,) = (t for _, t in gmsh.model.getEntities(1) if gmsh.model.getType(1, t) == "Ellipse")
    assert gmsnet.gmsh.smooth(on_geometry="slide", slide=f"curve {circle}").moved.any()


@pytest.mark.parametrize("kernel", KERNELS)
def test_nearest_places_are_nearest(gmsh, kernel):
    """Against all places of a fine table; ends of the curve count."""
    curve = CadCurve(gmsh, waved(gmsh, kernel))
    rng = np.random.default_rng(0)
    fine = np.linspace(curve._low, curve._high, 20_001)
    table = curve.at(fine)
    start = curve.at(rng.uniform(curve._low, curve._high, 300))
    points = start + 0.02 * rng.normal(size=start.shape) * [1.0, 1.0, 0.0]
    at, parameters = curve.project(points)
    assert np.array_equal(curve.at(parameters), at)
    nearest = np.array([np.linalg.norm(table - point, axis=1).min() for point in points])
    found = np.linalg.norm(at - points, axis=1)
    assert (found <= nearest + 1e-12).all()


@pytest.mark.parametrize("quads", [False, True])
@pytest.mark.parametrize("how", ["hold", "slide"])
def test_nodes_of_a_surface_in_space_are_on_the_cad(gmsh, how, quads):
    """A cylinder: its sides have a radius, its rims besides a height."""
    gmsh.model.add("cylinder")
    gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, 2, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
    gmsh.option.setNumber("Mesh.RecombineAll", int(quads))
    gmsh.model.mesh.generate(2)
    random = np.random.default_rng(0)
    for _, surface in gmsh.model.getEntities(2):
        tags, at, _ = gmsh.model.mesh.getNodes(2, surface)
        for tag, place in zip(tags, at.reshape(-1, 3), strict=True):
            step = random.uniform(-0.08, 0.08, 2)
            if gmsh.model.getType(2, surface) == "Plane":
                place[:2] += step
            else:
                angle = np.arctan2(place[1], place[0]) + step[0]
                place[:] = np.cos(angle), np.sin(angle), place[2] + step[1]
            gmsh.model.mesh.setNode(tag, place, [])
    before = gmsnet.gmsh.smooth(max_sweeps=0).before.shape.min()
    result = gmsnet.gmsh.smooth(on_geometry=how)
    assert not said(result)
    assert result.after.shape.min() > before
    assert result.after.inverted == 0
    for dimension, tag in gmsh.model.getEntities():
        nodes, at, _ = gmsh.model.mesh.getNodes(dimension, tag)
        at = at.reshape(-1, 3)
        moved = np.isin(nodes, result.mesh.point_data["gmsh:node"][result.moved])
        if dimension == 2:
            assert moved.any()
        elif how == "hold" or dimension == 0:
            assert not moved.any()
        if gmsh.model.getType(dimension, tag) in ("Cylinder", "Circle"):
            assert np.abs(np.hypot(at[:, 0], at[:, 1]) - 1.0).max() < 1e-12
        if gmsh.model.getType(dimension, tag) in ("Plane", "Circle"):
            assert np.isin(at[:, 2], (0.0, 2.0)).all()
