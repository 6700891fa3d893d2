"""ParaView's plugin, headless, in whatever ParaView is installed: what it does is what ``gmsnet.smooth`` does."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet.cli import main
from gmsnet.generate import lattice_volume, random_mesh
from gmsnet.paraview import PLUGIN

NEEDED = (
    "numpy", "numpy.libs", "scipy", "scipy.libs", "numba", "llvmlite", "safetensors", "typer", "click", "rich",
    "markdown_it", "mdurl", "pygments", "shellingham", "annotated_doc", "typing_extensions.py",
)  # fmt: skip
SOURCES = PLUGIN.parents[2]


@pytest.fixture(scope="module")
def pvpython(tmp_path_factory):
    """pvpython, and an environment in which it finds what gmsnet needs, without a VTK but its own."""
    path = shutil.which("pvpython")
    if path is None:
        pytest.skip("ParaView is not installed: there is no pvpython")
    asked = subprocess.run(
        [path, "-c", "import sys; print(*sys.version_info[:2])"], capture_output=True, text=True, timeout=120
    )
    if asked.stdout.split() != [str(each) for each in sys.version_info[:2]]:
        pytest.skip(f"ParaView's Python is another one: {asked.stdout.strip() or asked.stderr.strip()}")
    folder, installed = tmp_path_factory.mktemp("packages"), Path(find_spec("numpy").origin).parents[1]
    for name in NEEDED:
        if (installed / name).exists():
            (folder / name).symlink_to(installed / name)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(SOURCES)])}
    return path, environment


def run_filter(pvpython, source, target, *more, **changes):
    path, environment = pvpython
    command = [path, Path(__file__).with_name("run_filter.py"), PLUGIN, source, target, *more]
    return subprocess.run(
        list(map(str, command)), env={**environment, **changes}, capture_output=True, text=True, timeout=500
    )


@pytest.mark.parametrize("mesh", [random_mesh(150, seed=3), lattice_volume(3)], ids=["triangle", "tetra"])
def test_the_filter_does_what_the_api_does(pvpython, tmp_path, mesh):
    if mesh.has_volumes:
        points = mesh.points.copy()
        inner = np.setdiff1d(np.arange(len(points)), mesh.cells[1].nodes)
        points[inner] += 0.05 * np.random.default_rng(0).uniform(-1, 1, size=(len(inner), 3))
        mesh = mesh.with_points(points)
    source, target = tmp_path / "in.vtu", tmp_path / "out.vtu"
    gmsnet.write(mesh, source)
    done = run_filter(pvpython, source, target, *([] if mesh.has_volumes else ["planar"]))
    assert "TOLD " in done.stdout, done.stdout + done.stderr
    told = json.loads(done.stdout.partition("TOLD ")[2].splitlines()[0])
    given = gmsnet.read(source)
    wanted = gmsnet.smooth(given)
    assert told["type"] == "vtkUnstructuredGrid"
    assert told["moved"] == wanted.moved.sum() > 0
    assert told["least"] == wanted.after.shape.min()
    assert told["cells"] == sum(len(block.nodes) for block in given.cells)
    assert told["again"]
    assert told["another method"]
    assert told["progress"] > 2
    assert np.array_equal(gmsnet.read(target).points, wanted.points)
    assert told["sphere moved"] > 0
    assert "gmsnet: " in done.stdout + done.stderr  # of a method that is not for surfaces
    if not mesh.has_volumes:
        assert told["type of polygons"] == "vtkPolyData"
        assert told["polygons moved"] == told["moved"]
        assert told["moved for a low target"] == 0


def test_without_gmsnet_the_filter_says_what_to_install(pvpython, tmp_path):
    gmsnet.write(random_mesh(30, seed=3), tmp_path / "in.vtu")
    done = run_filter(pvpython, tmp_path / "in.vtu", tmp_path / "out.vtu", PYTHONPATH="")
    assert "gmsnet is not installed for ParaView's Python" in done.stdout + done.stderr


def test_the_subcommand_prints_the_path_alone(capsys):
    assert main(["paraview-plugin"]) == 0
    out, err = capsys.readouterr()
    assert out == f"{PLUGIN}\n"
    assert PLUGIN.is_file()
    assert "Manage Plugins" in err
