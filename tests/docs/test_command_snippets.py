"""The commands and the plain Python that README and pages print run as they stand, on files of such names."""

from __future__ import annotations

import re
import shlex
import shutil
import textwrap
from pathlib import Path

import numpy as np
import pytest
from support.optional import library

import gmsnet
from gmsnet.cli import main
from gmsnet.generate import layered_mesh, random_mesh, random_volume

ROOT = Path(__file__).parents[2]
COMMANDS = ("README.md", "docs/index.md", "docs/five-minutes.md", "docs/command-line.md", "docs/report.md")
PYTHON = ("README.md", "docs/python.md")
ELSEWHERE = ("--install-completion", "--show-completion", "warm-up", "gmsnet gmsh", "paraview-plugin")  # have own tests
PASSING = {0, 1}  # 1: a target is missed, which is an answer, too


def snippets(page: str, start: str) -> list[str]:
    """The lines of code that begin with this, without what stands behind ``#``."""
    text = (ROOT / page).read_text(encoding="utf-8")
    lines = re.findall(rf"^    (?:.*&& )?({start}[^\n#]*)", text, re.MULTILINE)
    return [part.strip() for line in lines for part in line.split("&&") if part.strip().startswith(start)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with meshes by the names that the pages use; the airfoil is a small one."""
    library("matplotlib")
    monkeypatch.chdir(tmp_path)
    gmsnet.write(layered_mesh(layers=4, aspect=20.0, around=40), tmp_path / "wing.su2")
    for name in ("bad.su2", "before.su2", "after.su2", "more.su2"):
        gmsnet.write(random_mesh(200, seed=1), tmp_path / name)
    (tmp_path / "cases").mkdir()
    for k in range(2):
        gmsnet.write(random_mesh(100, seed=k), tmp_path / "cases" / f"mesh-{k}.su2")
        gmsnet.write(random_mesh(100, seed=k), tmp_path / f"mesh-{k}.vtu")
    gmsnet.write(random_volume(60, seed=1), tmp_path / "part.vtu")
    return tmp_path


@pytest.mark.parametrize("page", COMMANDS)
def test_the_commands_of_a_page_run(page: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = snippets(page, "gmsnet ")
    assert found
    for command in found:
        if any(word in command for word in ELSEWHERE) or "cavity" in command:
            continue
        shutil.rmtree(folder / "fixed", ignore_errors=True)
        words = [sorted(map(str, Path().glob(word))) if "*" in word else [word] for word in shlex.split(command)[1:]]
        code = main([word for each in words for word in each])
        assert code in PASSING, f"{command}: exit code {code}: {capsys.readouterr().err}"


@pytest.mark.parametrize("page", PYTHON)
def test_the_python_of_a_page_runs(page: str, folder: Path) -> None:
    """All of a page in turn, with the names that it takes for granted."""
    mesh = random_mesh(100, seed=1)
    lines = mesh.cells[1].nodes
    names: dict[str, object] = {
        "points": mesh.points, "triangles": mesh.cells[0].nodes, "t": mesh.cells[0].nodes[:-2],
        "q": np.empty((0, 4), dtype=np.int64), "meshio_or_pyvista_object": _of_meshio(mesh),
        "material": np.arange(len(mesh.cells[0].nodes)) % 2, "edges": lines, "ids": lines[0],
    }  # fmt: skip
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"(?:^    [^\n]*\n(?:^\n(?=    ))?)+", text, re.MULTILINE)
    python = [block for block in blocks if re.match(r" *(import|from|result|given|mesh|try)\b", block)]
    assert python
    for block in python:
        exec(compile(textwrap.dedent(block), page, "exec"), names)


def _of_meshio(mesh: gmsnet.Mesh) -> object:
    meshio = library("meshio")
    return meshio.Mesh(mesh.points, [("triangle", mesh.cells[0].nodes)])
