"""smooth() with boundary nodes of tetrahedra that slide: what stays exactly, what moves, what is said."""

from __future__ import annotations

import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import volumes
from support.surfaces import boundary, ell, sliding, solid, turned

import gmsnet
from gmsnet import METHODS
from gmsnet.generate import block_volume
from gmsnet.run.untangle_stage import STILL

METHODS_THAT_SLIDE = [name for name, row in METHODS.items() if row.slides and row.moves("tetra", None)]
SOLIDS = {"box": None, "part": ell}


def enclosed(points, cells):
    """Six times the volume, exactly."""
    double, _ = volumes.exact_measures(points, cells)
    unit = {Fraction(v).denominator for v in points.ravel().tolist()}
    return Fraction(sum(double), max(unit) ** 3)


def referee(source, target, *options):
    """A second, independent look at two files, where there is one."""
    program = os.environ.get("GMSNET_REFEREE")
    if program:
        call = [sys.executable, program, "compare", str(source), str(target), "--slide", *options]
        verdict = subprocess.run(call, capture_output=True, text=True, check=False)
        assert verdict.returncode == 0, verdict.stdout + verdict.stderr


def least(report, cells, free):
    return report.shape[free[cells].any(axis=1)].min()


@pytest.mark.parametrize("method", METHODS_THAT_SLIDE)
@pytest.mark.parametrize("name", SOLIDS)
def test_planes_and_edges_keep_their_bits(name, method):
    points, cells, on = solid(6, SOLIDS[name], 0.35)
    mesh = volumes.mesh_of(points, cells)
    result, without = gmsnet.smooth(mesh, method, slide=True), gmsnet.smooth(mesh, method)
    assert result.points[on].tobytes() == points[on].tobytes()
    corners = on.all(axis=1)
    assert corners.sum() == {"box": 8, "part": 12}[name]
    assert not result.moved[corners].any()
    assert result.moved[on.any(axis=1) & ~corners].sum() > 0.9 * (on.any(axis=1) & ~corners).sum()
    assert enclosed(result.points, cells) == enclosed(points, cells) == 6 * (1 if name == "box" else Fraction(3, 4))
    assert result.after.inverted == 0
    assert set(result.held) == {"boundary"}
    assert sorted(result.held["boundary"]) == np.flatnonzero(corners).tolist()
    assert result.after.shape.mean() > without.after.shape.mean() + 0.05
    if method in ("auto", "worst-first"):
        assert result.after.shape.min() > without.after.shape.min() + 0.3
        assert result.after.shape.min() > 0.55
    assert enclosed(without.points, cells) == enclosed(points, cells)


@pytest.mark.parametrize("name", SOLIDS)
def test_oblique_planes_and_edges(name, tmp_path):
    points, cells, on = solid(6, SOLIDS[name], 0.35)
    matrix = turned(3)
    gmsnet.write(volumes.mesh_of(3 * points @ matrix.T + 1, cells), tmp_path / "in.vtk")
    result = gmsnet.smooth(gmsnet.read(tmp_path / "in.vtk"), slide=True)
    gmsnet.write(result.mesh, tmp_path / "out.vtk")
    referee(tmp_path / "in.vtk", tmp_path / "out.vtk")
    back = (result.points - 1) @ matrix / 3
    assert abs(back - points)[on].max() < 2e-15
    assert result.moved[on.any(axis=1) & ~on.all(axis=1)].all()
    assert result.after.shape.min() > 0.55
    note = next(note for note in result.notes if note.startswith("slide: "))
    assert "at most 0 of an edge from the input's facets; the volume changes by " in note
    assert float(note.split("changes by ")[1].split()[0]) < 1e-14


def marked(regions=0, more=(), **options):
    points, cells, on = solid(6, None, 0.35)
    facets, blocks = boundary(cells), []
    for number, (axis, level) in enumerate([(2, 1.0), (2, 0.0), (0, 0.0)], start=1):
        blocks.append(("triangle", facets[(points[facets][:, :, axis] == level).all(axis=1)], number))
    names = {(2, 1): "top", (2, 2): "bottom", (2, 3): "left"}
    mesh = volumes.mesh_of(points, cells, regions, [*blocks, *more], region_names=names, **options)
    return mesh, on


def test_named_markers_alone_slide():
    mesh, on = marked()
    result = gmsnet.smooth(mesh, slide=["top", "left"])
    outer = on.any(axis=1)
    named = np.zeros(len(outer), dtype=bool)
    named[mesh.markers["top"]] = named[mesh.markers["left"]] = True
    assert not result.moved[outer & ~named].any()
    assert result.moved[named & ~on.all(axis=1)].all()
    assert result.points[on].tobytes() == mesh.points[on].tobytes()
    with pytest.raises(gmsnet.InputError, match=r"the mesh has no marker 'tip' to slide on; did you mean 'top'\?"):
        gmsnet.smooth(mesh, slide="tip")


