"""SU2 meshes with nodes that are copied: periodic ones, and parts of a partitioned mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import spliced
from support.damage import check_cuts, damaged, facts, read_or_refuse

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io import su2

# Four columns of three nodes, x = 0 to 3: of the two in the middle, each of x = 1 is the image of one of x = 3.
PERIODIC = b"""% made up
NDIME= 2
NELEM= 12
5 0 4 1 0
5 1 4 5 1
5 1 5 2 2
5 2 5 6 3
5 2 6 3 4
5 3 6 7 5
5 4 8 5 6
5 5 8 9 7
5 5 9 6 8
5 6 9 10 9
5 6 10 7 10
5 7 10 11 11
NPOIN= 12 9
0.0 0.0 0
1.0 0.0 1
2.0 0.0 2
3.0 0.0 3
0.0 1.0 4
1.125 1.0 5
2.0 1.25 6
3.0 1.0 7
0.0 2.0 8
1.0 2.0 9
2.0 2.0 10
3.0 2.0 11
NMARK= 3
MARKER_TAG= wall
MARKER_ELEMS= 1
3 0 1 0
MARKER_TAG= SEND_RECEIVE
MARKER_ELEMS= 3
SEND_TO= 1
1 1 1
1 5 1
1 4 2
MARKER_TAG= SEND_RECEIVE
MARKER_ELEMS= 3
SEND_TO= -1
1 3 1
1 7 1
1 6 2
NPERIODIC= 3
PERIODIC_INDEX= 0
0 0 0
0 0 0
0 0 0
PERIODIC_INDEX= 1
0 0 0
0 0 0
2.0 0 0
PERIODIC_INDEX= 2
0 0 0
0 0 0
-2.0e0 0 0
"""


def replaced(*changes: tuple[bytes, bytes]) -> bytes:
    data = PERIODIC
    for old, new in changes:
        assert data.count(old) == 1, old
        data = data.replace(old, new)
    return data


def test_the_copied_nodes_are_vertices_of_one_marker() -> None:
    parsed = su2.read({".su2": PERIODIC})
    vertices = [block for block in parsed.cells if block.kind == "vertex"]
    assert [block.nodes.ravel().tolist() for block in vertices] == [[1, 5, 4], [3, 7, 6]]
    assert [set(block.regions.tolist()) for block in vertices] == [{2}, {2}]
    assert dict(parsed.region_names) == {(1, 1): "wall", (0, 2): "SEND_RECEIVE"}
    assert parsed.unread == ["the keyword SEND_TO", "the keyword NPERIODIC", "the keyword PERIODIC_INDEX"]


def test_smoothing_holds_them_and_changes_nothing_else(tmp_path: Path) -> None:
    data = replaced((b"1 4 2", b"1 4 1"), (b"1 6 2", b"1 7 1"))  # so that node 6 is free
    path, out = tmp_path / "periodic.su2", tmp_path / "out.su2"
    path.write_bytes(data)
    mesh = gmsnet.read(path)
    result = gmsnet.smooth(mesh)
    assert result.held["node of a line or vertex cell"].tolist() == [5]  # the others are on the boundary
    assert np.flatnonzero(result.moved).tolist() == [6]
    assert gmsnet.write(result.mesh, out) == []
    old, new = data.splitlines(), out.read_bytes().splitlines()
    assert [a for a, b in zip(old, new, strict=True) if a != b] == [b"2.0 1.25 6"]


def test_so_are_those_of_a_part_of_a_partitioned_mesh() -> None:
    """What it sends to another part and receives from there are other nodes, whatever their number."""
    data = replaced((b"1 1 1\n1 5 1\n1 4 2", b"1 1 0\n1 5 0\n1 4 0"), (b"1 3 1\n1 7 1\n1 6 2", b"1 3 0\n1 7 0\n1 6 0"))
    for each in (data, data[: data.index(b"NPERIODIC")].replace(b"SEND_TO= ", b"SEND_TO=").replace(b"1\n1", b"2\n1")):
        parsed = su2.read({".su2": each})
        assert sum(len(block.nodes) for block in parsed.cells if block.kind == "vertex") == 6


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"SEND_TO= 1\n1 1 1\n", b"SEND_TO= 1\n", r"line 35: MARKER_ELEMS= 3 and SEND_TO are followed by 2 rows"),
        (b"SEND_TO= 1\n", b"SEND_TO=\n", r"line 35: one number was expected after SEND_TO=, found 0 words"),
        (b"SEND_TO= 1\n", b"SEND_TO= x\n", r"line 35: an integer was expected, found 'x'"),
        (b"3 0 1 0\n", b"3 0 1 0\nSEND_TO= 1\n", r"line 33: SEND_TO without MARKER_TAG= SEND_RECEIVE"),
        (b"1 5 1\n", b"1 50 1\n", r"line 37: a cell names the node 50"),
        (b"1 5 1\n", b"3 5 1\n", r"line 37: a cell of type 3 cannot be read here; known are 1 \(vertex\)"),
        (b"1 5 1\n", b"1 5 1 2 3\n", r"line 37: a vertex has 1 nodes, found 4 numbers"),
        (b"NPERIODIC= 3", b"NPERIODIC= 4", r"NPERIODIC announces 4 transformations, but the file has 3"),
        (b"-2.0e0 0 0\n", b"", r"line 54: PERIODIC_INDEX must be followed by 3 rows of 3 numbers"),
        (b"-2.0e0 0 0\n", b"-2.0e0 0 x\n", r"line 57: a number was expected, found 'x'"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    with pytest.raises(FormatError, match=message if old != b"SEND_TO= -1\n" else "the file"):
        su2.read({".su2": replaced((old, new))})


def test_a_cut_file_is_refused_or_the_same() -> None:
    end = PERIODIC.rindex(b"0")
    bare = PERIODIC[: PERIODIC.index(b"NMARK=")]  # a whole file without markers
    check_cuts(su2, {".su2": PERIODIC}, ".su2", lambda left: len(left) > end or left == bare)


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    read_or_refuse(su2, {".su2": data.draw(damaged(PERIODIC))})


def test_new_coordinates_leave_the_rest() -> None:
    parsed = su2.read({".su2": PERIODIC})
    points = parsed.points.copy()
    points[6] += 0.125
    again = spliced(parsed.slots, PERIODIC, parsed.points, points)
    assert again == replaced((b"2.0 1.25 6", b"2.125 1.375 6"))
    assert facts(su2.read({".su2": again}))[1:] == facts(parsed)[1:]


def test_a_conversion_names_what_it_leaves_out(tmp_path: Path) -> None:
    path = tmp_path / "a.su2"
    path.write_bytes(PERIODIC)
    mesh = gmsnet.read(path)
    lost = gmsnet.write(mesh, tmp_path / "a.vtu")
    assert lost[-1] == (
        "only the SU2 file that was read holds the keyword SEND_TO, the keyword NPERIODIC, the keyword PERIODIC_INDEX: "
        "left out"
    )
    other = gmsnet.Mesh(mesh.points, mesh.cells, mesh.region_names)
    gmsnet.write(other, tmp_path / "b.su2")  # SU2 would ask what SEND_RECEIVE sends where
    assert set(gmsnet.read(tmp_path / "b.su2").markers) == {"wall", "send_receive"}
