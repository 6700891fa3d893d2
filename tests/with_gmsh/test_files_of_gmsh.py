"""Files that Gmsh writes, by itself and by the libraries of MED and CGNS, hold the mesh that Gmsh has."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.optional import library

import gmsnet

SIZE = 0.3


@pytest.fixture(scope="module")
def model() -> Iterator[tuple[Any, int, int]]:
    """Gmsh with a cube whose sides have names; how many nodes and tetrahedra it has."""
    gmsh = library("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", SIZE)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="body")
        for name, tags in (("walls", [1, 2]), ("rest", [3, 4, 5, 6])):
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        gmsh.model.mesh.generate(3)
        tetrahedra = gmsh.model.mesh.getElementsByType(4)[0]
        yield gmsh, len(gmsh.model.mesh.getNodes()[0]), len(tetrahedra)
    finally:
        gmsh.finalize()


@pytest.mark.parametrize(
    ("suffix", "named"), [("med", True), ("cgns", False), ("msh", True), ("su2", True), ("inp", True), ("bdf", False)]
)
def test_the_mesh_is_that_of_gmsh(model: tuple[Any, int, int], suffix: str, named: bool, tmp_path: Path) -> None:
    gmsh, nodes, tetrahedra = model
    path = tmp_path / f"a.{suffix}"
    gmsh.write(str(path))
    mesh = gmsnet.read(path)
    assert len(mesh.points) == nodes
    assert sum(len(block.nodes) for block in mesh.cells if block.kind == "tetra") == tetrahedra
    if named:
        assert {"walls", "rest"} <= {*mesh.markers, *mesh.node_sets}
    result = gmsnet.smooth(mesh)
    assert result.moved.any()
    gmsnet.write(result.mesh, tmp_path / f"b.{suffix}")
    again = gmsnet.read(tmp_path / f"b.{suffix}")
    assert np.allclose(again.points, result.points, rtol=0, atol=1e-5)