def test_fixed_nodes_stay():
    mesh, _ = marked()
    result = gmsnet.smooth(mesh, slide=True, fixed="top")
    assert not result.moved[mesh.markers["top"]].any()
    assert result.moved[mesh.markers["bottom"]].sum() == len(mesh.markers["bottom"]) - 4
    assert set(result.held) == {"boundary"}
    assert "fixed: 49 nodes are named, and do not slide" in result.notes


def test_interfaces_stay():
    points, cells, _ = solid(6, None, 0.35)
    regions = (points[cells].mean(axis=1)[:, 0] > 0.5).astype(int)
    result = gmsnet.smooth(volumes.mesh_of(points, cells, regions), slide=True)
    both = np.intersect1d(cells[regions == 0], cells[regions == 1])
    assert not result.moved[both].any()
    outer = np.setdiff1d(boundary(cells), both)
    assert result.moved[outer].sum() == len(outer) - 8
    assert result.after.volume[regions == 0].sum() == pytest.approx(result.before.volume[regions == 0].sum(), rel=1e-14)


def test_nodes_of_faces_inside_stay():
    """Where such a sheet meets the boundary, too."""
    points, cells, _ = solid(6, None, 0.35)
    sheet = [f for f, seen in volumes.facets_of(cells).items() if len(seen) == 2]
    sheet = np.array([f for f in sheet if (np.round(points[list(f), 2] * 6) == 3).all()])
    assert len(sheet) == 72
    result = gmsnet.smooth(volumes.mesh_of(points, cells, more=[("triangle", sheet, 4)]), slide=True)
    assert not result.moved[sheet].any()
    assert result.moved.sum() == len(points) - 8 - len(np.unique(sheet))


def test_cells_of_other_kinds_hold_their_nodes():
    points, cells, on = solid(6, None, 0.35)
    outer = np.flatnonzero(on.sum(axis=1) == 1)
    mesh = volumes.mesh_of(
        points, cells, more=[("hexahedron20", outer[None, :20], 0), ("vertex", outer[20:22, None], 1)]
    )
    result = gmsnet.smooth(mesh, slide=True)
    assert not result.moved[outer[:22]].any()
    assert result.moved[outer[22:]].all()


@pytest.mark.parametrize(("axes", "held"), [((0, 1, 2), 1), ((0, 1), 7)])
def test_parts_that_touch_at_a_node_or_an_edge(axes, held):
    points, cells, on = solid(6, None, 0.35)
    other = points + np.isin(range(3), axes)
    there = ((points == 1) | ~np.isin(range(3), axes)).all(axis=1)
    here = ((points == 0) | ~np.isin(range(3), axes)).all(axis=1)
    pairs = np.flatnonzero(there)[np.argsort(points[there][:, 2])], np.flatnonzero(here)[np.argsort(points[here][:, 2])]
    number = np.arange(2 * len(points))
    number[pairs[1] + len(points)] = pairs[0]
    other[pairs[1]] = points[pairs[0]]
    mesh = volumes.mesh_of(np.vstack([points, other]), number[np.vstack([cells, cells + len(points)])])
    assert (volumes.volumes6(mesh.points, mesh.cells[0].nodes) > 0).all()
    result = gmsnet.smooth(mesh, slide=True)
    assert len(pairs[0]) == held
    assert not result.moved[pairs[0]].any()
    corners = np.concatenate([on.all(axis=1), on.all(axis=1)])
    used = np.isin(np.arange(len(corners)), mesh.cells[0].nodes)
    still = used & ~result.moved
    assert still.sum() == {1: 15, 7: 19}[held]  # corners of both, and what they share
    assert (corners | np.isin(np.arange(len(corners)), pairs[0]))[still].all()
    assert result.after.inverted == 0


PERIODIC = """MARKER_TAG= SEND_RECEIVE
MARKER_ELEMS= 2
SEND_TO= 1
1 {} 1
1 {} 1
MARKER_TAG= SEND_RECEIVE
MARKER_ELEMS= 2
SEND_TO= -1
1 {} 1
1 {} 1
"""


def test_nodes_that_su2_copies_stay(tmp_path):
    mesh, on = marked()
    path = tmp_path / "in.su2"
    gmsnet.write(mesh, path)
    four = np.flatnonzero(on.sum(axis=1) == 1)[:4]
    text = path.read_text()
    assert text.count("NMARK= 3") == 1
    path.write_text(text.replace("NMARK= 3", "NMARK= 5") + PERIODIC.format(*four))
    result = gmsnet.smooth(gmsnet.read(path), slide=True)
    assert not result.moved[four].any()
    assert result.moved[np.setdiff1d(np.flatnonzero(on.sum(axis=1) == 1), four)].all()
    gmsnet.write(result.mesh, tmp_path / "out.su2")
    found = gmsnet.read(tmp_path / "out.su2")
    assert list(found.markers) == list(gmsnet.read(path).markers)


