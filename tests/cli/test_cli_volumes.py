"""The command line on files of tetrahedra: every format in space, real meshes, and what cannot be used."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from support import surfaces, volumes

import gmsnet
from gmsnet.topology.volume import Volume

SUFFIXES = (".vtk", ".vtu", ".msh", ".mesh")
# Nodes of the cells that move, of all: those of the boundary and between regions stay.
REAL = {
    "cub_wedge_like.vtk": (16_265, 21_156), "cube-clip-5.vtk": (1916, 3408), "cylinder_in_box.mesh": (247, 764),
    "island.mesh": (2054, 3653), "multi_material_cylinder_plate.vtk": (1216, 2101),
}  # fmt: skip


def referee(source, target, *options):
    program = os.environ.get("GMSNET_REFEREE")
    if program:
        call = [sys.executable, program, "compare", str(source), str(target), *options]
        verdict = subprocess.run(call, capture_output=True, text=True, check=False)
        assert verdict.returncode == 0, verdict.stdout + verdict.stderr


def some_mesh(regions=False):
    points, cells = volumes.cube(250, 4)
    region = (points[cells].mean(axis=1)[:, 0] > 0.5).astype(int) + 1 if regions else 1
    seen = volumes.facets_of(cells)
    faces = [list(facet) for facet, owners in seen.items() if len(owners) == 1]
    return volumes.mesh_of(points, cells, region, more=[("triangle", faces, 5)])


def check(run, source, target, *options):
    """Smooths a file; the output is the input with other coordinates of free nodes, and the referee is content."""
    done = run("smooth", source, target, *options)
    assert done.code == 0, done.err
    before, after = gmsnet.read(source), gmsnet.read(target)
    spliced = before.source.splice(after.points)
    assert b"".join(spliced[next(iter(spliced))]) == target.read_bytes()
    topology = Volume.of(before)
    moved = (before.points != after.points).any(axis=1)
    assert not moved[np.setdiff1d(np.arange(len(moved)), topology.free)].any()
    referee(source, target)
    return gmsnet.quality(before), gmsnet.quality(after), topology


@pytest.mark.parametrize("regions", [False, True])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_format_in_space(run, tmp_path, suffix, regions):
    mesh, source, target = some_mesh(regions), tmp_path / f"in{suffix}", tmp_path / f"out{suffix}"
    gmsnet.write(mesh, source)
    was, now, topology = check(run, source, target)
    assert now.inverted == was.inverted == 0
    assert now.shape.mean() > was.shape.mean()
    reasons = set(topology.held)
    assert "boundary" in reasons
    if regions:
        assert "interface between regions" in reasons


@pytest.mark.parametrize("suffix", [".vtk", ".msh", ".inp"])
def test_regions_that_mean_nothing_are_joined(run, tmp_path, suffix):
    source, target = tmp_path / f"in{suffix}", tmp_path / f"out{suffix}"
    gmsnet.write(some_mesh(True), source)
    held = run("smooth", source, target)
    assert "--join-regions" in held.out
    done = run("smooth", source, target, "--join-regions")
    assert done.code == 0
    assert "between regions" not in done.out
    between = Volume.of(gmsnet.read(source)).held["interface between regions"]
    before, after = gmsnet.read(source), gmsnet.read(target)
    assert (before.points != after.points).any(axis=1)[between].any()
    assert [each.regions.tolist() for each in before.cells] == [each.regions.tolist() for each in after.cells]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_from_every_format_into_every_other(run, tmp_path, suffix):
    source = tmp_path / "in.vtk"
    gmsnet.write(some_mesh(), source)
    target = tmp_path / f"out{suffix}"
    assert run("smooth", source, target, "--quiet").code == 0
    one = gmsnet.quality(gmsnet.read(target))
    run("smooth", source, tmp_path / "again.vtk", "--quiet")
    other = gmsnet.quality(gmsnet.read(tmp_path / "again.vtk"))
    assert sorted(one.shape.round(9)) == pytest.approx(sorted(other.shape.round(9)), abs=1e-9)


def test_both_versions_of_gmsh(run, tmp_path):
    mesh = some_mesh()
    gmsnet.write(mesh, tmp_path / "one.msh")
    cells = mesh.cells[0].nodes.tolist()
    text = (tmp_path / "one.msh").read_bytes()
    old = (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n"
        + f"{len(mesh.points)}\n"
        + "".join(f"{i + 1} {x!r} {y!r} {z!r}\n" for i, (x, y, z) in enumerate(mesh.points.tolist()))
        + "$EndNodes\n$Elements\n"
        + f"{len(cells)}\n"
        + "".join(f"{t + 1} 4 2 1 1 {' '.join(str(n + 1) for n in cell)}\n" for t, cell in enumerate(cells))
        + "$EndElements\n"
    )
    (tmp_path / "old.msh").write_text(old)
    assert text.startswith(b"$MeshFormat\n4.1")
    for name in ("one.msh", "old.msh"):
        was, now, _ = check(run, tmp_path / name, tmp_path / f"out-{name}")
        assert now.shape.min() > was.shape.min()


@pytest.mark.parametrize("name", REAL)
def test_real_meshes(run, real_meshes, tmp_path, name):
    if not (real_meshes / name).exists():
        pytest.skip("not in the folder of real meshes")
    free, nodes = REAL[name]
    was, now, topology = check(run, real_meshes / name, tmp_path / f"out{name[-5:]}")
    assert (len(topology.free), len(topology.memory)) == (free, nodes)
    assert now.inverted == was.inverted == 0
    changed = np.isin(topology.cells, topology.free).any(axis=1)
    layered = name.startswith("multi_material")  # whose flat cells decide both minima
    assert now.shape[changed].min() > was.shape[changed].min() - layered * 1e-12
    assert now.shape.mean() > was.shape.mean()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_boundary_nodes_slide(run, tmp_path, suffix):
    """In place; the rest of the file, markers and their order, stays byte for byte."""
    points, cells, on = surfaces.solid(4, None, 0.3)
    facets = surfaces.boundary(cells)
    top = (points[facets][:, :, 2] == 1.0).all(axis=1)
    first, last = (volumes.block("triangle", facets[chosen], 6 - k) for k, chosen in enumerate((~top, top)))
    mesh = gmsnet.Mesh(points, (first, volumes.block("tetra", cells, 1), last))
    source, target = tmp_path / f"in{suffix}", tmp_path / f"out{suffix}"
    gmsnet.write(mesh, source)
    gmsnet.write(mesh, target)
    done = run("smooth", target, "--in-place", "--slide", "all")
    assert done.code == 0, done.err
    assert "nodes have moved along the boundary, at most 0 of an edge" in " ".join(done.out.split())
    before, after = gmsnet.read(source), gmsnet.read(target)
    assert target.read_bytes() == b"".join(before.source.splice(after.points)[suffix])
    assert (after.points[on] == points[on]).all()
    moved = (after.points != before.points).any(axis=1)
    assert moved[~on.any(axis=1)].all()
    assert list(before.markers) == list(after.markers)
    referee(source, target, "--slide")


def test_quality_says_what_there_is(run, tmp_path):
    gmsnet.write(some_mesh(), tmp_path / "in.vtk")
    done = run("quality", tmp_path / "in.vtk")
    assert done.code == 0
    for words in ("η, least", "dihedral angle, least", "cells with a dihedral angle < 5°", "worst cells"):
        assert words in done.out
    assert "1/q" not in done.out
    assert "surface in space" not in done.out
    document = json.loads(run("quality", tmp_path / "in.vtk", "--json").out)
    text = json.dumps(document)
    for name in ("tetrahedra", "min_dihedral", "max_dihedral", "volume", "scaled_jacobian"):
        assert f'"{name}"' in text
    assert "aspect" not in text


def test_quality_of_a_file_with_inverted_cells(run, tmp_path):
    mesh = some_mesh()
    points = mesh.points.copy()
    points[Volume.of(mesh).free[0]] = 0.01
    gmsnet.write(mesh.with_points(points), tmp_path / "in.vtk")
    assert "inverted" in run("quality", tmp_path / "in.vtk").out
    assert run("quality", tmp_path / "in.vtk", "--threshold", "0.0").code == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--slide", "hul"], "there is no marker 'hul' to slide on"),
        (["--target-angle", "10"], "this mesh has volumes: give target_dihedral"),
        (["--method", "getme"], "the variant sequential of getme moves cells in a plane alone"),
        (["--preserve", "size"], "preserve='size' is of meshes in a plane, and this one is in space: leave it out"),
        (["--preserve", "metric"], "preserve='metric' is of meshes in a plane"),
    ],
)
def test_what_cannot_be_asked_leaves_no_file(run, tmp_path, options, words):
    gmsnet.write(some_mesh(), tmp_path / "in.vtk")
    done = run("smooth", tmp_path / "in.vtk", tmp_path / "out.vtk", *options)
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err
    assert not (tmp_path / "out.vtk").exists()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_truncated_files_are_told_or_read_whole(run, tmp_path, suffix):
    """At any length: one line that names the file, or a mesh; no traceback, no output that is cut."""
    source, target = tmp_path / f"in{suffix}", tmp_path / f"out{suffix}"
    gmsnet.write(volumes.mesh_of(*volumes.lattice(2, 0.2)), source)
    whole = source.read_bytes()
    for share in (0.01, 0.3, 0.5, 0.7, 0.9, 0.98):
        source.write_bytes(whole[: int(len(whole) * share)])
        done = run("smooth", source, target, "--quiet")
        assert done.code == 2
        assert done.err.count("\n") == 1
        assert source.name in done.err
        assert not target.exists()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_flat_files_are_told(run, tmp_path, suffix):
    points, cells = volumes.lattice(2)
    gmsnet.write(volumes.mesh_of(points * [1, 1, 0], cells), tmp_path / f"in{suffix}")
    for command in (["quality"], ["smooth", tmp_path / f"out{suffix}"]):
        done = run(command[0], tmp_path / f"in{suffix}", *command[1:])
        assert done.code == 2
        assert f"in{suffix}: the mesh has volumes, but all its nodes lie in one plane" in done.err
        assert done.err.count("\n") == 1


def test_cells_of_mixed_kinds(run, tmp_path):
    mesh = some_mesh()
    free = Volume.of(mesh).free
    mixed = gmsnet.Mesh(mesh.points, (*mesh.cells, volumes.block("pyramid13", [free[:13]], 2)))
    source, target = tmp_path / "in.vtk", tmp_path / "out.vtk"
    gmsnet.write(mixed, source)
    done = run("smooth", source, target)
    assert done.code == 0
    assert "not measured, and their nodes are held: 1 pyramid13 cell" in done.out
    before, after = gmsnet.read(source), gmsnet.read(target)
    assert (before.points[free[:13]] == after.points[free[:13]]).all()
    assert (before.points[free[13:]] != after.points[free[13:]]).any()


def test_a_minimum_dihedral_angle_can_be_the_target(run, tmp_path):
    source, target = tmp_path / "in.vtk", tmp_path / "out.vtk"
    gmsnet.write(some_mesh(), source)
    least = float(gmsnet.quality(gmsnet.read(source)).min_dihedral.min())
    done = run("smooth", source, target, "--target-dihedral", 1.2 * least, "--json")
    told = json.loads(done.out)
    assert (done.code, told["target_met"], told["below_target"]) == (0, True, 0)
    assert (told["target_dihedral"], told["target_angle"]) == (1.2 * least, None)
    done = run("smooth", source, target, "--target-dihedral", 60)
    assert done.code == 1
    assert "target not met: the minimum dihedral angle is" in done.err
    assert "below 60°" in done.err
    done = run("smooth", source, target, "--target-quality", 0.99)
    assert done.code == 1
    assert "target not met: the minimum η is" in done.err
    for wrong, message in (("--target-angle", "give target_dihedral"), ("--target-dihedral", "must lie in (0, 70.5]")):
        done = run("smooth", source, target, wrong, 75 if wrong == "--target-dihedral" else 10)
        assert done.code == 2
        assert message in done.err
