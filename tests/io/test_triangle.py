"""Triangle's pair of files: many spellings of one mesh, damage, attributes and markers, conversion."""

from __future__ import annotations

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
    last_word,
    read_or_refuse,
    regions_of,
    triangle_grid,
)

from gmsnet.errors import FormatError
from gmsnet.io import triangle
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

NODE = b"""4 2 1 1
1 0.0 0.0 0.5 1
2 1.0 0.0 0.5 0
3 1.0 1.0 0.5 2
4 0.0 1.0 0.5 1
# made up
"""
ELE = b"""2 3 2
1 1 2 3 7 0.25
2 1 3 4 8 0.75
"""


def test_a_plain_pair() -> None:
    parsed = triangle.read({".node": NODE, ".ele": ELE})
    assert parsed.points.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert cells_of(parsed, "triangle") == [[0, 1, 2], [0, 2, 3]]
    assert regions_of(parsed, "triangle") == [7, 8]
    assert cells_of(parsed, "vertex") == [[0], [2], [3]]
    assert regions_of(parsed, "vertex") == [1, 2, 1]
    assert {name: values.tolist() for name, values in parsed.point_data.items()} == {
        "triangle:attribute1": [0.5] * 4,
        "triangle:marker": [1, 0, 2, 1],
    }
    assert [a.tolist() for a in parsed.cell_data["triangle:attribute2"]] == [[0.25, 0.75], [0, 0, 0]]


@st.composite
def spellings(draw: st.DrawFn) -> tuple[dict[str, bytes], dict[str, object]]:
    end, gap = draw(ENDS), draw(GAPS)
    count, base = draw(st.integers(3, 8)), draw(st.sampled_from([0, 1]))
    size, attributes, markers = draw(st.sampled_from([3, 6])), draw(st.integers(0, 2)), draw(st.integers(0, 1))
    points = draw(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=count, max_size=count))
    marks = draw(st.lists(st.integers(0, 3), min_size=count, max_size=count))
    node = st.integers(0, count - 1)
    cells = draw(st.lists(st.lists(node, min_size=size, max_size=size), min_size=1, max_size=4))
    regions = draw(st.lists(st.sampled_from(["1", "2.0", "-3", "4e1"]), min_size=len(cells), max_size=len(cells)))
    cell_attributes = draw(st.integers(0, 2))

    def lines(rows: list[list[object]]) -> bytes:
        first, *rest = [gap.join(map(str, row)) for row in rows]
        around = st.sampled_from(["", "", "# 1 2", f" # x{end}{end}"])
        text = draw(around) + end + first + draw(around) + end
        return (text + "".join(draw(st.sampled_from(["", " "])) + line + draw(around) + end for line in rest)).encode()

    files = {
        ".node": lines([[count, 2, attributes, markers]]
                       + [[k + base, *p, *["0.5"] * attributes, *[m] * markers]
                          for k, (p, m) in enumerate(zip(points, marks, strict=True))]),
        ".ele": lines([[len(cells), size, cell_attributes]]
                      + [[k + base, *(n + base for n in c), *[r, "0.5"][:cell_attributes]]
                         for k, (c, r) in enumerate(zip(cells, regions, strict=True))]),
    }  # fmt: skip
    return files, {
        "points": [[float(a), float(b)] for a, b in points],
        "cells": cells,
        "regions": [int(float(r)) for r in regions] if cell_attributes else [0] * len(cells),
        "marked": [[k] for k, m in enumerate(marks) if m] if markers else [],
    }


