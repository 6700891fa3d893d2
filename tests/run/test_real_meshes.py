"""Real meshes from other projects, file to file: as they are, jittered, tangled; natively and converted."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import naive

import gmsnet
from gmsnet.cli import main
from gmsnet.generate import disturb
from gmsnet.topology.held import OF_SECOND_ORDER
from gmsnet.topology.topology import Topology

PLANAR = (
    "mesh_NACA0012_inv.su2", "japan_sea.msh", "insulated.msh", "internal.msh", "helmholtz_apartment.vtk",
    "osteonT1_11.mesh", "square-disc-p2.vtk", "square_triquad.mesh", "square_quad_10_rand.vtk", "tangled_quad.vtk",
    "quad_append_raw_compress.vtu",
)  # fmt: skip
VARIANTS = {"as it is": None, "jittered": True, "tangled": False}  # the value: kept valid?
CONVERTED = (".su2", ".msh", ".vtk", ".vtu", ".mesh", ".stl", ".obj", ".off", ".ply", ".node")


def varied(folder: Path, name: str, variant: str) -> gmsnet.Mesh:
    mesh = gmsnet.read(folder / name)
    if VARIANTS[variant] is None:
        return mesh
    return disturb(mesh, Topology.of(mesh).free, 0.4, seed=1, keep_valid=bool(VARIANTS[variant]))


def referee(source: Path, target: Path) -> None:
    """Runs the program that GMSNET_REFEREE names, if any: ``compare IN OUT`` must exit with 0 (2: cannot read it)."""
    program = os.environ.get("GMSNET_REFEREE")
    if program:
        call = [sys.executable, program, "compare", str(source), str(target)]
        verdict = subprocess.run(call, capture_output=True, text=True, check=False)
        unread = verdict.returncode == 2 and source.suffix == ".vtu" and "binary or appended" in verdict.stderr
        assert verdict.returncode == 0 or unread, verdict.stdout + verdict.stderr


def check(source: Path, target: Path) -> None:
    before, after = gmsnet.read(source), gmsnet.read(target)
    assert before.source is not None
    assert after.source is not None
    spliced = before.source.splice(after.points)
    main_suffix = next(iter(spliced))
    assert bytes(spliced[main_suffix]) == target.with_suffix(main_suffix).read_bytes()
    if source.suffix != ".stl":  # an STL file has no node numbers of its own
        moved = (before.points != after.points).any(axis=1)
        held = [ids for reason, ids in Topology.of(before).held.items() if reason != OF_SECOND_ORDER]
        assert not moved[np.concatenate([[-1], *held]).astype(int)[1:]].any()
        turn = Topology.of(before).orientation
        triangles = Topology.of(before).triangles
        was = np.array(naive.signs(before.points[:, :2], triangles, turn)) if len(triangles) < 3000 else None
        if was is not None and len(was) and before.plane == (0, 1):
            now = np.array(naive.signs(after.points[:, :2], triangles, turn))
            assert (now[was > 0] > 0).all()
    referee(source, target)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("name", PLANAR)
def test_smooth_moves_free_nodes_and_nothing_else(real_meshes, tmp_path, name, variant):
    source, target = tmp_path / name, tmp_path / f"out{Path(name).suffix}"
    gmsnet.write(varied(real_meshes, name, variant), source)
    assert main(["smooth", str(source), str(target), "--quiet"]) == 0
    check(source, target)


@pytest.mark.parametrize("suffix", CONVERTED)
@pytest.mark.parametrize("name", ["insulated.msh", "helmholtz_apartment.vtk"])
def test_the_same_in_every_format(real_meshes, tmp_path, name, suffix):
    mesh = varied(real_meshes, name, "tangled")
    source, target = tmp_path / f"in{suffix}", tmp_path / f"out{suffix}"
    gmsnet.write(mesh, source)
    assert main(["smooth", str(source), str(target), "--quiet"]) == 0
    check(source, target)


def test_hexahedra_of_two_regions(real_meshes, tmp_path):
    source, target = real_meshes / "matrix_fiber.mesh", tmp_path / "matrix_fiber.mesh"
    assert main(["smooth", str(source), str(target), "--quiet"]) == 0
    before, after = gmsnet.quality(gmsnet.read(source)), gmsnet.quality(gmsnet.read(target))
    assert before.inverted == after.inverted == 0
    assert after.shape.min() >= before.shape.min()
    referee(source, target)


def test_the_usual_airfoil_keeps_its_250_boundary_nodes_and_gets_better(real_meshes):
    mesh = gmsnet.read(real_meshes / "mesh_NACA0012_inv.su2")
    result = gmsnet.smooth(mesh)
    assert len(result.held["boundary"]) == 250
    assert set(mesh.markers) >= {"airfoil", "farfield"}
    assert result.after.shape.min() > result.before.shape.min()
    assert result.after.inverted == 0


def test_figures_of_the_real_meshes(real_meshes):
    """Least and mean smallest angle, largest angle, mean 1/q, as measured by others."""
    for name, low, mean, high, shape in (
        ("mesh_NACA0012_inv.su2", 20.03, 50.47, 122.07, 0.9625),
        ("japan_sea.msh", 3.76, 48.64, 129.75, 0.9472),
        ("insulated.msh", 34.95, 43.03, 103.72, 0.8896),
        ("internal.msh", 38.46, 53.06, 90.00, 0.9755),
        ("helmholtz_apartment.vtk", 12.89, 43.61, 134.02, 0.8785),
        ("osteonT1_11.mesh", 19.67, 47.15, 114.15, 0.929),
        ("square-disc-p2.vtk", 25.09, 44.89, 112.56, 0.9128),
        ("sph.vtk", 13.89, 33.47, 110.58, 0.7233),
    ):
        report = gmsnet.quality(gmsnet.read(real_meshes / name))
        assert report.min_angle.min() == pytest.approx(low, abs=0.006)
        assert report.min_angle.mean() == pytest.approx(mean, abs=0.006)
        assert report.max_angle.max() == pytest.approx(high, abs=0.006)
        assert report.shape.mean() == pytest.approx(shape, abs=6e-5)
        assert report.inverted == 0
