"""Medit: many spellings of one mesh, damage, references, conversion."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import contents, spliced
from support.damage import (
    ENDS,
    FEW,
    GAPS,
    NUMBERS,
    cells_of,
    check_cuts,
    damaged,
    facts,
    read_or_refuse,
    regions_of,
    triangle_grid,
)

from gmsnet.errors import FormatError
from gmsnet.io import medit
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

PLAIN = b"""MeshVersionFormatted 2
Dimension 2
Vertices
5
0.0 0.0 0
1.0 0.0 8
1.0 1.0 0
0.0 1.0 0
-0.5 0.5 0
Triangles
1
1 2 3 4
Quadrilaterals
1
1 3 4 5 6
Edges
2
1 2 7
2 3 9
Corners
1
4
RequiredTriangles
1
1
End
"""


def test_a_plain_file() -> None:
    parsed = medit.read({".mesh": PLAIN})
    assert parsed.points.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1], [-0.5, 0.5]]
    assert [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in parsed.cells] == [
        ("triangle", [[0, 1, 2]], [4]),
        ("quad", [[0, 2, 3, 4]], [6]),
        ("line", [[0, 1], [1, 2]], [7, 9]),
        ("vertex", [[3]], [1]),
        ("vertex", [[0], [1], [2]], [3, 3, 3]),
    ]
    assert parsed.region_names == {(0, 1): "Corners", (0, 3): "RequiredTriangles"}
    assert parsed.point_data["medit:ref"].tolist() == [0, 8, 0, 0, 0]


def without_comments(data: bytes) -> bytes:
    return re.sub(rb"#[^\r\n]*", lambda match: b" " * len(match[0]), data).rstrip()


@st.composite
def spellings(draw: st.DrawFn) -> tuple[bytes, list[tuple[int, int]], dict[str, object]]:
    """A random mesh in a random spelling, where the last word of each section begins and ends, and its facts."""
    end, gap, dim = draw(ENDS), draw(GAPS), draw(st.sampled_from([2, 3]))
    count = draw(st.integers(3, 8))
    points = draw(st.lists(st.tuples(*[NUMBERS] * dim), min_size=count, max_size=count))
    references = draw(st.lists(st.integers(-2, 9), min_size=count, max_size=count))
    node = st.integers(1, count)
    sections: dict[str, list[list[object]]] = {"Vertices": [[*p, r] for p, r in zip(points, references, strict=True)]}
    for key, size in (("Triangles", 3), ("Edges", 2), ("Quadrilaterals", 4), ("Tetrahedra", 4), ("TrianglesP2", 6)):
        sections[key] = draw(st.lists(st.lists(node, min_size=size + 1, max_size=size + 1), min_size=1, max_size=3))
    sections["RequiredVertices"] = draw(st.lists(node.map(lambda n: [n]), max_size=2))
    sections["Ridges"] = [[1]]
    sections["Normals"] = [["0.5"] * dim]
    sections["NormalAtVertices"] = [[1, 1]]
    text = f"# made up{end}MeshVersionFormatted{gap}{draw(st.integers(1, 4))}{end}"
    text += f"Dimension{draw(st.sampled_from([gap, end]))}{dim}{end}"
    last: list[tuple[int, int]] = []
    for key in draw(st.permutations(list(sections))):
        rows = sections[key]
        text += draw(st.sampled_from(["", end, f"# Triangles 7{end}"]))
        text += f"{key}{draw(st.sampled_from([gap, end]))}{len(rows)}{end}"
        text += "".join(gap.join(map(str, row)) + draw(st.sampled_from([end, end + end, f" #{end}"])) for row in rows)
        bare = without_comments(text.encode())
        last.append((len(bare) - len(bare.split()[-1]), len(bare)))
    text += draw(st.sampled_from(["", "End", f"End{end}"]))
    expected: dict[str, object] = {"points": [[float(x) for x in p] for p in points], "references": references}
    expected |= {key: rows for key, rows in sections.items() if key != "Vertices"}
    return text.encode(), last, expected


@given(spellings())
def test_every_spelling_reads_the_same(case: tuple[bytes, list[tuple[int, int]], dict[str, list[list[int]]]]) -> None:
    data, _, expected = case
    parsed = medit.read({".mesh": data})
    assert parsed.points.tolist() == expected["points"]
    for key, kind in medit.KINDS.items():
        if key in expected:
            assert cells_of(parsed, kind) == [[n - 1 for n in row[:-1]] for row in expected[key]]
            assert regions_of(parsed, kind) == [row[-1] for row in expected[key]]
    assert cells_of(parsed, "vertex") == [[n - 1] for (n,) in expected["RequiredVertices"]]
    assert parsed.point_data.get("medit:ref", np.zeros(len(parsed.points))).tolist() == expected["references"]
    points = parsed.points.copy()
    points[2] -= 0.75
    again = medit.read({".mesh": spliced(parsed.slots, data, parsed.points, points)})
    assert again.points.tolist() == points.tolist()
    assert facts(again)[1:] == facts(parsed)[1:]


@FEW
@given(spellings())
def test_a_cut_within_a_section_is_refused(case: tuple[bytes, list[tuple[int, int]], dict[str, object]]) -> None:
    # A file need not say where it ends: one that is cut between two sections reads without the rest.
    data, last, _ = case
    check_cuts(medit, {".mesh": data}, ".mesh", lambda rest: any(a < len(without_comments(rest)) <= b for a, b in last))


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    read_or_refuse(medit, {".mesh": data.draw(damaged(PLAIN))})


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_words(data: bytes) -> None:
    read_or_refuse(medit, {".mesh": data})
    read_or_refuse(medit, {".mesh": PLAIN.replace(b"End\n", data)})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"Formatted 2", b"Formatted 5", r"line 1: MeshVersionFormatted 5: known are 1 to 4"),
        (b"Dimension 2", b"Dimension 4", r"line 2: Dimension 4: a mesh has 2 or 3"),
        (b"Dimension 2\n", b"", r"line 2: Dimension is missing before 'Vertices'"),
        (b"Dimension 2", b"Dimension 3", r"line 6: an integer was expected, found '1.0'"),
        (b"Vertices\n5", b"Vertices\n4", r"line 9: a keyword was expected, found '-0.5'"),
        (b"Vertices\n5", b"Vertices\n6", r"line 10: a number was expected, found 'Triangles'"),
        (b"Vertices\n5", b"Vertices\n-5", r"line 4: the number of vertices is negative: -5"),
        (b"Vertices\n5", b"Vertices\n999999999999", r"expected \d+ more numbers, the file ends"),
        (b"1 2 3 4", b"1 2 6 4", r"line 12: a cell names the node 6, but the nodes are 1 to 5"),
        (b"1 2 3 4", b"0 2 3 4", r"line 12: a cell names the node 0, but the nodes are 1 to 5"),
        (b"1 2 3 4", b"1 2 3.5 4", r"line 12: an integer was expected, found '3.5'"),
        (b"1.0 1.0 0", b"1.0 inf 0", r"line 7: a number was expected, found 'inf'"),
        (b"Corners\n1\n4", b"Corners\n1\n9", r"line 22: a cell names the node 9"),
        (b"Triangles\n1\n1\n", b"Triangles\n1\n2\n", r"line 25: RequiredTriangles names the face 2, but there are 1"),
        (b"Edges", b"Hedges", r"line 16: unknown keyword 'Hedges'"),
        (b"Edges", b"Triangles", r"line 16: Triangles is given twice"),
        (b"Vertices", b"Points", r"line 3: unknown keyword 'Points'"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in PLAIN
    with pytest.raises(FormatError, match=message):
        medit.read({".mesh": PLAIN.replace(old, new, 1)})


def test_a_file_without_vertices_is_refused() -> None:
    with pytest.raises(FormatError, match="Vertices are missing: the file is cut off or no Medit mesh"):
        medit.read({".mesh": b"MeshVersionFormatted 2\nDimension 2\nEnd"})


def test_sections_without_entries_are_read() -> None:
    """TetGen and others write ``Edges 0``."""
    sections = b"".join(b"%s\n0\n" % key.encode() for key in (*medit.KINDS, "RequiredVertices", "Normals", "Ridges")
                        if key.encode() not in PLAIN)  # fmt: skip
    parsed = medit.read({".mesh": PLAIN.replace(b"End", sections + b"End")})
    plain = medit.read({".mesh": PLAIN})
    assert [block.nodes.tolist() for block in parsed.cells if len(block.nodes)] == [
        block.nodes.tolist() for block in plain.cells if len(block.nodes)
    ]
    assert {block.kind for block in parsed.cells} > {block.kind for block in plain.cells}


def test_fortran_exponents_are_read_exactly() -> None:
    parsed = medit.read({".mesh": PLAIN.replace(b"-0.5 0.5 0", b"-0.1D-3 7.0d+01 0")})
    assert parsed.points[4].tolist() == [-0.1e-3, 70.0]


@pytest.mark.parametrize("dim", [2, 3])
def test_conversion_keeps_regions_and_names_what_is_lost(dim: int) -> None:
    mesh = triangle_grid(dim=dim)
    vertices = CellBlock("vertex", [[0], [3]], [1, 1])
    written = medit.write(Mesh(mesh.points, (*mesh.cells, vertices), {**mesh.region_names, (0, 1): "Corners"}))
    assert written.lost == [
        "Medit numbers its regions and markers: the names 'bottom wall' (1), 'top' (2), 'steel' (3), 'air' (7) "
        "were left out"
    ]
    parsed = medit.read(contents(written))
    assert parsed.points.tobytes() == mesh.points.tobytes()
    assert facts(parsed)[1][:2] == [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in mesh.cells]
    assert cells_of(parsed, "vertex") == [[0], [3]]
    assert medit.write(Mesh(mesh.points, mesh.cells, point_data={"medit:ref": np.arange(25)})).lost == []


def test_conversion_of_markers_of_vertices() -> None:
    mesh = triangle_grid()
    written = medit.write(Mesh(mesh.points, (mesh.cells[0], CellBlock("vertex", [[0], [3]], [1, 2])), {(0, 2): "pin"}))
    assert written.lost == ["Medit has no markers of vertices: 2 of them became RequiredVertices"]
    parsed = medit.read(contents(written))
    assert cells_of(parsed, "vertex") == [[0], [3]]
    assert parsed.region_names == {(0, 2): "RequiredVertices"}
    with pytest.raises(FormatError, match="Medit cannot hold cells of type 'polygon'"):
        medit.write(Mesh(mesh.points, (CellBlock("polygon", [[0, 1, 2, 3, 4]], [0]),)))