def test_the_boundary_may_be_inside_out_where_cells_are_inverted():
    points, cells, on = solid(6, None, 0.35)
    rng = np.random.default_rng(5)
    inner = np.flatnonzero(~on.any(axis=1))
    points[rng.permutation(inner)[:12]] += rng.uniform(-0.3, 0.3, (12, 3))
    mesh = volumes.mesh_of(points, cells)
    result = gmsnet.smooth(mesh, slide=True)
    assert result.before.inverted > 10
    assert result.after.inverted == 0
    assert result.points[on].tobytes() == points[on].tobytes()
    assert enclosed(result.points, cells) == 6
    points[np.flatnonzero((on.sum(axis=1) == 1) & (points[:, 2] == 1.0))[:3]] += [0.25, 0.25, 0.0]
    folded = gmsnet.smooth(volumes.mesh_of(points, cells), slide=True)
    assert folded.after.inverted <= folded.before.inverted
    assert folded.points[on].tobytes() == points[on].tobytes()
    was = volumes.exact_signs(points, cells)
    assert all(now > 0 or then <= 0 for then, now in zip(was, volumes.exact_signs(folded.points, cells), strict=True))


@pytest.mark.parametrize("suffix", [".vtk", ".msh"])
def test_files(tmp_path, suffix):
    mesh, on = marked()
    source, target = tmp_path / f"in{suffix}", tmp_path / f"out{suffix}"
    gmsnet.write(mesh, source)
    if suffix == ".vtk":
        source.write_text(source.read_text().replace(" double", " float", 1))
    given = gmsnet.read(source)
    assert given.single == (suffix == ".vtk")
    result = gmsnet.smooth(given, slide=True)
    gmsnet.write(result.mesh, target)
    referee(source, target)
    found = gmsnet.read(target)
    assert (found.points[on] == given.points[on]).all()
    assert found.points.tobytes() == result.points.tobytes()
    assert [block.nodes.tolist() for block in found.cells] == [block.nodes.tolist() for block in given.cells]
    assert result.after.shape.min() > 0.5


def round_mesh(seed=0):
    return volumes.mesh_of(*volumes.globe(800, seed))


def test_a_ball_stays_round():
    mesh = round_mesh()
    result = gmsnet.smooth(mesh, slide=True, surface_tolerance=1.0)
    rim = np.unique(boundary(mesh.cells[0].nodes))
    slid = rim[result.moved[rim]]
    assert len(slid) > 0.95 * len(rim)
    radius = np.linalg.norm(result.points[slid], axis=1)
    facets = mesh.points[boundary(mesh.cells[0].nodes)]
    sagitta = 1.0 - np.linalg.norm(facets.mean(axis=1), axis=1)
    assert abs(radius - 1.0).max() < 0.2 * sagitta.max()
    assert np.median(abs(radius - 1.0)) < 0.02 * np.median(sagitta)
    note = next(note for note in result.notes if note.startswith("slide: "))
    assert note.startswith(f"slide: {len(slid):,} of ")
    assert 0.0 < float(note.split("at most ")[1].split()[0]) < 0.15
    before, after = (float(volumes.volumes6(m.points, mesh.cells[0].nodes).sum()) for m in (mesh, result.mesh))
    assert float(note.split("changes by ")[1].split()[0]) == pytest.approx(abs(after / before - 1.0), rel=0.06)
    assert "volume changes" not in str(gmsnet.smooth(mesh, max_sweeps=2).notes)


def test_what_is_said_does_not_depend_on_scales():
    """Coordinates are divided by a power of two that may change as nodes slide."""
    mesh = round_mesh(3)
    notes = set()
    for factor in (1.0, 2.0**-300, 2.0**300, 1.0 / abs(mesh.points).max()):
        scaled = mesh.with_points(mesh.points * factor)
        notes.add(next(n for n in gmsnet.smooth(scaled, slide=True, max_sweeps=5).notes if n.startswith("slide: ")))
    assert len({float(note.split("changes by ")[1].split()[0]) for note in notes}) <= 2
    assert all(float(note.split("changes by ")[1].split()[0]) < 0.05 for note in notes)


@pytest.mark.parametrize("make", [round_mesh, lambda: marked()[0]])
def test_the_same_bits_for_any_number_of_threads(make):
    mesh = make()
    found = [gmsnet.smooth(mesh, slide=True, threads=threads) for threads in (1, 2, 4)]
    assert len({result.points.tobytes() for result in found}) == 1
    assert len({tuple(result.notes) for result in found}) == 1


