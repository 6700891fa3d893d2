"""STL: text and binary, welding, odd spellings, damage, conversion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista
import vtk
from hypothesis import given, settings
from hypothesis import strategies as st
from support.contracts import (
    check_all_cuts_refused,
    check_conversion,
    check_splice,
    contents,
    moved_points,
    read,
    refused,
)
from support.damage import ENDS, GAPS, NUMBERS, damaged, facts, read_or_refuse, regions_of, triangle_grid
from support.vtk_variants import mixed_mesh, points_by_vtk

from gmsnet.errors import FormatError
from gmsnet.io import stl
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


def text_stl(solids: dict[str, list[list[str]]]) -> bytes:
    """Name → facets of three corners each, as text."""
    parts = []
    for name, facets in solids.items():
        parts.append(f"solid {name}\n")
        for corners in facets:
            rows = "".join(f"   vertex {corner}\n" for corner in corners)
            parts.append(f" facet normal 0 0 1\n  outer loop\n{rows}  endloop\n endfacet\n")
        parts.append(f"endsolid {name}\n")
    return "".join(parts).encode()


def binary_stl(triangles: np.ndarray, head: bytes = b"solid like a text") -> bytes:
    """(n, 3, 3) corners; attributes are counted, normals are zero."""
    records = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["corners"], records["attribute"] = triangles, np.arange(len(triangles))
    return head.ljust(80, b"\0") + len(triangles).to_bytes(4, "little") + records.tobytes()


PLAIN = text_stl({"left wall": [["0 0 5", "1 0 5", "1 1 5"]], "": [["0 0 5", "1 1 5", "0 1 5"]]})


def test_a_plain_file() -> None:
    parsed = read(stl, PLAIN)
    assert parsed.cells[0].nodes.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert parsed.cells[0].regions.tolist() == [1, 2]
    assert parsed.region_names == {(2, 1): "left wall"}
    assert parsed.points.tolist() == [[0, 0, 5], [1, 0, 5], [1, 1, 5], [0, 1, 5]]
    assert not parsed.single
    check_splice(stl, PLAIN)


def test_equal_means_equal_as_decimals() -> None:
    one, other = "0.1", "0.1000000000000000000001"
    assert float(one) == float(other)
    facets = [["0 0 0", f"{one} 0 0", "1 1 0"], ["-0.0 0e5 0", f"{other} 0 0", "1 1e0 0.00"],
              ["+0 .0 0", "1.0e-1 0 0", "10e-1 1 0"], ["0 0 0", "1e-9999 0 0", f"{other}00 0 0"],
              ["0 0 0", f"0.1{'0' * 80} 0 0", "2 2 0"]]  # fmt: skip
    parsed = read(stl, text_stl({"x": facets}))
    assert parsed.cells[0].nodes.tolist() == [[0, 1, 2], [0, 3, 2], [0, 1, 2], [0, 4, 3], [0, 1, 5]]


def test_every_copy_of_a_corner_moves() -> None:
    mesh = triangle_grid(3, 3)
    for data in (contents(stl.write(mesh))[".stl"], binary_stl(mesh.points[mesh.cells[0].nodes])):
        parsed = read(stl, data)
        assert len(parsed.points) == len(mesh.points)
        assert parsed.slots.node.tolist() == parsed.cells[0].nodes.ravel().tolist()  # type: ignore[attr-defined]
        for seed in range(5):
            check_splice(stl, data, seed)


def test_a_binary_file_may_begin_like_a_text() -> None:
    mesh = triangle_grid(2, 3)
    corners = mesh.points[mesh.cells[0].nodes]
    parsed = read(stl, binary_stl(corners))
    assert parsed.single
    assert facts(parsed) == facts(read(stl, binary_stl(corners, b"other")))
    assert regions_of(parsed, "triangle") == [0] * 8
    assert np.array_equal(parsed.points[parsed.cells[0].nodes], corners)


def test_zeros_of_both_signs_are_equal_in_binary_too() -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[-0.0, 0, -0.0], [0, 1, -0.0], [-1, 0, 0]]])
    assert read(stl, binary_stl(corners)).cells[0].nodes.tolist() == [[0, 1, 2], [0, 2, 3]]


@given(st.data())
@settings(max_examples=60)
def test_any_spelling(data: st.DataObject) -> None:
    numbers = data.draw(st.lists(NUMBERS, min_size=18, max_size=18))
    gap, end = data.draw(GAPS), data.draw(ENDS)
    change = data.draw(st.sampled_from([str.lower, str.upper, str.title]))
    names = data.draw(st.lists(st.sampled_from(["", "a", "two words", "solid facet", "é"]), min_size=2, max_size=2))
    lines = []
    for k, name in enumerate(names):
        lines += [
            f"{gap}{change('solid')} {name}",
            f"{change('facet')}{gap}{change('normal')} nan 0 -1.#IND",
            change("outer loop"),
        ]
        for corner in range(3):
            at = 9 * k + 3 * corner
            lines.append(f"{gap}{change('vertex')} {gap.join(numbers[at : at + 3])}{gap}")
        lines += ["", change("endloop"), change("endfacet"), f"{change('endsolid')} {name}"]
    raw = end.join([*lines, ""]).encode()
    parsed = read(stl, raw)
    assert parsed.points[parsed.cells[0].nodes].ravel().tolist() == [float(n) for n in numbers]
    assert regions_of(parsed, "triangle") == [1, 2]
    assert parsed.region_names == {(2, k + 1): name for k, name in enumerate(names) if name}
    slots = parsed.slots
    assert [raw[a:b].decode() for a, b in zip(slots.starts.ravel(), slots.ends.ravel(), strict=True)] == numbers  # type: ignore[attr-defined]


def test_a_file_cut_anywhere_is_refused() -> None:
    between = range(PLAIN.index(b"endsolid") + 8, PLAIN.rindex(b"solid \n facet") + 1)
    for cut in range(len(PLAIN)):
        parsed = read_or_refuse(stl, {".stl": PLAIN[:cut]})
        if cut in between:  # behind a solid the file may end
            assert parsed is None or len(parsed.cells[0].nodes) == 1
        else:  # and at the very end only the repeated name may be cut
            assert parsed is None or facts(parsed) == facts(read(stl, PLAIN))
            assert (parsed is None) == (cut < PLAIN.rindex(b"endsolid") + 8)
    mesh = triangle_grid(2, 3)
    for head in (b"solid", b"x"):
        data = binary_stl(mesh.points[mesh.cells[0].nodes], head)
        check_all_cuts_refused(stl, data, len(data))


FACET = "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 1 1 0 endloop endfacet\n"


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", "neither a text STL file, .* nor a whole binary one: it has 0 bytes"),
        (bytes(84), "the file has no triangles"),
        (binary_stl(np.ones((2, 3, 3)), b"solid x") + b"more", "with the 2 triangles .* would have 184"),
        (b"solid x\n" + FACET.replace("\n", " ").encode() + b"endsolid x\n", "line 2: 'endsolid' does not begin"),
        (bytes(80) + b"\xff\xff\xff\xff" + bytes(100), "with the 4294967295 triangles .* would have 214748364834"),
        (b"solid x\nendsolid x\n", "no triangles"),
        (b"solid x\n" + FACET.encode(), "line 3: 'endsolid' is missing"),
        (b"solid x\n" + FACET.encode() + b"solid y\nendsolid y\n", "line 3: the solid before has no 'endsolid'"),
        (b"solid x\nendsolid x\nendsolid y\n", "line 3: 'endsolid' without 'solid'"),
        (f"solid x\n{FACET}endsolid x\nmore\n".encode(), "line 4: unknown words behind the last 'endsolid'"),
        (f"solid x\n{FACET}facet normal 0 0 1\nendsolid x\n".encode(), "line 3: the facet that begins here is not c"),
        (f"solid x\n{FACET.replace('outer', 'inner')}endsolid x\n".encode(), "line 2: expected 'outer', found 'inner'"),
        (f"solid x\n{FACET.replace('1 1 0 endloop', '1 1 0 0 endloop')}endsolid x\n".encode(), "line 2: "),
        (f"solid x\n{FACET.replace('1 1 0', '1 b 0')}endsolid x\n".encode(), "line 2: .*expected, found 'b'"),
        (f"solid x\n{FACET.replace('1 1 0', '1 nan 0')}endsolid x\n".encode(), "line 2: .*expected, found 'nan'"),
        (binary_stl(np.full((2, 3, 3), np.inf)), "byte 96: a coordinate is not a finite number"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_words(data: bytes, match: str) -> None:
    refused(stl, data, match)


def test_one_long_word_does_not_widen_all_others() -> None:
    facets = [["0 0 0", "1 0 0", f"0.{'1' * 100_000} 1 0"]] + [["0 0 0", "1 0 0", f"{k} 1 0"] for k in range(2000)]
    data = text_stl({"x": facets})
    assert len(read(stl, data).points) == 2 + 2001
    refused(stl, data.replace(b"outer", b"o" * 100_000, 1), "expected 'outer'", memory=50_000_000)


@given(st.data())
@settings(max_examples=200)
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    mesh = triangle_grid(1, 3)
    originals = [PLAIN, binary_stl(mesh.points[mesh.cells[0].nodes]), contents(stl.write(mesh))[".stl"]]
    read_or_refuse(stl, {".stl": data.draw(st.sampled_from(originals).flatmap(damaged))})


@pytest.mark.parametrize("binary", [False, True])
def test_files_of_vtk(binary: bool, tmp_path: Path) -> None:
    mesh = triangle_grid(4, 3)
    faces = np.pad(mesh.cells[0].nodes, ((0, 0), (1, 0)), constant_values=3).ravel()
    pyvista.PolyData(mesh.points, faces=faces).save(tmp_path / "in.stl", binary=binary)
    data = (tmp_path / "in.stl").read_bytes()
    parsed = read(stl, data)
    assert parsed.single == binary
    assert len(parsed.points) == len(mesh.points)
    reader = vtk.vtkSTLReader()
    reader.MergingOff()
    points, _ = points_by_vtk(reader, check_splice(stl, data), tmp_path / "out.stl")
    assert np.array_equal(points, moved_points(parsed)[parsed.cells[0].nodes.ravel()].astype(np.float32))


def test_conversion_makes_a_solid_of_each_region() -> None:
    for mesh in (triangle_grid(3), triangle_grid(3, 3)):
        back, lost = check_conversion(stl, mesh)
        assert set(back.region_names.values()) == {"steel", "air"}
        was = sorted(
            zip(
                np.where(mesh.cells[0].regions == 3, 1, 2).tolist(),
                mesh.points[mesh.cells[0].nodes].tolist(),
                strict=True,
            )
        )
        now = sorted(
            zip(
                regions_of(back, "triangle"),
                back.points[back.cells[0].nodes][..., : mesh.points.shape[1]].tolist(),
                strict=True,
            )
        )
        assert was == now
        assert ["'bottom wall', 'top'" in lost[1], "counts its solids from 1" in lost[2]] == [True, True]


def test_what_stl_loses_is_named() -> None:
    points = np.array([[0, 0], [1, 0], [1, 1], [1, 0], [2, 1], [9, 9]], dtype=float)
    cells = CellBlock("triangle", np.array([[0, 1, 2], [3, 4, 2]]), np.zeros(2))
    mesh = Mesh(points, (cells,), point_data={"t": np.zeros(6)}, cell_data={"c": (np.arange(2),)})
    lost = stl.write(mesh).lost
    for words in ("no node numbers", "point data: 't'", "cell data: 'c'", "1 was left out", "same place"):
        assert [text for text in lost if words in text], words
    assert contents(stl.write(mesh))[".stl"].startswith(b"solid mesh\nfacet normal 0.0 0.0 1.0\n")


def test_cells_that_are_no_triangles_are_refused() -> None:
    with pytest.raises(FormatError, match="cannot hold cells of type 'quad'"):
        stl.write(mixed_mesh())
    with pytest.raises(FormatError, match="without triangles"):
        stl.write(Mesh(np.zeros((2, 2)), (CellBlock("line", np.array([[0, 1]]), np.zeros(1)),)))
