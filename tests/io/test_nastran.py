"""Nastran's bulk data: fields of all widths, numbers as Nastran writes them, damage, conversion."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support.contracts import contents, mesh_of, moved_points, read, spliced
from support.damage import cells_of, check_cuts, damaged, facts, read_or_refuse, regions_of, triangle_grid

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.generate import disturb, lattice_volume
from gmsnet.io import nastran
from gmsnet.io.nastran_numbers import fitted, worth
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

MESHES = os.environ.get("GMSNET_MESHES", "")

PLAIN = b"""$ made up
SOL 101
CEND
TITLE = nothing, GRID and so on
BEGIN BULK
PSHELL         7       1      .1
GRID           1              0.      0.      0.              45
grid*                  2                              1.              0.
*                     0.
GRID,3,,1.,1.0000001,0.$ behind
GRID           4              0.      1.
GRID    5               5.-1     .5D0
CTRIA3         1       7       1       2       5
CTRIA3,2,7,2,3,5
CTRIA3*                3               7               3               4
*                      5
CTRIA3         4               4       1       5
CROD           9       2       1       2
CONM2         10       5       0      1.
FORCE          1       5       0     1.0      0.      0.      1.
SPC1           1     123       1    THRU       3
RBE2          11       4     123       2
ENDDATA
GRID           9              0.      0.      0.
"""


def check_fields(data: bytes, seed: int = 0) -> bytes:
    """The same points give the same file; other ones read back, and the length of no line of full fields changes."""
    parsed = read(nastran, data)
    assert spliced(parsed.slots, data, parsed.points, parsed.points.copy()) == data
    new = moved_points(parsed, seed)
    new[:, 2:] = parsed.points[:, 2:]
    out = spliced(parsed.slots, data, parsed.points, new)
    again = read(nastran, out)
    assert facts(again)[1:] == facts(parsed)[1:]
    assert again.points.tolist() == new.tolist()
    old_lines, new_lines = data.splitlines(), out.splitlines()
    assert len(old_lines) == len(new_lines)
    for old, line in zip(old_lines, new_lines, strict=True):
        if b"," not in old and len(old) % 8 == 0:
            assert len(line) == len(old)
        if old[:4].upper() != b"GRID" and old[:1] != b"*":
            assert old == line
    assert read(nastran, spliced(again.slots, out, new, parsed.points)).points.tolist() == parsed.points.tolist()
    return out


def test_a_plain_file() -> None:
    parsed = read(nastran, PLAIN)
    assert parsed.points.tolist() == [[0, 0], [1, 0], [1, 1.0000001], [0, 1], [0.5, 0.5]]  # one has no z
    assert sorted(cells_of(parsed, "triangle")) == [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    assert sorted(regions_of(parsed, "triangle")) == [4, 7, 7, 7]  # a property that is left out has the cell's number
    assert cells_of(parsed, "line") == [[0, 1]]
    assert dict(parsed.region_names)[2, 7] == "PSHELL 7"
    held = {name: mesh_of(parsed).markers[name].tolist() for name in ("CONM2", "FORCE", "SPC1", "RBE2")}
    assert held == {"CONM2": [4], "FORCE": [4], "SPC1": [0, 1, 2], "RBE2": [1, 3]}
    assert parsed.unread == [f"the card {card}" for card in ("CONM2", "FORCE", "PSHELL", "RBE2", "SPC1")]
    check_fields(PLAIN)


def test_new_numbers_stand_where_the_old_ones_stood() -> None:
    parsed = read(nastran, PLAIN)
    new = parsed.points.copy()
    new[:, :2] += 0.0625
    assert parsed.rounding is not None
    out = spliced(parsed.slots, PLAIN, parsed.points, parsed.rounding.kept(parsed.points, new))
    assert out.splitlines()[6:12] == [
        b"GRID           1           .0625   .0625      0.              45",
        b"grid*                  2                          1.0625           .0625",
        b"*                     0.",
        b"GRID,3,,1.0625,1.0625001,0.$ behind",
        b"GRID           4           .0625  1.0625",
        b"GRID    5               .5625   .5625",
    ]


ONE_LINE = "GRID           2              1.      0.      0.\nCROD           1       1       1       2\n"


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from([8, 16]))
@example(-1.7976931348623157e308, 8)
@example(999999.96, 8)
@example(-0.0, 8)
@example(5e-324, 8)
@example(-1.2345678e-100, 8)
def test_numbers_are_fitted_into_fields(value: float, width: int) -> None:
    text = fitted(value, width)
    assert len(text) <= width
    assert "." in text
    assert all(letter in "0123456789.+-" for letter in text)
    found = worth(text)
    assert fitted(found, width) == text or worth(fitted(found, width)) == found
    points = np.array([[value, 0.0, 0.0]])
    rounding = nastran.rounding_of(np.array([width]), points)
    assert rounding.keep(points, np.array([0]))[0, 0] == found
    if 1e-300 < abs(value) < 1e300 or value == 0.0:
        assert abs(found - value) <= rounding.unit * abs(value) * (1 + 1e-12) + rounding.grain
    if width == 8:
        data = f"GRID           1        {text:>8}      1.      0.\n{ONE_LINE}".encode()
        assert read(nastran, data).points[0, 0] == found


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.5-3", 1.5e-3), ("-1.+2", -100.0), (".5", 0.5), ("7.E+1", 70.0), ("1.d2", 100.0), ("+3.", 3.0), ("", 0.0),
     ("-1.-5", -1e-5), ("2", 2.0)],
)  # fmt: skip
@pytest.mark.parametrize(
    "form",
    [
        "GRID           1        {:>8}      1.      0.",
        "GRID,1,,{},1.,0.",
        "GRID*                  1                {:<16}              1.\n*       0.",
    ],
)
def test_numbers_as_nastran_writes_them(text: str, value: float, form: str) -> None:
    assert read(nastran, f"{form.format(text)}\n{ONE_LINE}".encode()).points[0].tolist() == [value, 1.0, 0.0]


def test_node_orders_of_second_order() -> None:
    head = "".join(f"GRID,{k},,{k}.,0.,0.\n" for k in range(1, 21))
    hexa = "CHEXA,1,1," + ",".join(map(str, range(1, 7))) + "\n+," + ",".join(map(str, range(7, 15)))
    hexa += "\n+," + ",".join(map(str, range(15, 21))) + "\n"
    penta = "CPENTA,2,1," + ",".join(map(str, range(1, 7))) + "\n+," + ",".join(map(str, range(7, 15))) + "\n+,15\n"
    others = "CTETRA,3,1,1,2,3,4,5,6\n+,7,8,9,10\nCQUAD8,4,1,1,2,3,4,5,6\n+,,8\n"
    others += "CQUAD9,5,1,1,2,3,4,5,6\n+,7,8,9\n"  # as Gmsh writes them
    parsed = read(nastran, (head + hexa + penta + others).encode())
    assert cells_of(parsed, "quad9") == [list(range(9))]
    assert cells_of(parsed, "hexahedron20") == [[*range(12), 16, 17, 18, 19, 12, 13, 14, 15]]
    assert cells_of(parsed, "wedge15") == [[*range(9), 12, 13, 14, 9, 10, 11]]
    assert cells_of(parsed, "tetra10") == [list(range(10))]
    assert cells_of(parsed, "nastran:CQUAD8") == [[0, 1, 2, 3, 4, 5, 7]]  # without one of its nodes


def test_an_unknown_element_holds_its_nodes() -> None:
    data = PLAIN.replace(b"CONM2         10       5", b"CWELD         10       2      XX       5       4")
    held = mesh_of(read(nastran, data)).markers["CWELD"].tolist()
    assert held == [3, 4]


def test_a_support_of_all_nodes_says_nothing_of_a_place() -> None:
    data = PLAIN.replace(b"THRU       3", b"THRU       9")
    assert "SPC1" not in mesh_of(read(nastran, data)).markers


def test_a_cut_file_is_refused_or_the_same() -> None:
    end = PLAIN.index(b"ENDDATA") + len(b"ENDDATA")
    check_cuts(nastran, {".bdf": PLAIN}, ".bdf", lambda rest: len(rest) >= end)
    for cut in range(PLAIN.index(b"BEGIN BULK") + 10, end):  # behind BEGIN BULK, ENDDATA must follow
        assert read_or_refuse(nastran, {".bdf": PLAIN[:cut]}) is None


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    bulk = PLAIN.split(b"BEGIN BULK\n")[1].split(b"ENDDATA")[0]
    read_or_refuse(nastran, {".bdf": data.draw(damaged(data.draw(st.sampled_from([PLAIN, bulk]))))})


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_words(data: bytes) -> None:
    read_or_refuse(nastran, {".bdf": data})
    read_or_refuse(nastran, {".bdf": b"GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nCROD,1,1,1,2\n" + data})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"BEGIN BULK\n", b"", r"line 2: case control without BEGIN BULK behind it: the file is cut off"),
        (b"PSHELL  ", b"BEGIN SUPER=1\nPSHELL", r"line 6: a second BEGIN BULK: superelements are not read"),
        (b"GRID           1        ", b"GRID           1       9", r"line 7: the node 1 is in another coordinate"),
        (b"SPC1           1", b"GRDSET,,9\nSPC1           1", r"line 21: GRDSET puts all nodes into another"),
        (b"SPC1           1", b"INCLUDE 'x.bdf'\nSPC1           1", r"line 21: INCLUDE: only nodes of GRID cards"),
        (b"GRID           4", b"GRID           1", r"line 11: the node 1 is given twice"),
        (b"GRID           4", b"GRID            ", r"line 11: the number of a node was expected in this"),
        (b"GRID           4", b"GRID\t4\t", r"line 11: GRID has a tab: columns are counted, so write blanks"),
        (b"5.-1     .5D0", b"5.-1     nan ", r"line 12: a real number was expected in this field, found 'nan'"),
        (b"5.-1     .5D0", b"5.-1    1.+99999", r"line 12: a finite number was expected in this field"),
        (b"5.-1     .5D0", b"5.-1", r"line 12: the node 5 has fewer than two coordinates"),
        (b"1.0000001,0.", b"1.0000001,2.", r"line 11: the node 4 has no field for z, which other nodes have"),
        (b"\n*                      5", b"", r"line 15: CTRIA3 has 2 nodes, not 3: is a line that continues it lost"),
        (b"\n*                      5", b"\n+,5", r"line 15: CTRIA3 has lines of several forms"),
        (b"CTRIA3,2,7,2,3,5", b"CTRIA3,2,7,2,3,8", r"line 14: CTRIA3 names the node 8, but there is no such GRID"),
        (b"CTRIA3,2,7,2,3,5", b"CTRIA3,2,7,2,3,x", r"line 14: the number of a node was expected in this f"),
        (b"CTRIA3,2,7,2,3,5", b"CTRIA3,2,7,2,3," + b"5" * 40, r"line 14: a field has 40 characters: there can be 32"),
        (b"CTRIA3,2,7,2,3,5", b"CTRIA3,2,7,,,", r"line 14: CTRIA3 has no nodes: the card is cut off"),
        (b"ENDDATA\n", b"", r"ENDDATA is missing behind BEGIN BULK: the file is cut off"),
        (b"PSHELL  ", b"+       ", r"line 6: the first line of the bulk data continues no card"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in PLAIN
    with pytest.raises(FormatError, match=message):
        read(nastran, PLAIN.replace(old, new, 1))


def test_continuations_in_another_order_are_refused() -> None:
    cards = b"CQUAD8  1       1       1       2       3       4       5       6       +A      \n+B      7       8\n"
    nodes = b"".join(b"GRID,%d,,%d.,0.,0.\n" % (k, k) for k in range(1, 9))
    with pytest.raises(FormatError, match="line 10: this line continues another card than the one before it"):
        read(nastran, nodes + cards)
    assert cells_of(read(nastran, nodes + cards.replace(b"+B", b"+A")), "quad8") == [list(range(8))]


@pytest.mark.parametrize(("data", "what"), [(b"GRID,1,,0.,0.,0.\n", "elements are"), (b"PARAM,POST,-1\n", "GRID is")])
def test_bulk_data_without_a_mesh(data: bytes, what: str) -> None:
    with pytest.raises(FormatError, match=f"no {what} in this file: it is cut off, or no bulk data"):
        read(nastran, data)


def test_conversion_keeps_cells_and_regions() -> None:
    mesh = triangle_grid(dim=3)
    written = nastran.write(mesh)
    assert written.lost == [
        "Nastran numbers its regions and markers: the names 'bottom wall' (1), 'top' (2), 'steel' (3), 'air' (7) were "
        "left out"
    ]
    back = read(nastran, contents(written)[".bdf"])
    assert back.points.tobytes() == mesh.points.tobytes()
    for kind in ("triangle", "line"):
        assert cells_of(back, kind) == cells_of(mesh, kind)
        assert regions_of(back, kind) == regions_of(mesh, kind)
    check_fields(contents(written)[".bdf"])


def test_blank_properties_are_no_regions_where_the_file_has_no_properties() -> None:
    """Else each cell would be a region of its own, and all nodes would be held between them."""
    blank = PLAIN.replace(b"PSHELL         7       1      .1\n", b"").replace(b"CTRIA3,2,7,2,3,5", b"CTRIA3,2,,2,3,5")
    parsed = read(nastran, blank)
    assert sorted(regions_of(parsed, "triangle")) == [0, 0, 7, 7]
    other = blank.replace(b"BEGIN BULK\n", b"BEGIN BULK\nPSOLID         8       1\n")
    assert sorted(regions_of(read(nastran, other), "triangle")) == [2, 4, 7, 7]


def test_regions_that_are_no_numbers_of_properties_get_others() -> None:
    blocks = (
        CellBlock("triangle", [[0, 1, 2]], [-3]),
        CellBlock("line", [[0, 1]], [5]),
        CellBlock("quad", [[0, 1, 2, 3]], [5]),
    )
    written = nastran.write(Mesh([[0, 0], [1, 0], [1, 1], [0, 1]], blocks))
    assert written.lost == ["Nastran numbers its properties from 1, each for itself: -3 (6), 5 (7)"]
    back = read(nastran, contents(written)[".bdf"])
    assert [regions_of(back, kind) for kind in ("triangle", "quad", "line")] == [[6], [5], [7]]


def in_short_fields(mesh: Mesh) -> bytes:
    """The mesh in fields of 8 columns, its points rounded to them."""
    rows = [f"GRID    {k:>8}{'':8}" + "".join(f"{fitted(x, 8):>8}" for x in (*p, 0.0)[:3]) for k, p in
            enumerate(mesh.points.tolist(), 1)]  # fmt: skip
    card = {"triangle": "CTRIA3", "tetra": "CTETRA"}
    rows += [",".join(map(str, [card[b.kind], 1 + 10**6 * j + k, 1, *(n + 1 for n in nodes)])) for j, b in
             enumerate(mesh.cells) if b.kind in card for k, nodes in enumerate(b.nodes.tolist())]  # fmt: skip
    return "\n".join(["BEGIN BULK", *rows, "ENDDATA", ""]).encode()


@pytest.mark.parametrize("kind", ["planar", "volume"])
@pytest.mark.parametrize("size", [1.0, 4e-3])
def test_what_is_written_is_what_was_judged(kind: str, size: float, tmp_path: Path) -> None:
    """A mesh so small and far away that its cells have a few units of the last column: none of them is inverted."""
    mesh = triangle_grid(12) if kind == "planar" else lattice_volume(3)
    inner = np.setdiff1d(np.arange(len(mesh.points)), np.unique(np.concatenate(
        [b.nodes.ravel() for b in mesh.cells if b.kind == ("line" if kind == "planar" else "triangle")])))  # fmt: skip
    mesh = disturb(mesh, inner, 0.35, seed=3)
    mesh = mesh.with_points(np.round(mesh.points * size, 5) + (-20.0 if size < 1 else 0.0))
    (tmp_path / "a.bdf").write_bytes(in_short_fields(mesh))
    given_mesh = gmsnet.read(tmp_path / "a.bdf")
    before = gmsnet.quality(given_mesh)
    result = gmsnet.smooth(given_mesh)
    assert result.moved.any() or size < 1.0
    assert gmsnet.write(result.mesh, tmp_path / "b.bdf") == []
    again = gmsnet.read(tmp_path / "b.bdf")
    assert again.points.tobytes() == result.mesh.points.tobytes()
    after = gmsnet.quality(again)
    assert after.inverted <= before.inverted
    assert after.shape.min() >= before.shape.min() - 1e-12
    lengths = {len(line) for line in (tmp_path / "b.bdf").read_bytes().splitlines() if line.startswith(b"GRID")}
    assert lengths == {48}


def test_without_the_rounding_cells_would_be_inverted() -> None:
    """So the test above can fail: the same mesh, smoothed as if its file kept all digits, and then rounded."""
    mesh = disturb(
        triangle_grid(12), np.array([k for k in range(169) if 0 < k % 13 < 12 and 0 < k // 13 < 12]), 0.35, seed=3
    )
    mesh = Mesh(np.round(mesh.points * 4e-4, 5) - 20.0, mesh.cells[:1])
    rounding = nastran.rounding_of(np.full(169, 8), mesh.points)
    free = gmsnet.smooth(mesh).mesh
    rounded = free.with_points(rounding.keep(free.points, np.arange(169)))
    assert gmsnet.quality(rounded).inverted > gmsnet.quality(mesh).inverted
    assert rounding.grain == 5e-5  # -20.1234


@pytest.mark.skipif(not MESHES, reason="GMSNET_MESHES does not name a folder of meshes")
@pytest.mark.parametrize(
    ("name", "cells"), [("cube", {"hexahedron": 26}), ("plate_mixed", {"quad": 24, "triangle": 2})]
)
def test_real_files(name: str, cells: dict[str, int], tmp_path: Path) -> None:
    data = (Path(MESHES) / "formats" / f"{name}.bdf").read_bytes()
    parsed = read(nastran, data)
    assert {b.kind: len([1 for c in parsed.cells if c.kind == b.kind for _ in c.nodes]) for b in parsed.cells
            if b.kind != "vertex"} == cells  # fmt: skip
    for seed in range(3):
        check_fields(data, seed)
