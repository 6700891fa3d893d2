"""Abaqus and CalculiX decks: many spellings of one mesh, parts, sets, damage, conversion."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import check_splice, contents, mesh_of, read, spliced
from support.damage import (
    FEW,
    NUMBERS,
    cells_of,
    check_cuts,
    damaged,
    facts,
    read_or_refuse,
    regions_of,
    triangle_grid,
)

import gmsnet
from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io import abaqus
from gmsnet.io.abaqus_types import WRITTEN, kind_of
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.known_cells import unknown_cells
from gmsnet.mesh.mesh import Mesh

MESHES = os.environ.get("GMSNET_MESHES", "")

PLAIN = b"""** made up
*Heading
 Some * text = 5, 6
*NODE, NSET=all
1, 0.0, 0.0, 0.0
2, 1.0, 0.0, 0.0
 30, 1.0, 1.0, 0.0,
4,	0.0,	1.0,	0.0
** between
5, .5, 5.D-1, 0.
*ELEMENT, TYPE=CPS3, ELSET=Steel
1, 1, 2, 5
2, 2, 30,
5
*Element, type=cps3, elset="dry air"
3, 30, 4, 5
4, 4, 1, 5
*ELEMENT, TYPE=T2D2, ELSET=wall
10, 1, 2
*NSET, NSET=corners, GENERATE
1, 2
30, 40, 2
*NSET, NSET=more
5, corners
*ELSET, ELSET=lower
1, 2
*NSET, NSET=of cells, ELSET=lower
*MATERIAL, NAME=iron
*ELASTIC
2e5, 0.3
*SOLID SECTION, ELSET=lower, MATERIAL=iron
*BOUNDARY
30, 1,, 0.
all, 3, 3
*STEP
*CLOAD
corners, 2, -1.0
*END STEP
"""

PARTS = b"""*Part, name=A
*Node
1, 0., 0.
2, 1., 0.
3, 0., 1.
*Element, type=CPE3
1, 1, 2, 3
*Nset, nset=tip
3
*Elset, elset=e
1
*Solid Section, elset=e, material=m
*End Part
*Part, name=B
*Node
1, 5., 0.
2, 6., 0.
3, 5., 1.
*Element, type=CPE3
1, 1, 2, 3
*End Part
*Assembly, name=Assembly
*Instance, name=A-1, part=A
 10., 0., 0.
