"""OBJ: many spellings of one mesh, damage, materials and groups, conversion."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.contracts import contents, spliced
from support.damage import ENDS, GAPS, NUMBERS, cells_of, damaged, facts, read_or_refuse, regions_of, triangle_grid

from gmsnet.errors import FormatError
from gmsnet.io import obj
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

PLAIN = b"""# made up
mtllib some.mtl
o thing
v 0.0 0.0 0.0
v 1.0 0.0 0.0 1.0
v 1.0 1.0 0.0 0.1 0.2 0.3
v 0.0 1.0 0.0
vt 0.5 0.5
vn 0.0 0.0 1.0
f 1/1/1 2//1 3
usemtl steel
f -4 -2 -1
g wall top
s off
f 1 2 3 4
l 1 2 3
p 4 2
"""


def test_a_plain_file() -> None:
    parsed = obj.read({".obj": PLAIN})
    assert parsed.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in parsed.cells] == [
        ("triangle", [[0, 1, 2], [0, 2, 3]], [0, 1]),
        ("quad", [[0, 1, 2, 3]], [2]),
        ("line", [[0, 1], [1, 2]], [2, 2]),
        ("vertex", [[3], [1]], [2, 2]),
    ]
    assert parsed.region_names == {
        (2, 1): "steel", (2, 2): "steel / wall top", (1, 2): "steel / wall top", (0, 2): "steel / wall top"
    }  # fmt: skip


@st.composite
def spellings(draw: st.DrawFn) -> tuple[bytes, dict[str, object]]:
    end, gap = draw(ENDS), draw(GAPS)
    points: list[list[float]] = []
    cells: dict[str, list[list[int]]] = {"triangle": [], "quad": [], "polygon": [], "line": [], "vertex": []}
    materials: dict[str, list[str]] = {kind: [] for kind in cells}
    lines, material = [], ""

    def name(node: int) -> str:
        back = draw(st.booleans())
        return str(node - len(points) if back else node + 1) + draw(st.sampled_from(["", "", "/1", "//2", "/1/2"]))

    keys = st.sampled_from(["v", "f", "f", "l", "p", "usemtl", "#", "s", "vt"])
    for key in ["v", "v", "v", *draw(st.lists(keys, max_size=12))]:
        node = st.integers(0, max(0, len(points) - 1))
        words: list[str] = []
        if key == "v":
            words = [draw(NUMBERS) for _ in range(3)]
            points.append([float(w) for w in words])
            words += draw(st.sampled_from([[], [], ["1.0"], ["0.1", "0.2", "0.3"]]))
        elif key == "f":
            nodes = draw(st.lists(node, min_size=3, max_size=5))
            kind = {3: "triangle", 4: "quad", 5: "polygon"}[len(nodes)]
            cells[kind].append(nodes)
            materials[kind].append(material)
            words = [name(n) for n in nodes]
        elif key == "l":
            nodes = draw(st.lists(node, min_size=2, max_size=4))
            cells["line"] += [[a, b] for a, b in itertools.pairwise(nodes)]
            materials["line"] += [material] * (len(nodes) - 1)
            words = [name(n) for n in nodes]
        elif key == "p":
            nodes = draw(st.lists(node, min_size=1, max_size=2))
            cells["vertex"] += [[n] for n in nodes]
            materials["vertex"] += [material] * len(nodes)
            words = [name(n) for n in nodes]
        elif key == "usemtl":
            material = draw(st.sampled_from(["a", "b", "c d"]))
            words = [material]
        else:
            words = {"s": ["off"], "vt": ["0.5", "0.5"]}.get(key, ["f", "1"])
        lines.append(
            draw(st.sampled_from(["", " "])) + gap.join([key, *words]) + draw(st.sampled_from(["", " ", " # f"]))
        )
    return end.join([*lines, ""]).encode(), {"points": points, "cells": cells, "materials": materials}


@given(spellings())
def test_every_spelling_reads_the_same(case: tuple[bytes, dict[str, dict[str, list[list[int]]]]]) -> None:
    data, expected = case
    parsed = obj.read({".obj": data})
    assert parsed.points.tolist() == expected["points"]
    for kind, cells in expected["cells"].items():
        assert cells_of(parsed, kind) == cells
        dim = {"line": 1, "vertex": 0}.get(kind, 2)
        names = [parsed.region_names.get((dim, r), "") for r in regions_of(parsed, kind)]
        assert names == expected["materials"][kind]
    points = parsed.points.copy()
    points[1, :2] += 0.125
    again = spliced(parsed.slots, data, parsed.points, points)
    assert obj.read({".obj": again}).points.tolist() == points.tolist()
    assert facts(obj.read({".obj": again}))[1:] == facts(parsed)[1:]


@given(spellings(), st.data())
def test_a_cut_file_reads_at_most_its_beginning(case: tuple[bytes, dict[str, object]], data: st.DataObject) -> None:
    whole = case[0]
    cut = data.draw(st.integers(0, len(whole)))
    parsed = read_or_refuse(obj, {".obj": whole[:cut]})
    if parsed is not None:
        count = max(0, len(parsed.points) - 1)  # the last one may have lost a digit
        assert parsed.points[:count].tolist() == case[1]["points"][:count]


@given(st.data())
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    read_or_refuse(obj, {".obj": data.draw(damaged(PLAIN))})


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_words(data: bytes) -> None:
    read_or_refuse(obj, {".obj": data})
    read_or_refuse(obj, {".obj": PLAIN + data})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"v 0.0 1.0 0.0\n", b"v 0.0 1.0\n", r"line 7: three coordinates .* were expected, found 2 words"),
        (b"v 0.0 1.0 0.0\n", b"v 0 1 0 1 1\n", r"line 7: three coordinates .* were expected, found 5 words"),
        (b"v 0.0 1.0 0.0\n", b"v 0 1 0 red\n", r"line 7: a number was expected, found 'red'"),
        (b"v 0.0 1.0 0.0\n", b"v 0 1 nan\n", r"line 7: a number was expected, found 'nan'"),
        (b"f 1 2 3 4", b"f 1 2 3 5", r"line 15: a cell names the node 5, but the nodes are 1 to 4"),
        (b"f 1 2 3 4", b"f 1 2 3 0", r"line 15: a node numbered 0: nodes count from 1"),
        (b"f 1 2 3 4", b"f 1 2 3 -5", r"line 15: the node -5 reaches back before the first point"),
        (b"f 1 2 3 4", b"f 1 2", r"line 15: 'f' takes at least 3 nodes, found 2"),
        (b"f 1 2 3 4", b"f 1 2 3/x", r"line 15: numbers separated by slashes were expected, found '3/x'"),
        (b"f 1 2 3 4", b"f 1 2 3 /4", r"line 15: numbers separated by slashes were expected, found '/4'"),
        (b"f 1 2 3 4", b"f 1 2 3 \\\n4", r"line 15: a line that goes on in the next one"),
        (b"p 4 2", b"p", r"line 17: 'p' takes at least 1 nodes, found 0"),
        (b"s off", b"curv 0 1 1 2", r"line 14: a line that starts with 'curv' cannot be read"),
    ],
)
def test_what_is_wrong_is_named(old: bytes, new: bytes, message: str) -> None:
    assert old in PLAIN
    with pytest.raises(FormatError, match=message):
        obj.read({".obj": PLAIN.replace(old, new, 1)})


@pytest.mark.parametrize("line", [b"# \\", b"g a\\b", b"g a \\\\ b", b"g a # \\ \\", b"g a\\#", b"g \\\\ # \\"])
def test_only_a_backslash_that_ends_the_last_word_goes_on(line: bytes) -> None:
    data = PLAIN.replace(b"g wall top", line)
    if line in (b"g a\\#", b"g \\\\ # \\"):
        with pytest.raises(FormatError, match="line 13: a line that goes on in the next one"):
            obj.read({".obj": data})
    else:
        assert len(obj.read({".obj": data}).cells) == len(obj.read({".obj": PLAIN}).cells)


def test_a_huge_word_costs_no_memory() -> None:
    data = b"v 0 0 0\n" * 50_000 + b"x" * 1_000_000
    with pytest.raises(FormatError, match="line 50001: a line that starts with 'xxx"):
        obj.read({".obj": data})


@pytest.mark.parametrize("dim", [2, 3])
def test_conversion_keeps_regions_and_their_names(dim: int) -> None:
    mesh = triangle_grid(dim=dim)
    written = obj.write(mesh)
    assert written.lost == []
    parsed = obj.read(contents(written))
    assert parsed.points[:, :dim].tobytes() == mesh.points.tobytes()
    assert not parsed.points[:, dim:].any()
    for kind, dimension in (("triangle", 2), ("line", 1)):
        assert cells_of(parsed, kind) == cells_of(mesh, kind)
        was, now = ([m.region_names[dimension, r] for r in regions_of(m, kind)] for m in (mesh, parsed))
        assert was == now


def test_conversion_without_regions_writes_no_groups() -> None:
    mesh = triangle_grid()
    blocks = (CellBlock("triangle", mesh.cells[0].nodes, np.zeros(32)), CellBlock("polygon", [[0, 1, 2, 7, 6]], [0]))
    written = obj.write(Mesh(mesh.points, blocks, point_data={"a": np.zeros(25), "b": np.zeros(25)}))
    assert b"g " not in contents(written)[".obj"]
    assert written.lost == ["OBJ cannot hold point data: 'a', 'b' were left out"]
    assert cells_of(obj.read(contents(written)), "polygon") == [[0, 1, 2, 7, 6]]
    with pytest.raises(FormatError, match="OBJ cannot hold cells of type 'triangle6'"):
        obj.write(Mesh(mesh.points, (CellBlock("triangle6", [[0, 1, 2, 3, 4, 5]], [0]),)))


def test_cell_data_that_say_only_the_regions_are_not_lost() -> None:
    mesh = triangle_grid()
    regions = tuple(block.regions for block in mesh.cells)
    other = tuple(block.regions + 1 for block in mesh.cells)
    written = obj.write(Mesh(mesh.points, mesh.cells, mesh.region_names, cell_data={"mat_id": regions, "p": other}))
    assert written.lost == ["OBJ cannot hold cell data: 'p' was left out"]


def test_names_that_would_break_lines_are_changed() -> None:
    mesh = triangle_grid(1)
    names = {(2, 3): "a # b \\", (2, 7): "one\ntwo\0three"}
    text = contents(obj.write(Mesh(mesh.points, mesh.cells, names)))[".obj"]
    assert set(obj.read({".obj": text}).region_names.values()) >= {"a b /", "one two three"}
