"""OFF: many spellings of one mesh, damage, conversion."""

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
    triangle_grid,
)

from gmsnet.errors import FormatError
from gmsnet.io import off
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

PLAIN = b"""OFF
# made up
5 2 0
0.0 0.0 0.0
1.0 0.0 0.0
1.0 1.0 0.0
0.0 1.0 0.0
2.0 2.0 0.0
3 0 1 2
4 0 1 2 3 255 0 0
"""


def test_a_plain_file() -> None:
    parsed = off.read({".off": PLAIN})
    assert parsed.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0]]
    assert cells_of(parsed, "triangle") == [[0, 1, 2]]
    assert cells_of(parsed, "quad") == [[0, 1, 2, 3]]


@st.composite
def spellings(draw: st.DrawFn) -> tuple[bytes, dict[str, object]]:
    end, gap = draw(ENDS), draw(GAPS)
    head = draw(st.sampled_from(["OFF", "COFF", "NOFF", "STCNOFF"]))
    extra = {"OFF": [], "COFF": ["1", "0.5", "0", "1"], "NOFF": ["0", "0", "1"], "STCNOFF": ["0"] * 9}[head]
    count = draw(st.integers(3, 8))
    points = draw(st.lists(st.tuples(*[NUMBERS] * 3), min_size=count, max_size=count))
    node = st.integers(0, count - 1)
    faces = draw(st.lists(st.lists(node, min_size=1, max_size=6), min_size=1, max_size=5))
    colour = [draw(st.sampled_from([[], ["7"], ["0.1", "0.2", "0.3"]])) for _ in faces]
    around = st.sampled_from(["", "", " ", " # 3 0 1 2", f"{end}# x{end}", f" {end}"])
    text = head + draw(st.sampled_from([gap, end, f" # y{end}"]))
    text += gap.join(map(str, [count, len(faces), *draw(st.sampled_from([[], [0], [9]]))])) + draw(around) + end
    for row in points:
        text += gap.join([*row, *extra]) + draw(around) + end
    for row, more in zip(faces, colour, strict=True):
        text += gap.join(map(str, [len(row), *row, *more])) + draw(around) + end
    return text.encode(), {"points": [[float(x) for x in p] for p in points], "faces": faces}


@given(spellings())
def test_every_spelling_reads_the_same(case: tuple[bytes, dict[str, list[list[int]]]]) -> None:
    data, expected = case
    parsed = off.read({".off": data})
    assert parsed.points.tolist() == expected["points"]
    assert [row for b in parsed.cells for row in b.nodes.tolist()] == expected["faces"]
    points = parsed.points.copy()
    points[1, :2] += 0.125
    again = spliced(parsed.slots, data, parsed.points, points)
    assert off.read({".off": again}).points.tolist() == points.tolist()
    assert facts(off.read({".off": again}))[1:] == facts(parsed)[1:]


@FEW
@given(spellings())
def test_a_cut_file_is_refused_or_the_same(case: tuple[bytes, dict[str, object]]) -> None:
    start = last_word(case[0], rb"#[^\r\n]*")
    check_cuts(off, {".off": case[0]}, ".off", lambda rest: len(rest) > start)


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    read_or_refuse(off, {".off": data.draw(damaged(PLAIN))})


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_words(data: bytes) -> None:
    read_or_refuse(off, {".off": data})
    read_or_refuse(off, {".off": b"OFF\n" + data})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"OFF", b"4OFF", r"line 1: an OFF file must start with OFF, found '4OFF'"),
        (b"OFF", b"OFF BINARY", r"line 1: binary OFF cannot be read"),
        (b"5 2 0\n", b"5\n", r"line 3: the numbers of points, faces and edges were expected, found 1 words"),
        (b"5 2 0", b"-5 2 0", r"line 3: the number of points is negative"),
        (b"5 2 0", b"5 3 0", r"expected 1 more lines, the file ends"),
        (b"5 2 0", b"5 1 0", r"line 10: the file goes on behind the 5 points and 1 faces"),
        (b"5 2 0", b"4 2 0", r"line 8: an integer was expected, found '2.0'"),
        (b"5 2 0", b"6 1 0", r"line 9: a point takes 3 numbers here, found 4 words"),
        (b"1.0 1.0 0.0", b"1.0 1.0", r"line 6: a point takes 3 numbers here, found 2 words"),
        (b"1.0 1.0 0.0", b"1.0 1e400 0.0", r"line 6: the number '1e400' is too large"),
        (b"3 0 1 2\n", b"3 0 1\n", r"line 9: a face with 3 corners has 2 numbers behind"),
        (b"3 0 1 2\n", b"0\n", r"line 9: a face with 0 corners"),
        (b"3 0 1 2\n", b"3 0 1 5\n", r"line 9: a cell names the node 5, but the nodes are 0 to 4"),
        (b"255 0 0", b"red", r"line 10: a number was expected, found 'red'"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in PLAIN
    with pytest.raises(FormatError, match=message):
        off.read({".off": PLAIN.replace(old, new, 1)})


@pytest.mark.parametrize("dim", [2, 3])
def test_conversion_names_what_is_lost(dim: int) -> None:
    mesh = triangle_grid(dim=dim)
    written = off.write(mesh)
    assert written.lost == [
        "OFF cannot hold line cells: 8 were left out (markers 'bottom wall', 'top')",
        "OFF cannot hold cell regions: 2 regions were merged (among them 'steel', 'air')",
    ]
    parsed = off.read(contents(written))
    assert parsed.points[:, :dim].tobytes() == mesh.points.tobytes()
    assert cells_of(parsed, "triangle") == cells_of(mesh, "triangle")
    with pytest.raises(FormatError, match="this mesh has none"):
        off.write(Mesh(mesh.points, mesh.cells[1:]))
    one = CellBlock("triangle", mesh.cells[0].nodes, np.full(32, 3))
    lost = off.write(Mesh(mesh.points, (one,), {(2, 3): "steel"})).lost
    assert lost == ["OFF cannot hold cell regions: the name 'steel' was left out"]