@pytest.mark.parametrize("method", METHODS_THAT_SLIDE)
@pytest.mark.parametrize("guard", ["valid", "worst", "star"])
def test_every_method_and_level_lets_nodes_slide(method, guard):
    mesh = round_mesh(1)
    topology, on = sliding(mesh)
    result = gmsnet.smooth(mesh, method, guard=guard, slide=True, max_sweeps=10)
    assert result.topology.free.tolist() == topology.free.tolist()
    assert result.moved[on.nodes].sum() > (0.03 if method == "worst-first" else 0.5) * on.nodes.sum()
    assert result.after.inverted == 0


@pytest.mark.parametrize("place", ["inside", "side", "edge"])
def test_the_laplacian_goes_to_the_mean_of_half_a_ball(place):
    points, cells, on = solid(4)
    node = np.flatnonzero(on.sum(axis=1) == {"inside": 0, "side": 1, "edge": 2}[place])[3]
    points[node] += np.where(on[node], 0.0, [0.05, 0.1, 0.08])
    ring = np.setdiff1d(cells[(cells == node).any(axis=1)], node)
    options = {"variant": "plain", "guard": "valid", "max_sweeps": 1, "fixed": np.arange(len(points)) != node}
    result = gmsnet.smooth(volumes.mesh_of(points, cells), "laplacian", slide=True, **options)
    assert result.points[node] == pytest.approx(np.where(on[node], points[node], points[ring].mean(axis=0)), abs=1e-6)
    assert result.moved[node]


def test_nothing_can_slide():
    points, cells = volumes.ball(np.random.default_rng(0), 12)
    result = gmsnet.smooth(volumes.mesh_of(points, cells), slide=True, feature_angle=1.0)
    assert "slide: no node of the boundary can move along it" in result.notes
    assert result.moved.tolist() == [True] + [False] * (len(points) - 1)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=int(os.environ.get("GMSNET_GUARD_EXAMPLES", "15")), deadline=None)
def test_any_cells(seed):
    """Sponges with cavities, nodes and edges where parts touch, thin parts, noise: no cell is lost, nothing strays."""
    rng = np.random.default_rng(seed)
    points, cells = (volumes.globe if rng.random() < 0.5 else volumes.cube)(int(rng.integers(20, 120)), seed % 9999)
    if rng.random() < 0.6:
        cells = cells[rng.random(len(cells)) < rng.uniform(0.3, 1.0)]
    if rng.random() < 0.3:
        points = points * [1.0, 0.5, 10.0 ** rng.uniform(-3, 0)]
    if rng.random() < 0.3:
        points = points + 0.05 * rng.normal(size=points.shape)
    points = points @ turned(seed % 7).T + rng.choice([0.0, 1e4])
    single = bool(rng.random() < 0.2)
    mesh = volumes.mesh_of(np.float64(np.float32(points)) if single else points, cells, single=single)
    angle = float(rng.choice([5.0, 30.0, 60.0, 120.0]))
    result = gmsnet.smooth(mesh, slide=True, feature_angle=angle, guard=str(rng.choice(["valid", "worst", "star"])))
    topology, on = sliding(mesh, angle)
    before, after = (volumes.exact_signs(m.points, topology.cells, topology.orientation) for m in (mesh, result.mesh))
    assert all(now > 0 or was <= 0 for was, now in zip(before, after, strict=True))
    assert not result.moved[np.setdiff1d(np.arange(len(points)), topology.free)].any()
    assert {"boundary", "star is not one closed ball", "not used by any cell", "non-manifold facet"} >= set(result.held)
    touching = np.isin(on.facets.rows, np.flatnonzero(on.nodes & ~on.patches.curves.slides))
    fans = np.bincount(on.facets.rows[touching], minlength=len(points))
    spokes = [len(np.unique(on.facets.rows[(on.facets.rows == v).any(axis=1)])) - 1 for v in np.flatnonzero(fans)]
    assert spokes == fans[fans > 0].tolist()  # one closed fan around each node inside of a patch


def test_nodes_that_slide_are_said_to_stand_still_where_cells_stay_inverted():
    mesh = block_volume(4, "wedge")
    points = mesh.points.copy()
    middle = np.flatnonzero((points[:, 2] == points[:, 2].max()) & (np.abs(points[:, :2] - 0.5).max(axis=1) < 0.1))
    points[middle] += (0.35, 0.075, 0.0)
    slid, still = (gmsnet.smooth(mesh.with_points(points), slide=slide, threads=1) for slide in (True, False))
    assert slid.after.inverted
    assert still.after.inverted
    assert any(note.startswith("untangling") and note.endswith(STILL) for note in slid.notes)
    assert not any(STILL in note for note in still.notes)
