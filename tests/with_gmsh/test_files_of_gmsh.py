"""Files that Gmsh writes, by itself and by the libraries of MED and CGNS, hold the mesh that Gmsh has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gmsnet


def cube(gmsh: Any) -> tuple[int, int]:
    """Meshes a cube whose sides have names; how many nodes and tetrahedra it has."""
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [1], name="body")
    for name, tags in (("walls", [1, 2]), ("rest", [3, 4, 5, 6])):
        gmsh.model.addPhysicalGroup(2, tags, name=name)
    gmsh.model.mesh.generate(3)
    return len(gmsh.model.mesh.getNodes()[0]), len(gmsh.model.mesh.getElementsByType(4)[0])


@pytest.mark.parametrize(
    ("suffix", "named"), [("med", True), ("cgns", False), ("msh", True), ("su2", True), ("inp", True), ("bdf", False)]
)
def test_the_mesh_is_that_of_gmsh(gmsh: Any, suffix: str, named: bool, tmp_path: Path) -> None:
    nodes, tetrahedra = cube(gmsh)
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


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("recombine", [0, 1])
def test_cells_in_several_groups_are_the_same_in_both_versions(
    gmsh: Any, binary: int, recombine: int, tmp_path: Path
) -> None:
    """Version 2.2 lists them once for each group, 4.1 once. A name means all cells of its group."""
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
    gmsh.option.setNumber("Mesh.RecombineAll", recombine)
    gmsh.option.setNumber("Mesh.Binary", binary)
    occ = gmsh.model.occ
    occ.fragment([(2, occ.addRectangle(0, 0, 0, 1, 1))], [(2, occ.addRectangle(1, 0, 0, 1, 1))])
    occ.synchronize()
    for name, dim, tags in (("domain", 2, [1, 2]), ("heater", 2, [2]), ("walls", 1, [1, 2, 3]), ("inlet", 1, [2])):
        gmsh.model.addPhysicalGroup(dim, tags, name=name)
    gmsh.model.mesh.generate(2)
    meshes = []
    for version in (2.2, 4.1):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write(str(tmp_path / "a.msh"))
        meshes.append(gmsnet.read(tmp_path / "a.msh"))
    old, new = meshes
    assert old.markers.keys() == new.markers.keys() >= {"domain", "heater", "walls", "inlet"}
    for name, nodes in old.markers.items():
        assert nodes.tolist() == new.markers[name].tolist()
    assert len(new.markers["domain"]) == len(new.points)
    assert set(new.markers["inlet"]) < set(new.markers["walls"])
    assert old.cells[0].kind == "line"
    for kind in ("line", "triangle", "quad"):
        counts = [sum(len(block.nodes) for block in mesh.cells if block.kind == kind) for mesh in meshes]
        assert counts[0] == counts[1]
    assert gmsnet.quality(old).inverted == 0