@given(spellings())
def test_every_spelling_reads_the_same(case: tuple[dict[str, bytes], dict[str, list[list[int]]]]) -> None:
    files, expected = case
    parsed = triangle.read(files)
    assert parsed.points.tolist() == expected["points"]
    kind = "triangle" if len(expected["cells"][0]) == 3 else "triangle6"
    place = [0, 1, 2] if kind == "triangle" else [0, 1, 2, 5, 3, 4]
    assert cells_of(parsed, kind) == [[c[k] for k in place] for c in expected["cells"]]
    assert regions_of(parsed, kind) == expected["regions"]
    assert cells_of(parsed, "vertex") == expected["marked"]
    points = parsed.points.copy()
    points[2] += 0.125
    again = {**files, ".node": spliced(parsed.slots, files[".node"], parsed.points, points)}
    assert triangle.read(again).points.tolist() == points.tolist()
    assert facts(triangle.read(again))[1:] == facts(parsed)[1:]


@FEW
@given(spellings(), st.sampled_from([".node", ".ele"]))
def test_a_cut_file_is_refused_or_the_same(case: tuple[dict[str, bytes], object], suffix: str) -> None:
    files, _ = case
    start = last_word(files[suffix], rb"#[^\r\n]*")
    check_cuts(triangle, files, suffix, lambda rest: len(rest) > start)


def test_a_false_number_of_attributes_costs_no_time() -> None:
    parsed = triangle.read({".node": b"0 2 99999999999 0\n", ".ele": b"0 3 99999999999\n"})
    assert not len(parsed.points)


def test_columns_without_number_are_refused() -> None:
    row = " ".join(["0"] * 1001)
    with pytest.raises(FormatError, match="line 1: 1001 attributes: more than 1000 are not read"):
        triangle.read({".node": f"1 2 1001 0\n1 0 0 {row}\n".encode(), ".ele": b"0 3 0\n"})
    with pytest.raises(FormatError, match=r"\.ele file .* line 1: 1001 attributes"):
        triangle.read({".node": NODE, ".ele": f"1 3 1001\n1 1 2 3 {row}\n".encode()})


def test_numbers_without_order() -> None:
    node = b"3 2 0 0\n10 0 0\n30 1 0\n20 0 1\n"
    parsed = triangle.read({".node": node, ".ele": b"1 3 0\n1 10 30 20\n"})
    assert cells_of(parsed, "triangle") == [[0, 1, 2]]


def test_regions_that_are_no_whole_numbers_are_named() -> None:
    parsed = triangle.read({".node": NODE, ".ele": b"2 3 1\n1 1 2 3 1.5\n2 1 3 4 -1e-3\n"})
    assert regions_of(parsed, "triangle") == [2, 1]
    assert parsed.region_names == {(2, 1): "-0.001", (2, 2): "1.5"}


@given(st.data(), st.sampled_from([".node", ".ele"]))
def test_damage_is_refused_in_words(data: st.DataObject, suffix: str) -> None:
    files = {".node": NODE, ".ele": ELE}
    read_or_refuse(triangle, {**files, suffix: data.draw(damaged(files[suffix]))})


