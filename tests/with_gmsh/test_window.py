"""Gmsh's window: what its button does, without a window and, where there is a display for it, with one."""

from __future__ import annotations

import shutil
import subprocess
import sys

import numpy as np
import pytest

from gmsnet.cli import main
from gmsnet.gmsh import window
from with_gmsh.conftest import places, plate, throw


def said(gmsh):
    """What the log says of us."""
    return [line for line in gmsh.logger.get() if "gmsnet: " in line]


def test_the_button_smooths_with_the_options_of_the_menu(gmsh):
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    before = places(gmsh)[1]
    window.offer(gmsh)
    gmsh.logger.start()
    assert not window.carry_out(gmsh)
    assert np.array_equal(places(gmsh)[1], before)
    gmsh.onelab.setString(window.ACTION, [window.SMOOTH])
    gmsh.onelab.setNumber(window.TARGET, [0.4])
    gmsh.onelab.setString(window.GEOMETRY, [window.SLIDING])
    assert window.carry_out(gmsh)
    assert (places(gmsh)[1] != before).any()
    assert "slide:" in said(gmsh)[-1]
    assert not window.carry_out(gmsh)  # once for each time it is pressed


def test_what_goes_wrong_is_said_in_the_log(gmsh):
    window.offer(gmsh)
    gmsh.model.add("empty")
    gmsh.logger.start()
    gmsh.onelab.setString(window.ACTION, [window.SMOOTH])
    assert window.carry_out(gmsh)
    line = said(gmsh)[-1]  # Gmsh keeps what other tests have logged
    assert line.startswith("Warning: gmsnet: the model has no surface or volume elements")


def test_another_file_brings_the_button_back(gmsh):
    window.offer(gmsh)
    gmsh.onelab.clear()
    assert not list(gmsh.onelab.getNames("gmsnet/.*"))
    gmsh.onelab.setString(window.ACTION, ["check"])
    assert not window.carry_out(gmsh)
    assert len(gmsh.onelab.getNames("gmsnet/.*")) == 3


PRESSED = """
import sys, gmsh
from gmsnet.gmsh import window
wait, looks = gmsh.fltk.wait, []
def pressing():
    wait(0.1)
    looks.append(gmsh.model.mesh.getNodes()[1])
    if len(looks) == 3:
        gmsh.onelab.setString(window.ACTION, [window.SMOOTH])
    if len(looks) == 6:
        gmsh.write(sys.argv[2])
        gmsh.fltk.finalize()
gmsh.fltk.wait = pressing
window.run(gmsh, sys.argv[1])
print((looks[0] == looks[2]).all(), (looks[0] == looks[-1]).all(), gmsh.isInitialized())
"""


def test_a_window_opens_smooths_and_closes(gmsh, tmp_path):
    if shutil.which("xvfb-run") is None:
        pytest.skip("a window needs a display: xvfb-run is not installed")
    plate(gmsh)
    throw(gmsh, 2, 0.02)
    mesh, picture = tmp_path / "plate.msh", tmp_path / "window.png"
    gmsh.write(str(mesh))
    done = subprocess.run(
        ["xvfb-run", "-a", sys.executable, "-c", PRESSED, str(mesh), str(picture)],
        capture_output=True, text=True, timeout=240,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "True False 0"
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_subcommand_names_what_is_missing(tmp_path, capsys, monkeypatch):
    assert main(["gmsh", str(tmp_path / "none.msh")]) == 2
    assert "none.msh: there is no such file" in capsys.readouterr().err
    path = tmp_path / "some.msh"
    path.write_text("")
    monkeypatch.setitem(sys.modules, "gmsh", None)
    assert main(["gmsh", str(path)]) == 2
    assert "Gmsh is not installed: pip install gmsh" in capsys.readouterr().err
