"""Partitioned Gmsh files: what lies between partitions is no shape, and parts of a group are the group."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.damage import cells_of, regions_of
from support.gmsh_partitioned import BETWEEN, GROUPS, LEFT, RIGHT, WALL, new, old
from support.gmsh_split import split
from support.pieces import ring, strips

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io import gmsh
from gmsnet.mesh.cell_block import CellBlock

# Three rows of three nodes; the part left of x = 1 is partition 1, that right of it partition 2.


@pytest.mark.parametrize("version", [new, old])
@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("case", GROUPS)
def test_what_lies_between_partitions_holds_no_node(case: str, order: str, version, tmp_path: Path) -> None:
    path, out = tmp_path / "a.msh", tmp_path / "b.msh"
    path.write_bytes(version(order, case))
    mesh = gmsnet.read(path)
    assert cells_of(mesh, "triangle") == [list(cell) for cell in LEFT + RIGHT]
    assert cells_of(mesh, "line") == [list(cell) for cell in WALL[0] + WALL[1]]
    assert cells_of(mesh, "vertex") == []
    named = case != "none"
    assert set(regions_of(mesh, "triangle")) == {int(named)}
    assert set(regions_of(mesh, "line")) == {2 * named}
    assert dict(mesh.region_names) == ({(1, 2): "wall", (2, 1): "fluid"} if named else {})
    result = gmsnet.smooth(mesh)
    assert {reason: ids.tolist() for reason, ids in result.held.items()} == {"boundary": [0, 1, 2, 3, 5, 6, 7, 8]}
    assert np.flatnonzero(result.moved).tolist() == [4]
    assert gmsnet.write(mesh, out) == []
    assert out.read_bytes() == path.read_bytes()
    lost = gmsnet.write(result.mesh, tmp_path / "b.vtu")
    assert "4 lines and points between partitions" in lost[-1]


@pytest.mark.parametrize("version", [new, old])
@pytest.mark.parametrize("order", ["", "<"])
def test_a_line_that_is_a_part_of_the_geometry_holds_its_nodes(order: str, version) -> None:
    parsed = gmsh.read({".msh": version(order, "none", internal=True)})
    assert [list(cell) for cell in BETWEEN] == cells_of(parsed, "line")[8:]


@pytest.mark.parametrize("version", [new, old])
def test_so_does_a_line_of_a_group_of_the_user(version) -> None:
    data = version("", "cut").replace(b'"_part{1,2}_physical{1}_dim{1}"', b'"sensor"')
    parsed = gmsh.read({".msh": data})
    assert cells_of(parsed, "line")[8:] == [list(cell) for cell in BETWEEN]
    assert parsed.region_names[1, 5] == "sensor"


def test_without_partitions_lines_without_a_group_are_shape() -> None:
    """Version 2.2, where partitions of faces alone say nothing of lines."""
    data = old("", "none")
    for tags in (b"1 4 0 11 1 1", b"1 4 0 12 1 2"):
        data = data.replace(tags, b"1 2 0" + tags[5:8])
    parsed = gmsh.read({".msh": data})
    assert len(cells_of(parsed, "line")) == 10
    assert len(cells_of(parsed, "vertex")) == 2


def test_a_face_between_partitions_of_a_volume_is_no_shape() -> None:
    """Two tetrahedra: that between them Gmsh adds as a triangle of an entity whose parent is the volume."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.0]])
    cells = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    mesh = gmsnet.Mesh(points, [CellBlock("tetra", cells, np.zeros(2, dtype=np.int64))])
    (data,) = split(mesh, 1)
    between = data.replace(b"\n0 0 0 1\n", b"\n0 0 1 1\n9 3 1 2 1 2 0 0 0 0 0 0 0 0 \n")
    between = between.replace(b"$Elements\n1 2 1 2\n", b"$Elements\n2 3 1 3\n2 9 2 1\n3 2 3 4 \n")
    assert between.count(b"\n2 9 2 1\n") == between.count(b"\n9 3 1 2 1 2 ") == 1
    parsed = gmsh.read({".msh": between})
    assert [(block.kind, len(block.nodes)) for block in parsed.cells] == [("tetra", 2)]
    assert "1 faces, lines and points between partitions" in parsed.unread
    named = gmsh.read({".msh": between.replace(b"1 2 0 0 0 0 0 0 0 0 \n", b"1 2 0 0 0 0 0 0 1 7 0 \n")})
    assert [(block.kind, len(block.nodes)) for block in named.cells] == [("triangle", 1), ("tetra", 2)]


@pytest.mark.parametrize("order", ["", "<", ">"])
def test_cells_that_another_file_owns_are_held(order: str, tmp_path: Path) -> None:
    flat = gmsnet.random_mesh(120, seed=3)
    mesh = gmsnet.Mesh(np.column_stack([flat.points, np.zeros(len(flat.points))]), flat.cells)
    own = strips(mesh, 2)[0]
    path = tmp_path / "a_1.msh"
    path.write_bytes(split(mesh, 2, ghosts=True, order=order)[0])
    read = gmsnet.read(path)
    copies = ring(mesh, own)
    assert len(read.cells[0].nodes) == len(own) + len(copies)
    place = {tuple(point): k for k, point in enumerate(read.points.tolist())}
    held = {place[tuple(point)] for point in mesh.points[np.unique(mesh.cells[0].nodes[copies])].tolist()}
    result = gmsnet.smooth(read, "laplacian", max_sweeps=2)
    assert result.moved.any()
    assert not held & set(np.flatnonzero(result.moved).tolist())
    gmsnet.write(result.mesh, tmp_path / "b_1.msh")
    assert gmsnet.read(tmp_path / "b_1.msh").points.tobytes() == result.mesh.points.tobytes()


def test_numbers_of_groups_that_no_array_holds() -> None:
    parts = new("", "cut").replace(b"_physical{1}", b"_physical{%d}" % 10**30)
    assert gmsh.read({".msh": parts}).region_names[2, 6].endswith("}_dim{2}")  # a name like any other
    data = new("", "kept")
    twice = data.replace(b" 1 1 0 \n22", b" 2 1 %d 0 \n22" % (2**63 - 1))
    assert twice != data
    with pytest.raises(FormatError, match="the physical tag 9223372036854775807 is larger than those that Gmsh has"):
        gmsh.read({".msh": twice})
