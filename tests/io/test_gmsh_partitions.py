"""Partitioned Gmsh files: what lies between partitions is no shape, and parts of a group are the group."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.damage import cells_of, regions_of
from support.gmsh_split import split
from support.gmsh_variants import Out
from support.pieces import ring, strips

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io import gmsh
from gmsnet.mesh.cell_block import CellBlock

# Three rows of three nodes; the part left of x = 1 is partition 1, that right of it partition 2.
POINTS = [(float(x), float(y), 0.0) for y in range(3) for x in range(3)]
POINTS[4] = (1.125, 0.875, 0.0)
LEFT = [(0, 1, 4), (0, 4, 3), (3, 4, 7), (3, 7, 6)]
RIGHT = [(1, 2, 5), (1, 5, 4), (4, 5, 8), (4, 8, 7)]
WALL = [[(1, 0), (0, 3), (3, 6), (6, 7)], [(1, 2), (2, 5), (5, 8), (8, 7)]]  # of each partition
BETWEEN = [(1, 4), (4, 7)]
POINT, LINE, TRIANGLE = 15, 1, 2
GROUPS = {  # of wall 1, wall 2, between, face 1, face 2: as Gmsh leaves them, and as it can make them
    "none": ("", [0, 0, 0, 0, 0]),
    "kept": ('$PhysicalNames\n2\n1 2 "wall"\n2 1 "fluid"\n$EndPhysicalNames\n', [2, 2, 0, 1, 1]),
    "cut": (
        '$PhysicalNames\n7\n1 2 "wall"\n1 3 "_part{1}_physical{2}_dim{1}"\n1 4 "_part{2}_physical{2}_dim{1}"\n'
        '1 5 "_part{1,2}_physical{1}_dim{1}"\n2 1 "fluid"\n2 6 "_part{1}_physical{1}_dim{2}"\n'
        '2 7 "_part{2}_physical{1}_dim{2}"\n$EndPhysicalNames\n',
        [3, 4, 5, 6, 7],
    ),
}


def head(out: Out, version: str, names: str) -> None:
    out.text(f"$MeshFormat\n{version} {int(bool(out.order))} 8\n")
    if out.order:
        out.put("i", 1)
    out.close("MeshFormat")
    out.text(names)


def new(order: str, case: str, internal: bool = False) -> bytes:
    """Version 4.1. internal: the lines are parts of a curve of the geometry, not of a surface."""
    out, (names, groups) = Out(order), GROUPS[case]
    head(out, "4.1", names)
    out.text("$PartitionedEntities\n")
    out.put("Q", 2)
    out.put("Q", 0)
    out.put("Q", 2, 3, 2, 0)
    parents = [(0, 1, 1, [1, 2]), (0, 2, 1, [1, 2]), (1, 11, 1, [1]), (1, 12, 1, [2]),
               (1, 13, 1 if internal else 2, [1, 2]), (2, 21, 2, [1]), (2, 22, 2, [2])]  # fmt: skip
    physical = {11: groups[0], 12: groups[1], 13: groups[2], 21: groups[3], 22: groups[4]}
    for dim, tag, parent, parts in parents:
        out.put("i", tag, end=" ")
        out.put("i", parent, 1, end=" ")
        out.put("Q", len(parts), end=" ")
        out.put("i", *parts, end=" ")
        out.put("d", *([0.0] * (6 if dim else 3)), end=" ")
        tags = [physical[tag]] if physical.get(tag) else []
        out.put("Q", len(tags), end=" ")
        out.put("i", *tags, end=" ")
        if dim:
            out.put("Q", 0, end=" ")
        out.put("i", end="\n")
    out.close("PartitionedEntities")
    out.text("$Nodes\n")
    out.put("Q", 1, 9, 1, 9)
    out.put("i", 2, 21, 0, end=" ")
    out.put("Q", 9)
    for k in range(9):
        out.put("Q", k + 1)
    for point in POINTS:
        out.put("d", *point)
    out.close("Nodes")
    out.text("$Elements\n")
    blocks = [(0, 1, POINT, [(1,)]), (0, 2, POINT, [(7,)]), (1, 11, LINE, WALL[0]), (1, 12, LINE, WALL[1]),
              (1, 13, LINE, BETWEEN), (2, 21, TRIANGLE, LEFT), (2, 22, TRIANGLE, RIGHT)]  # fmt: skip
    count = sum(len(cells) for *_, cells in blocks)
    out.put("Q", len(blocks), count, 1, count)
    number = 0
    for dim, tag, code, cells in blocks:
        out.put("i", dim, tag, code, end=" ")
        out.put("Q", len(cells))
        for cell in cells:
            number += 1
            out.put("Q", number, *(node + 1 for node in cell))
    out.close("Elements")
    return b"".join(out.parts)


def old(order: str, case: str, internal: bool = False) -> bytes:
    """Version 2.2, in which Gmsh gives what lies between partitions no partition."""
    out, (names, groups) = Out(order), GROUPS[case]
    head(out, "2.2", names)
    out.text("$Nodes\n9\n")
    for k, point in enumerate(POINTS):
        out.put("i", k + 1, end=" ")
        out.put("d", *point)
    out.close("Nodes")
    inner = (1, 1) if internal else ()
    blocks = [(POINT, (0, 1), [(1,), (7,)]),
              (LINE, (groups[0], 11, 1, 1), WALL[0]), (LINE, (groups[1], 12, 1, 2), WALL[1]),
              (LINE, (groups[2], 13, *inner), BETWEEN), (TRIANGLE, (groups[3], 21, 1, 1), LEFT),
              (TRIANGLE, (groups[4], 22, 2, 2, -1), RIGHT)]  # fmt: skip
    out.text(f"$Elements\n{sum(len(cells) for *_, cells in blocks)}\n")
    number = 0
    for code, tags, cells in blocks:
        if order:
            out.put("i", code, len(cells), len(tags))
        for cell in cells:
            number += 1
            out.put("i", number, *(() if order else (code, len(tags))), *tags, *(node + 1 for node in cell))
    out.close("Elements")
    return b"".join(out.parts)


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
