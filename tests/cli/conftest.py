"""Runs the command line inside the test process, and makes mesh files to run it on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from support.hand_made import vtk_text

from gmsnet import CellBlock, Mesh
from gmsnet.cli import main
from gmsnet.generate import random_mesh
from gmsnet.io import write
from gmsnet.run.progress import COMPILING


@dataclass(frozen=True)
class Done:
    code: int
    out: str
    err: str


Run = Callable[..., Done]
NOTICE = f"gmsnet: {COMPILING}\n"


@pytest.fixture
def run(capsys) -> Run:
    """run("smooth", path, …) → exit code and what was printed."""

    def call(*arguments) -> Done:
        code = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return Done(code, out, err.replace(NOTICE, ""))  # whether kernels are in the cache is another test's concern

    return call


@pytest.fixture(scope="session")
def square_bytes(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("square") / "square.su2"
    write(random_mesh(200, seed=4), path)
    return path.read_bytes()


@pytest.fixture
def square(tmp_path, square_bytes) -> Path:
    """A random square of 200 inner nodes, with the markers bottom, right, top and left."""
    path = tmp_path / "square.su2"
    path.write_bytes(square_bytes)
    return path


@pytest.fixture
def quads(tmp_path) -> Path:
    """Four squares around one inner node."""
    points = [(x, y, 0.0) for y in (0.0, 1.0, 2.0) for x in (0.0, 1.0, 2.0)]
    cells = [(a, a + 1, a + 4, a + 3) for a in (0, 1, 3, 4)]
    path = tmp_path / "quads.vtk"
    path.write_text(vtk_text(points, cells, 9))
    return path


@pytest.fixture
def polygons(tmp_path):
    """Three pentagons around a node: cells that are neither measured nor smoothed."""
    angles = np.radians(40.0 * np.arange(9))
    points = np.vstack([[0.0, 0.0], np.column_stack([np.cos(angles), np.sin(angles)])])
    cells = np.array([[0, *(1 + (3 * k + np.arange(4)) % 9)] for k in range(3)])
    path = tmp_path / "polygons.vtk"
    write(Mesh(points, (CellBlock("polygon", cells, np.zeros(3, dtype=int)),)), path)
    return path
