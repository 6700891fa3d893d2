"""TetGen's pair of files, the sister of Triangle's in space: reading, splicing, damage, conversion, a real one."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import contents, spliced
from support.damage import cells_of, check_cuts, damaged, facts, read_or_refuse, regions_of

from gmsnet import io
from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io import triangle
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

NODE = b"""# Node count, 3 dim, attributes, boundary markers
5 3 1 1
0  0.0 -0.0 0 0.5 4
1  1e0 0 0 0.5 4 # a corner
2  0 1 0 0.5 -1
3  0 0 1 0.5 0
4  0.5 0.5 0.5 0.25 0
"""
ELE = b"2 4 1\n0 0 1 2 3 7\n1 1 2 4 3 8\n# the end\n"
FILES = {".node": NODE, ".ele": ELE}
ALPHA = Path(os.environ.get("GMSNET_MESHES", "")) / "cleaver_alpha.node"


def test_a_plain_pair() -> None:
    parsed = triangle.read(FILES)
    assert parsed.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0.5]]
    assert cells_of(parsed, "tetra") == [[0, 1, 2, 3], [1, 2, 4, 3]]
    assert regions_of(parsed, "tetra") == [7, 8]
    assert cells_of(parsed, "vertex") == [[0], [1], [2]]  # boundary markers
    assert regions_of(parsed, "vertex") == [4, 4, -1]
    assert parsed.point_data["triangle:attribute1"].tolist() == [0.5] * 4 + [0.25]


def test_only_coordinates_change() -> None:
    parsed = triangle.read(FILES)
    points = parsed.points.copy()
    points[4] = [0.25, 0.5, 1 / 3]
    out = spliced(parsed.slots, NODE, parsed.points, points)
    assert out == NODE.replace(b"4  0.5 0.5 0.5 0.25", b"4  0.25 0.5 0.3333333333333333 0.25")
    again = triangle.read({**FILES, ".node": out})
    assert again.points.tolist() == points.tolist()
    assert facts(again)[1:] == facts(parsed)[1:]


@pytest.mark.parametrize("suffix", [".node", ".ele"])
def test_a_cut_file_is_refused_or_the_same(suffix: str) -> None:
    end = len(FILES[suffix].rstrip().removesuffix(b"# the end").rstrip()) - (suffix == ".ele")
    check_cuts(triangle, FILES, suffix, lambda rest: len(rest) >= end)


@given(st.data(), st.sampled_from([".node", ".ele"]))
def test_damage_is_refused_in_words(data: st.DataObject, suffix: str) -> None:
    read_or_refuse(triangle, {**FILES, suffix: data.draw(damaged(FILES[suffix]))})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"5 3 1 1", b"5 2 2 1", r"the cells have 4 nodes: beside a .node file of 2 coordinates there can be 3 or 6"),
        (b"5 3 1 1", b"5 3 2 1", r"^line 3: a point takes 7 numbers here, found 6"),
        (b"2 4 1", b"2 5 1", r"^in the .ele file beside it: line 1: the cells have 5 nodes: .* can be 4 or 10"),
        (b"0 0 1 2 3", b"0 0 1 2 5", r"^in the .ele file beside it: line 2: a tetrahedron names the node 5, .* 0 to 4"),
        (b"1 1 2 4 3 8\n", b"", r"^in the .ele file beside it: line 4: expected 1 more lines"),
        (b"2 4 1", b"1 4 1", r"line 3: the file goes on behind the 1 cells that its first line announces"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in NODE + ELE
    with pytest.raises(FormatError, match=message):
        triangle.read({suffix: data.replace(old, new, 1) for suffix, data in FILES.items()})


def test_nodes_on_edges_are_those_between_their_ends() -> None:
    """TetGen's order of the second-order nodes, by its manual: 34, 14, 12, 23, 24, 13, counted from 1."""
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]])
    middles = [(corners[int(a) - 1] + corners[int(b) - 1]) // 2 for a, b in ("34", "14", "12", "23", "24", "13")]
    node = "".join(f"{k} {x} {y} {z}\n" for k, (x, y, z) in enumerate([*corners, *middles], 1))
    ele = b"1 10 0\n1 1 2 3 4 5 6 7 8 9 10\n"
    parsed = triangle.read({".node": b"10 3 0 0\n" + node.encode(), ".ele": ele})
    (nodes,) = cells_of(parsed, "tetra10")
    place = parsed.points[nodes]
    for first, second, between in CELLS["tetra10"].edges:
        assert place[between].tolist() == ((place[first] + place[second]) / 2).tolist()
    assert contents(triangle.write(Mesh(parsed.points, tuple(parsed.cells))))[".ele"] == ele.replace(
        b" 10 0", b" 10 1"
    ).replace(b" 10\n", b" 10 0\n")


def test_conversion_turns_faces_into_markers_and_names_what_is_lost() -> None:
    cells = (
        CellBlock("tetra", [[0, 1, 2, 3], [1, 2, 4, 3]], [7, 8]),
        CellBlock("triangle", [[0, 1, 2]], [5]),
        CellBlock("line", [[0, 3]], [6]),
    )
    mesh = Mesh(triangle.read(FILES).points, cells, {(3, 7): "steel", (2, 5): "wall"})
    written = triangle.write(mesh)
    assert written.lost == [
        "TetGen cannot hold surface cells: 1 was turned into markers of their nodes (5)",
        "TetGen cannot hold line cells: 1 was turned into markers of their nodes (6)",
        "TetGen cannot hold several markers of a node: of those of 1 one each was kept",
        "TetGen numbers its markers: the name 'wall' (5) was left out",
        "TetGen numbers its regions and markers: the name 'steel' (7) was left out",
    ]
    again = triangle.read(contents(written))
    assert again.points.tobytes() == mesh.points.tobytes()
    assert cells_of(again, "tetra") == cells_of(mesh, "tetra")
    assert regions_of(again, "tetra") == [7, 8]
    assert cells_of(again, "vertex") == [[0], [1], [2], [3]]
    with pytest.raises(FormatError, match="TetGen cannot hold cells of type 'hexahedron'"):
        triangle.write(replace(mesh, cells=(*cells, CellBlock("hexahedron", [[0, 1, 2, 3, 4, 0, 1, 2]], [0]))))


@pytest.mark.skipif(not ALPHA.is_file(), reason="GMSNET_MESHES does not name the folder of real meshes")
def test_a_real_pair(tmp_path: Path) -> None:
    mesh = io.read(ALPHA)
    assert (len(mesh.points), [len(b.nodes) for b in mesh.cells]) == (1863, [9261])
    assert io.write(mesh, tmp_path / "same.node") == []
    assert (tmp_path / "same.node").read_bytes() == ALPHA.read_bytes()
    assert (tmp_path / "same.ele").read_bytes() == ALPHA.with_suffix(".ele").read_bytes()
