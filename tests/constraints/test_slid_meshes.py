"""Meshes whose boundary nodes were slid at random, before the independent referee that GMSNET_REFEREE names."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from support.sliding import slid_at_random

import gmsnet
from gmsnet import Mesh
from gmsnet.constraints.features import curves_of
from gmsnet.generate.random import random_mesh

PROMISED = {"bytes", "fixed", "plane", "inverted", "surface", "order"}


def verdicts(before, after, *options: str) -> dict[str, dict]:
    program = os.environ.get("GMSNET_REFEREE")
    if not program:
        pytest.skip("GMSNET_REFEREE names no program")
    command = [sys.executable, program, "compare", str(before), str(after), "--slide", "--json", *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode < 2, done.stderr
    return {check["name"]: check for check in json.loads(done.stdout)["checks"]}


def check(mesh: Mesh, before, after, *options: str) -> dict[str, dict]:
    curves = curves_of(mesh)
    slid = slid_at_random(mesh, curves, 0)
    moved = (slid.points != mesh.points).any(axis=1)
    assert not moved[~curves.slides].any()
    assert moved[curves.slides].sum() > 0.6 * curves.slides.sum()
    gmsnet.write(slid, after)
    found = verdicts(before, after, *options)
    assert found.keys() >= PROMISED
    assert [found[name]["detail"] for name in PROMISED if not found[name]["ok"]] == []
    return found


@pytest.mark.parametrize(
    "name",
    [
        "mesh_NACA0012_inv.su2", "internal.msh", "japan_sea.msh", "ex28.msh", "osteonT1_11.mesh", "square_triquad.mesh",
        "square_quad_10_rand.vtk", "n0012_113-33.su2", "mesh_NACA0012_lam_hybrid_v1.su2",
    ],
)  # fmt: skip
def test_real_meshes(real_meshes, tmp_path, name):
    check(gmsnet.read(real_meshes / name), real_meshes / name, tmp_path / name)


@pytest.mark.parametrize("suffix", [".msh", ".vtk"])
@pytest.mark.parametrize("shape", ["square", "circle", "plate", "lshape"])
def test_random_meshes(tmp_path, shape, suffix):
    before = tmp_path / f"before{suffix}"
    gmsnet.write(random_mesh(1000, shape, boundary="random", seed=5), before)
    found = check(gmsnet.read(before), before, tmp_path / f"after{suffix}", "--circle", "0.5", "0.5", "0.5")
    if shape == "circle":
        words = found["circle"]["detail"]
        assert float(words.split("in edge lengths: at most ")[1].split(",")[0]) < 1e-11


def test_single_precision(tmp_path):
    mesh = random_mesh(500, "circle", boundary="random", seed=5)
    before = tmp_path / "before.vtk"
    gmsnet.write(mesh, before)
    before.write_text(before.read_text().replace(" double", " float", 1))
    mesh = gmsnet.read(before)
    assert mesh.single
    found = check(mesh, before, tmp_path / "after.vtk")
    assert np.isfinite(float(found["surface"]["detail"].split("at most ")[1].split(",")[0]))
