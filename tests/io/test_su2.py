"""SU2: many spellings of one mesh, damage, markers, conversion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import check_splice, contents, spliced
from support.damage import (
    ENDS,
    FEW,
    GAPS,
    NUMBERS,
    cells_of,
    check_cuts,
    damaged,
    facts,
    last_word,
    read_or_refuse,
    regions_of,
    triangle_grid,
)

from gmsnet.errors import FormatError
from gmsnet.io import su2
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

PLAIN = b"""NDIME= 2
NELEM= 2
5 0 1 2 0
9 0 2 3 4 1
NPOIN= 5
0.0 0.0 0
1.0 0.0 1
1.0 1.0 2
0.0 1.0 3
-0.5 0.5 4
NMARK= 2
MARKER_TAG= wall
MARKER_ELEMS= 2
3 0 1
3 1 2
MARKER_TAG= far field
MARKER_ELEMS= 0
"""
MARKERS = PLAIN[PLAIN.index(b"NMARK=") :]


def test_a_plain_file() -> None:
    parsed = su2.read({".su2": PLAIN})
    assert cells_of(parsed, "triangle") == [[0, 1, 2]]
    assert cells_of(parsed, "quad") == [[0, 2, 3, 4]]
    assert cells_of(parsed, "line") == [[0, 1], [1, 2]]
    assert regions_of(parsed, "line") == [1, 1]
    assert parsed.region_names == {(1, 1): "wall", (1, 2): "far field"}
    assert parsed.points.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1], [-0.5, 0.5]]


@st.composite
def spellings(draw: st.DrawFn) -> tuple[bytes, dict[str, object]]:
    """A random mesh in a random spelling of the format, and its facts."""
    end, gap = draw(ENDS), draw(GAPS)
    count = draw(st.integers(3, 8))
    numbers = draw(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=count, max_size=count))
    node = st.integers(0, count - 1)
    cells = draw(
        st.lists(st.sampled_from([3, 4]).flatmap(lambda n: st.lists(node, min_size=n, max_size=n)), max_size=6)
    )
    tags = draw(st.lists(st.text("abcXYZ_09", min_size=1), unique=True, max_size=3))
    markers = {tag: draw(st.lists(st.tuples(node, node), max_size=3)) for tag in tags}
    indexed, marker_indexed = draw(st.booleans()), draw(st.booleans())

    def head(key: str, value: object) -> str:
        left, right = draw(st.sampled_from(["", " "])), draw(st.sampled_from(["", " ", "\t"]))
        return f"{draw(st.sampled_from(['', ' ']))}{key}{left}={right}{value}" + draw(
            st.sampled_from(["", " ", " % 7"])
        )

    def rows(lists: list[list[object]], index: bool) -> list[str]:
        lines = [gap.join(map(str, [*row, k] if index else row)) for k, row in enumerate(lists)]
        return [line + draw(st.sampled_from(["", "", " ", "% x=1", end, f"{end}%NELEM= 9"])) for line in lines]

    blocks = [
        [head("NDIME", 2)],
        [head("NPOIN", f"{count} {count}" if draw(st.booleans()) else count), *rows(numbers, indexed)],
        [head("NELEM", len(cells)), *rows([[{3: 5, 4: 9}[len(c)], *c] for c in cells], indexed)],
        [head("NMARK", len(tags))],
    ]
    extra = [head("AOA", "1.5"), head("FFD_NBOX", 1), head("FFD_CORNER_POINTS", 2), "0.0 1.0", "wall 3 0.1 0.2"]
    for tag, lines in markers.items():
        blocks.append([head("MARKER_TAG", tag), head("MARKER_ELEMS", len(lines)),
                       *rows([[3, *line] for line in lines], marker_indexed)])  # fmt: skip
    text = end.join(line for block in [extra, *draw(st.permutations(blocks))] for line in block) + end
    return (end * draw(st.integers(0, 1)) + "% head" + end + text).encode(), {
        "points": [[float(a), float(b)] for a, b in numbers],
        "triangle": [c for c in cells if len(c) == 3],
        "quad": [c for c in cells if len(c) == 4],
        "markers": {tag: [list(line) for line in lines] for tag, lines in markers.items()},
    }


@given(spellings())
def test_every_spelling_reads_the_same(case: tuple[bytes, dict[str, object]]) -> None:
    data, expected = case
    parsed = su2.read({".su2": data})
    assert parsed.points.tolist() == expected["points"]
    assert cells_of(parsed, "triangle") == expected["triangle"]
    assert cells_of(parsed, "quad") == expected["quad"]
    numbers = {name: number for (dim, number), name in parsed.region_names.items() if dim == 1}
    found = {tag: [n for b in parsed.cells if b.dimension == 1
                   for n, r in zip(b.nodes.tolist(), b.regions.tolist(), strict=True) if r == numbers[tag]]
             for tag in numbers}  # fmt: skip
    assert found == expected["markers"]
    points = parsed.points.copy()
    points[1] += 1.25
    again = spliced(parsed.slots, data, parsed.points, points)
    assert su2.read({".su2": again}).points.tolist() == points.tolist()
    assert facts(su2.read({".su2": again}))[1:] == facts(parsed)[1:]


@FEW
@given(spellings())
def test_a_cut_file_is_refused_or_the_same(case: tuple[bytes, dict[str, object]]) -> None:
    start = last_word(case[0], rb"%[^\r\n]*")
    check_cuts(su2, {".su2": case[0]}, ".su2", lambda rest: len(rest) > start)


def test_a_cut_plain_file_is_refused_or_the_same() -> None:
    """Where markers begin a file without any might end: they are lost already."""
    check_cuts(su2, {".su2": PLAIN}, ".su2", lambda left: left == PLAIN.removesuffix(MARKERS))


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    read_or_refuse(su2, {".su2": data.draw(damaged(PLAIN))})


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_words(data: bytes) -> None:
    read_or_refuse(su2, {".su2": data})
    read_or_refuse(su2, {".su2": PLAIN + data})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"NDIME= 2", b"NDIME= 4", r"line 1: NDIME= 4: a mesh has 2 dimensions, or 3"),
        (b"NDIME= 2", b"NZONE= 2\nNDIME= 2", r"line 1: NZONE= 2: a file with several zones"),
        (b"NDIME= 2\n", b"", r"^NDIME missing: the file is cut off"),
        (b"NELEM= 2", b"NELEM= 3", r"line 2: NELEM= 3 is followed by 2 rows instead of 3"),
        (b"NPOIN= 5", b"NPOIN= 4", r"line 5: NPOIN= 4 is followed by 5 rows instead of 4"),
        (b"NMARK= 2\n", b"", r"^NMARK missing: the file is cut off"),
        (b"NMARK= 2", b"NMARK= 3", r"NMARK announces 3 markers, but the file has 2"),
        (b"NMARK= 2", b"NPOIN= 0\nNMARK= 2", r"line 11: NPOIN is given twice"),
        (b"NMARK= 2", b"SEND_RECV= 1", r"line 11: SEND_RECV: this is one part of a partitioned mesh"),
        (b"MARKER_TAG= wall", b"MARKER_TAG=", r"line 12: MARKER_TAG has no name"),
        (b"MARKER_TAG= wall\n", b"", r"line 12: MARKER_ELEMS without a MARKER_TAG before it"),
        (b"MARKER_ELEMS= 0\n", b"", r"the marker 'far field' has no MARKER_ELEMS"),
        (b"5 0 1 2 0", b"5 0 1 7 0", r"line 3: a cell names the node 7, but the nodes are 0 to 4"),
        (b"5 0 1 2 0", b"5 0 1 -1 0", r"line 3: a cell names the node -1"),
        (b"5 0 1 2 0", b"10 0 1 2 3 0", r"line 3: a cell of type 10 cannot be read here"),
        (b"5 0 1 2 0", b"5 0 1", r"line 3: a triangle has 3 nodes, found 2 numbers"),
        (b"5 0 1 2 0", b"5 0 1 2.0 0", r"line 3: an integer was expected, found '2.0'"),
        (
            b"3 0 1\n",
            b"5 0 1 2\n",
            r"line 14: a cell of type 5 cannot be read here; known are 1 \(vertex\), 3 \(line\)",
        ),
        (b"1.0 1.0 2", b"1.0 nan 2", r"line 8: a number was expected, found 'nan'"),
        (b"1.0 1.0 2", b"1.0", r"line 8: two coordinates and an index were expected, found 1 numbers"),
        (b"1.0 1.0 2", b"1.0 1.0 0.5 2", r"line 8: an integer was expected, found '0.5'"),
        (b"NDIME= 2", b"7\nNDIME= 2", r"line 1: a keyword such as NDIME= was expected, found '7'"),
        (b"NMARK= 2", b"WEIGHTS= 1\n0.5\nNMARK= 2", r"line 12: 1 rows follow the keyword 'WEIGHTS'"),
        (b"NELEM= 2", b"NELEM= two", r"line 2: an integer was expected, found 'two'"),
        (b"NELEM= 2", b"NELEM= -2", r"line 2: the number of elements is negative: -2"),
        (b"NELEM= 2", b"NELEM=", r"line 2: one number was expected after NELEM=, found 0 words"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in PLAIN
    with pytest.raises(FormatError, match=message):
        su2.read({".su2": PLAIN.replace(old, new, 1)})


def test_words_of_the_file_are_short_and_printable_in_messages() -> None:
    for key in (b"A" * 5000, b"A\x1b[2J"):
        with pytest.raises(FormatError) as caught:
            su2.read({".su2": PLAIN.replace(b"NMARK= 2", key + b"= 1\n0.5\nNMARK= 2")})
        assert str(caught.value).isprintable()
        assert len(str(caught.value)) < 200


def test_one_marker_in_two_pieces_and_vertices() -> None:
    more = b"MARKER_TAG= wall\nMARKER_ELEMS= 1\n1 3\n"
    parsed = su2.read({".su2": PLAIN.replace(b"NMARK= 2", b"NMARK= 3") + more})
    assert cells_of(parsed, "vertex") == [[3]]
    assert parsed.region_names == {(1, 1): "wall", (1, 2): "far field", (0, 1): "wall"}


def test_conversion_keeps_markers_and_names_what_is_lost() -> None:
    mesh = triangle_grid()
    written = su2.write(mesh)
    assert written.lost == ["SU2 cannot hold cell regions: 2 regions were merged (among them 'steel', 'air')"]
    parsed = su2.read(contents(written))
    assert parsed.points.tobytes() == mesh.points.tobytes()
    assert cells_of(parsed, "triangle") == cells_of(mesh, "triangle")
    assert parsed.region_names == {(1, 1): "bottom_wall", (1, 2): "top"}
    assert cells_of(parsed, "line") == cells_of(mesh, "line")


def test_conversion_names_the_third_coordinate_and_data() -> None:
    mesh = triangle_grid()
    points = np.column_stack([mesh.points[:, 0], np.full(len(mesh.points), 5.0), mesh.points[:, 1]])
    block = CellBlock("triangle", mesh.cells[0].nodes, np.zeros(len(mesh.cells[0].nodes)))
    written = su2.write(Mesh(points, (block,), point_data={"p": points[:, 0]}))
    assert written.lost == [
        "SU2 has two coordinates: y = 5.0 was left out",
        "SU2 cannot hold point data: 'p' was left out",
    ]
    assert su2.read(contents(written)).points.tolist() == mesh.points.tolist()
    curved = points.copy()
    curved[3] += 0.5
    with pytest.raises(FormatError, match="SU2 holds meshes in the plane only"):
        su2.write(Mesh(curved, (block,)))
    with pytest.raises(FormatError, match="SU2 cannot hold cells of type 'tetra10'"):
        su2.write(Mesh(points, (CellBlock("tetra10", [range(10)], [0]),)))


def test_without_markers_their_number_may_be_left_out() -> None:
    """As Gmsh does where there are no physical groups."""
    data = PLAIN.removesuffix(MARKERS)
    parsed = su2.read({".su2": data})
    assert {block.dimension for block in parsed.cells} == {2}
    assert parsed.region_names == {}
    check_splice(su2, data)
    with pytest.raises(FormatError, match=r"NPOIN= 5 is followed by 4 rows"):
        su2.read({".su2": data[: data.rstrip().rindex(b"\n") + 1]})