@given(st.binary(max_size=100), st.sampled_from([".node", ".ele"]))
def test_garbage_is_refused_in_words(data: bytes, suffix: str) -> None:
    read_or_refuse(triangle, {".node": NODE, ".ele": ELE, suffix: data})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"4 2 1 1", b"4 4 1 1", r"line 1: the points have 4 coordinates: there can be 2 \(Triangle\) or 3 \(TetGen\)"),
        (b"4 2 1 1", b"4 3 0 1", r"beside it: line 1: the cells have 3 nodes: .* 3 coordinates there can be 4 or 10"),
        (b"4 2 1 1", b"4 2 1", r"line 1: the first line must have 4 numbers, found 3"),
        (b"4 2 1 1", b"4 2 1 2", r"line 1: 2 boundary markers a point: there can be 0 or 1"),
        (b"4 2 1 1", b"3 2 1 1", r"line 5: the file goes on behind the 3 points"),
        (b"4 2 1 1", b"5 2 1 1", r"expected 1 more lines, the file ends"),
        (b"4 2 1 1", b"4 2 2 1", r"line 2: a point takes 6 numbers here, found 5"),
        (b"4 2 1 1", b"-4 2 1 1", r"line 1: the number of points is negative"),
        (b"3 1.0 1.0", b"2 1.0 1.0", r"line 4: the point 2 is given twice"),
        (b"3 1.0 1.0", b"3 1.0 nan", r"line 4: a number was expected, found 'nan'"),
        (
            b"2 3 2",
            b"2 4 2",
            r"^in the .ele file beside it: line 1: the cells have 4 nodes: .* 2 coordinates there can be 3 or 6",
        ),
        (b"1 1 2 3", b"1 1 2 5", r"^in the .ele file beside it: line 2: a triangle names the node 5, .* 1 to 4"),
        (b"1 1 2 3", b"1 0 2 3", r"^in the .ele file beside it: line 2: a triangle names the node 0, .* 1 to 4"),
        (b"2 1 3 4 8 0.75\n", b"", r"^in the .ele file beside it: line 3: expected 1 more lines"),
        (b" 8 0.75", b" 8", r"^in the .ele file beside it: line 3: a triangle takes 6 numbers here, found 5"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in NODE + ELE
    with pytest.raises(FormatError, match=message):
        triangle.read({".node": NODE.replace(old, new, 1), ".ele": ELE.replace(old, new, 1)})


def test_conversion_keeps_regions_and_names_what_is_lost() -> None:
    mesh = triangle_grid(dim=3)
    written = triangle.write(mesh)
    assert written.lost == [
        "Triangle cannot hold line cells: 8 were turned into markers of their nodes (1, 2)",
        "Triangle numbers its markers: the names 'bottom wall' (1), 'top' (2) were left out",
        "Triangle numbers its regions and markers: the names 'steel' (3), 'air' (7) were left out",
    ]
    parsed = triangle.read(contents(written))
    assert parsed.points.tobytes() == mesh.points[:, :2].tobytes()
    assert cells_of(parsed, "triangle") == cells_of(mesh, "triangle")
    assert regions_of(parsed, "triangle") == regions_of(mesh, "triangle")
    assert cells_of(parsed, "vertex") == [[n] for n in sorted({n for line in cells_of(mesh, "line") for n in line})]
    assert contents(triangle.write(Mesh(parsed.points, tuple(parsed.cells), point_data=parsed.point_data))) == contents(
        written
    )


def test_conversion_of_six_node_triangles() -> None:
    points = np.array([[0, 0], [2, 0], [0, 2], [1, 0], [1, 1], [0, 1]], dtype=float)
    mesh = Mesh(points, (CellBlock("triangle6", [[0, 1, 2, 3, 4, 5]], [0]),))
    written = triangle.write(mesh)
    assert contents(written)[".ele"] == b"1 6 1\n1 1 2 3 5 6 4 0\n"  # the side opposite the first corner comes first
    assert cells_of(triangle.read(contents(written)), "triangle6") == [[0, 1, 2, 3, 4, 5]]
    with pytest.raises(FormatError, match="Triangle cannot hold triangle and triangle6 cells in one file"):
        triangle.write(Mesh(points, (*mesh.cells, CellBlock("triangle", [[0, 1, 2]], [0]))))
    with pytest.raises(FormatError, match="Triangle cannot hold cells of type 'quad'"):
        triangle.write(Mesh(points, (CellBlock("quad", [[0, 1, 4, 5]], [0]),)))


def test_markers_that_clash_are_numbered_anew() -> None:
    mesh = triangle_grid()
    clash = CellBlock("vertex", [[12], [13]], [1, 0])
    written = triangle.write(Mesh(mesh.points, (*mesh.cells, clash), mesh.region_names))
    parsed = triangle.read(contents(written))
    held = {n for line in cells_of(mesh, "line") for n in line} | {12, 13}
    assert cells_of(parsed, "vertex") == [[n] for n in sorted(held)]
    assert len(set(parsed.point_data["triangle:marker"].tolist())) == 5