*End Instance
*Instance, name=B-1, part=B
*End Instance
*Node
1, 9., 9.
*Nset, nset=both, instance=A-1
1, 2
*Nset, nset=both, instance=B-1
3
*Nset, nset=point
1
*End Assembly
*Boundary
A-1.2, 1, 1
point, 1, 1
A-1.tip, 2, 2
"""


def test_a_plain_file() -> None:
    parsed = read(abaqus, PLAIN)
    assert parsed.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0]]
    assert cells_of(parsed, "triangle") == [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    assert regions_of(parsed, "triangle") == [1, 1, 0, 0]
    assert dict(parsed.region_names) == {(2, 1): "lower", (0, 2): "BOUNDARY", (0, 3): "CLOAD"}
    assert cells_of(parsed, "line") == [[0, 1]]
    assert cells_of(parsed, "vertex") == [[2], [0], [1], [2]]  # a set of all nodes says nothing of a place
    assert {key: nodes.tolist() for key, nodes in parsed.node_sets.items()} == {
        "all": [0, 1, 2, 3, 4],
        "corners": [0, 1, 2],
        "more": [0, 1, 2, 4],
        "of cells": [0, 1, 2, 4],
        "Steel": [0, 1, 2, 4],
        "dry air": [0, 2, 3, 4],
        "wall": [0, 1],
    }
    assert parsed.unread == [f"the keyword *{key}" for key in (
        "MATERIAL", "ELASTIC", "SOLIDSECTION", "BOUNDARY", "STEP", "CLOAD", "ENDSTEP")
    ] + ["the numbers of nodes, which begin elsewhere, have gaps or another order"]  # fmt: skip
    check_splice(abaqus, PLAIN)


def test_without_sections_the_sets_of_the_elements_are_the_regions() -> None:
    parsed = read(abaqus, PLAIN.replace(b"*SOLID SECTION", b"*OTHER THING"))
    assert regions_of(parsed, "triangle") == [1, 1, 2, 2]
    assert dict(parsed.region_names)[2, 2] == "dry air"
    assert mesh_of(parsed).markers["wall"].tolist() == [0, 1]


def test_parts_number_their_nodes_anew() -> None:
    parsed = read(abaqus, PARTS)
    assert parsed.points.tolist() == [[0, 0], [1, 0], [0, 1], [5, 0], [6, 0], [5, 1], [9, 9]]
    assert cells_of(parsed, "triangle") == [[0, 1, 2], [3, 4, 5]]
    assert regions_of(parsed, "triangle") == [1, 0]
    assert {key: nodes.tolist() for key, nodes in parsed.node_sets.items()} == {
        "tip": [2], "both": [0, 1, 5], "point": [6]
    }  # fmt: skip
    assert cells_of(parsed, "vertex") == [[1], [2], [6]]
    check_splice(abaqus, PARTS)


def test_one_part_without_an_assembly_is_meant_by_what_follows() -> None:
    data = b"*PART,NAME=x\n" + PLAIN.replace(b"*MATERIAL", b"*END PART\n*MATERIAL")
    assert facts(read(abaqus, data)) == facts(read(abaqus, PLAIN))


@st.composite
def spellings(draw: st.DrawFn) -> tuple[bytes, dict[str, list[object]]]:
    end, gap = draw(st.sampled_from(["\n", "\r\n", "\r"])), draw(st.sampled_from([",", ", ", " ,\t"]))
    count, dim = draw(st.integers(3, 8)), draw(st.integers(2, 3))
    points = draw(st.lists(st.tuples(*[NUMBERS] * dim), min_size=count, max_size=count))
    first = draw(st.integers(1, 5))
    cells = draw(st.lists(st.tuples(*[st.integers(0, count - 1)] * 6), min_size=1, max_size=4))
    comment = st.sampled_from(["", "", f"** 1, 2{end}", f"**{end}", end, f"  {end}"])
    text = draw(comment) + f"*{draw(st.sampled_from(['NODE', 'Node', ' node']))}{end}"
    for k, row in enumerate(points):
        text += draw(comment) + gap.join([str(first + k), *row]) + draw(st.sampled_from(["", ",", " "])) + end
    text += f"*ELEMENT,{draw(st.sampled_from(['', ' ', end]))}TYPE={draw(st.sampled_from(['CPE6M', 'STRI65']))}{end}"
    for k, row in enumerate(cells):
        words = [str(7 + k), *(str(first + node) for node in row)]
        cut = draw(st.integers(1, len(words)))
        text += gap.join(words[:cut])
        text += ("," + end + gap.join(words[cut:]) if cut < len(words) else "") + end + draw(comment)
    return text.encode(), {"points": [[float(x) for x in row] for row in points], "cells": [list(row) for row in cells]}


@given(spellings())
def test_every_spelling_reads_the_same(case: tuple[bytes, dict[str, list[object]]]) -> None:
    data, expected = case
    parsed = read(abaqus, data)
    assert parsed.points.tolist() == expected["points"]
    assert cells_of(parsed, "triangle6") == expected["cells"]
    points = parsed.points.copy()
    points[1] += 0.125
    assert parsed.rounding is not None
    points = parsed.rounding.kept(parsed.points, points)
    again = spliced(parsed.slots, data, parsed.points, points)
    assert read(abaqus, again).points.tolist() == points.tolist()
    assert facts(read(abaqus, again))[1:] == facts(parsed)[1:]


@FEW
@given(spellings())
def test_a_cut_file_is_refused_or_the_same(case: tuple[bytes, dict[str, list[object]]]) -> None:
    # The format does not say where it ends: a cut behind a whole element, or within its last number, cannot be seen.
    nodes = [len(rest) for rest in case[0].split(b"TYPE=")[:1]]
    check_cuts(abaqus, {".inp": case[0]}, ".inp", lambda rest: len(rest) > nodes[0] + 9)


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    read_or_refuse(abaqus, {".inp": data.draw(damaged(data.draw(st.sampled_from([PLAIN, PARTS]))))})


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_words(data: bytes) -> None:
    read_or_refuse(abaqus, {".inp": data})
    read_or_refuse(abaqus, {".inp": b"*NODE\n1,0,0\n*ELEMENT,TYPE=S3\n1,1,1,1\n" + data})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"** made up", b"8 5 0 0 0", r"line 1: a keyword such as \*NODE was expected, found '8'"),
        (b"*Heading\n", b"*INCLUDE, INPUT=m.inp\n", r"line 2: \*INCLUDE reads another file \('m.inp'\)"),
        (b"NSET=all", b"INPUT=n.txt", r"line 4: \*NODE reads another file"),
        (b"NSET=all", b"SYSTEM=C", r"line 4: SYSTEM=C: only rectangular coordinates are read"),
        (b"*MATERIAL, NAME=iron", b"*SYSTEM\n0, 0, 1", r"line 28: \*SYSTEM: the nodes are in another system"),
        (b"*MATERIAL, NAME=iron", b"*NGEN\n1, 5", r"line 28: \*NGEN makes nodes or cells that are not listed"),
        (b"*MATERIAL, NAME=iron", b"*END PART", r"line 28: \*ENDPART closes what was not opened"),
        (b"2, 1.0, 0.0, 0.0", b"2, 1.0, , 0.0", r"line 6: a field is empty here"),
        (b"2, 1.0, 0.0, 0.0", b"2, 1.0, 0.0", r"line 6: a node takes a number and 3 coordinates in this file, found 3"),
        (b"2, 1.0, 0.0, 0.0", b"2, 1.0, 0.0, x", r"line 6: a number was expected, found 'x'"),
        (b"2, 1.0, 0.0, 0.0", b"2.5, 1.0, 0.0, 0", r"line 6: an integer was expected, found '2.5'"),
        (b"2, 1.0, 0.0, 0.0", b"1, 1.0, 0.0, 0", r"line 6: the number of this node was given to another one"),
        (b"2, 2, 30,", b"2, 2, 31,", r"line 13: the node 31 is named here, but there is none of that number"),
        (b"3, 30, 4, 5", b"3, 30, 4", r"line 17: ELEMENT takes 4 numbers a record, and here is one more or less"),
        (b"4, 4, 1, 5", b"4, 4, 1", r"line 17: a record of ELEMENT has 3 numbers instead of 4: is the file cut off"),
        (b"4, 4, 1, 5", b"3, 4, 1, 5", r"element 3 \(counted from 0\) has a number that another one had before"),
        (b", type=cps3", b"", r"line 15: \*ELEMENT without TYPE="),
        (b"5, corners", b"5, corner", r"line 24: no set of nodes is called 'corner' before here"),
        (b"5, corners", b"6, corners", r"line 24: the node 6 is named here"),
        (b"1, 2\n30", b"1\n30", r"line 21: GENERATE takes first, last and step"),
        (b"30, 40, 2", b"30, 40, 0", r"line 22: the step is 0: it must be 1 or more"),
        (b"*NSET, NSET=more", b"*NSET", r"line 23: this set has no name: NSET= is missing"),
        (b"ELSET=lower, M", b"ELSET=upper, M", r"line 31: no set of elements is called 'upper' in this file"),
        (b"corners, 2, -1.0", b"nobody, 2, -1.0", r"line 37: no set of nodes is called 'nobody' before here"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in PLAIN
    with pytest.raises(FormatError, match=message):
        read(abaqus, PLAIN.replace(old, new, 1))


@pytest.mark.parametrize("data", [b"*HEADING\n", b"*NODE\n1, 0, 0\n", b"*ELEMENT, TYPE=S3\n1, 1, 2, 3\n"])
def test_a_deck_without_a_mesh(data: bytes) -> None:
    with pytest.raises(FormatError, match="is in this file: it is cut off, or no Abaqus or CalculiX deck with a mesh"):
        read(abaqus, data)


@pytest.mark.parametrize(
    ("type_", "kind"),
    [
        ("C3D10M", "tetra10"), ("C3D8R", "hexahedron"), ("C3D20RH", "hexahedron20"), ("CPE4RH", "quad"),
        ("S4R5", "quad"), ("S8R5", "quad8"), ("S9R5", "quad9"), ("STRI65", "triangle6"), ("SC8R", "hexahedron"),
        ("SC6R", "wedge"), ("B31H", "line"), ("B32", "line3"), ("SAX1", "line"), ("DC2D6", "triangle6"),
        ("C3D" + 8000 * "1", None),
        ("C3D27", "hexahedron27"), ("C3D27RH", "hexahedron27"),
        ("C3D15V", None), ("COH3D8", None), ("CIN3D8", None), ("U1", None), ("", None),
    ],
)  # fmt: skip
def test_types_of_elements(type_: str, kind: str | None) -> None:
    found = kind_of(type_)
    assert (found.name if found else None) == kind


def test_types_that_are_written_are_read_as_what_they_are() -> None:
    assert {kind: {kind_of(t).name for t in types} for kind, types in WRITTEN.items()} == {k: {k} for k in WRITTEN}


def test_an_unknown_type_is_held_and_named() -> None:
    data = PLAIN.replace(b"*MATERIAL", b"*ELEMENT, TYPE=U1\n20, 1, 2,\n5\n21, 1, 4\n*MATERIAL", 1)
    parsed = read(abaqus, data)
    assert cells_of(parsed, "abaqus:U1") == [[0, 1, 4], [0, 3]]
    assert unknown_cells(mesh_of(parsed)) == "2 abaqus:U1 cells"
    assert not gmsnet.smooth(mesh_of(parsed)).moved.any()


# A cube of Gmsh 4.15 as it writes it: the middle of the cell stands before those of its faces.
CUBE27 = b"""*NODE
1, 0, 0, 1
2, 0, 0, 0
3, 0, 1, 1
4, 0, 1, 0
5, 1, 0, 1
6, 1, 0, 0
7, 1, 1, 1
8, 1, 1, 0
9, 0, 0, 0.5
10, 0, 0.5, 1
11, 0, 1, 0.5
12, 0, 0.5, 0
13, 1, 0, 0.5
14, 1, 0.5, 1
15, 1, 1, 0.5
16, 1, 0.5, 0
17, 0.5, 0, 0
18, 0.5, 0, 1
19, 0.5, 1, 0
20, 0.5, 1, 1
21, 0, 0.5, 0.5
22, 1, 0.5, 0.5
23, 0.5, 0, 0.5
24, 0.5, 1, 0.5
25, 0.5, 0.5, 0
26, 0.5, 0.5, 1
27, 0.5, 0.5, 0.5
*ELEMENT, type=C3D27, ELSET=Volume1
27, 3, 1, 2, 4, 7, 5, 6, 8, 10, 9, 12, 11, 14, 13, 16,
15, 20, 18, 17, 19, 27, 21, 22, 26, 23, 25, 24
"""


def test_hexahedra_of_27_nodes_have_each_where_it_belongs() -> None:
    parsed = read(abaqus, CUBE27)
    (cell,) = parsed.points[cells_of(parsed, "hexahedron27")]
    kind = CELLS["hexahedron27"]
    for first, last, middle in kind.edges:
        assert cell[middle].tolist() == ((cell[first] + cell[last]) / 2).tolist()
    for facet in kind.facets:
        assert cell[facet[8]].tolist() == cell[list(facet[:4])].mean(axis=0).tolist()
    assert cell[26].tolist() == [0.5, 0.5, 0.5]
    written = contents(abaqus.write(mesh_of(parsed)))[".inp"]
    assert cells_of(read(abaqus, written), "hexahedron27") == cells_of(parsed, "hexahedron27")
    assert b"".join(CUBE27.split()[-27:]) in b"".join(written.split())
    check_splice(abaqus, CUBE27)


def test_hexahedra_without_nodes_in_their_faces_are_held() -> None:
    parsed = read(abaqus, CUBE27.replace(b", 21, 22, 26, 23, 25, 24", b""))
    assert unknown_cells(mesh_of(parsed)) == "1 abaqus:C3D27 with fewer nodes cell"
    with pytest.raises(FormatError, match="a record of ELEMENT has 4 numbers instead of 28"):
        read(abaqus, CUBE27 + b"28, 1, 2, 3\n")


def test_conversion_keeps_cells_and_names() -> None:
    mesh = triangle_grid(dim=3)
    written = abaqus.write(mesh)
    assert written.lost == [
        "Abaqus keeps cells region by region: they were put in another order",
        "Abaqus names its sets by letters, digits, - and _: 'bottom wall' (bottom_wall)",
    ]
    back = read(abaqus, contents(written)[".inp"])
    assert back.points.tobytes() == mesh.points.tobytes()
    assert sorted(cells_of(back, "triangle")) == sorted(cells_of(mesh, "triangle"))
    assert set(mesh_of(back).markers) == {"bottom_wall", "top", "steel", "air"}
    check_splice(abaqus, contents(written)[".inp"])


def test_numbers_have_at_most_20_characters(tmp_path: Path) -> None:
    """What follows is not read by CalculiX: of 1.2345678901234567e-05 it would read 1.2345678901234567."""
    values = [-1.2345678901234567e-05, 0.012345678901234567, -1.2345678901234567e300, 1 / 3, 12345.678901234567]
    points = np.array([[x, y] for x in values for y in values[3:]])
    mesh = Mesh(points, (CellBlock("triangle", [[0, 3, 4]], [1]), CellBlock("vertex", [[0]], [2])))
    lost = gmsnet.write(mesh, tmp_path / "a.inp")
    assert any("rounded, by at most" in words for words in lost)
    rows = (tmp_path / "a.inp").read_text().split("*ELEMENT")[0].splitlines()[1:]
    words = [word.strip() for row in rows for word in row.split(",")[1:]]
    assert max(map(len, words)) == 20
    again = gmsnet.read(tmp_path / "a.inp")
    np.testing.assert_allclose(again.points[:, :2], points, rtol=1e-12, atol=1e-17)
    odd = again.with_points(again.points + np.array([1e-6 / 3, 0, 0]))
    assert "coordinates were rounded to 20 characters, by at most" in gmsnet.write(odd, tmp_path / "b.inp")[0]
    assert max(len(word) for word in (tmp_path / "b.inp").read_text().split()) <= 21  # with its comma


def test_a_mesh_whose_cells_need_all_digits_is_refused() -> None:
    points = np.array([[0.0, 0.0], [1e-5, 1.2345678901234567e-05], [2e-5, 2 * 1.2345678901234567e-05 + 1e-20]])
    with pytest.raises(FormatError, match="too few digits for this mesh: 1 triangle cells would be inverted or flat"):
        abaqus.write(Mesh(points, (CellBlock("triangle", [[0, 1, 2]], [0]),)))


@pytest.mark.skipif(not MESHES, reason="GMSNET_MESHES does not name a folder of meshes")
def test_a_real_deck(tmp_path: Path) -> None:
    path = Path(MESHES) / "formats" / "test_bracket.inp"
    mesh = gmsnet.read(path)
    assert [(block.kind, len(block.nodes)) for block in mesh.cells] == [("tetra", 793), ("vertex", 6), ("vertex", 6)]
    assert {key: len(nodes) for key, nodes in mesh.markers.items()} == {
        "bracket_test": 306, "force_nodes": 6, "BOUNDARY": 6, "CLOAD": 6
    }  # fmt: skip
    check_splice(abaqus, path.read_bytes())
    result = gmsnet.smooth(mesh)
    assert result.moved.sum() == 20
    assert gmsnet.write(result.mesh, tmp_path / "b.inp") == []
    again = gmsnet.read(tmp_path / "b.inp")
    assert again.points.tobytes() == result.mesh.points.tobytes()
    old, new = path.read_bytes().splitlines(), (tmp_path / "b.inp").read_bytes().splitlines()
    assert len(old) == len(new)
    assert sum(a != b for a, b in zip(old, new, strict=True)) == 20
