"""Gmsh: one mesh in all variants, sections, damage, false counts, real files, conversion."""

from __future__ import annotations

import os
from pathlib import Path

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import gmsh_variants
from support.contracts import check_all_cuts_refused, check_conversion, check_splice, contents, read, refused
from support.damage import ENDS, GAPS, NUMBERS, cells_of, damaged, facts, read_or_refuse, regions_of, triangle_grid
from support.gmsh_variants import VARIANTS
from support.vtk_variants import mixed_mesh

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io import gmsh
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

OLD, NEW = VARIANTS["2.2 text"], VARIANTS["4.1 text"]


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_variant_reads_the_same(variant: str) -> None:
    parsed = read(gmsh, VARIANTS[variant])
    assert parsed.points.tolist() == [list(p) for p in gmsh_variants.POINTS]
    assert [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in parsed.cells] == [
        ("vertex", [[5]], [0]),
        ("line", [[0, 1], [1, 2]], [7, 7]),
        ("triangle", [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 5, 2]], [3, 3, 4, 4, 0]),
    ]
    assert parsed.region_names == {(1, 7): "far wall", (2, 3): "steel", (2, 4): "air"}
    check_splice(gmsh, VARIANTS[variant])


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_file_cut_anywhere_is_refused(variant: str) -> None:
    check_all_cuts_refused(gmsh, VARIANTS[variant])


@pytest.mark.parametrize("variant", VARIANTS)
def test_sections_may_come_in_any_order_among_others(variant: str) -> None:
    data = VARIANTS[variant]
    starts = [data.index(b"$" + key + b"\n") for key in (b"PhysicalNames", b"Nodes", b"Elements")]
    if b"$Entities" in data:
        starts.insert(1, data.index(b"$Entities\n"))
    parts = [data[a:b] for a, b in zip(starts, [*starts[1:], len(data)], strict=True)]
    none = bytes(8) if b"\n4.1 1 8" in data else b"0"
    more = b'$Comments\n$ 3 1e9 "x\n$EndComments\n$Periodic\n%b\n$EndPeriodic\n' % none
    more += b'$NodeData\n1\n"a"\n$EndNodeData\n'
    other = data[: starts[0]] + more + b"".join(reversed(parts)) + more
    assert facts(read(gmsh, other)) == facts(read(gmsh, data))
    check_splice(gmsh, other)


@pytest.mark.parametrize("variant", VARIANTS)
def test_comments_may_come_first(variant: str) -> None:
    data = VARIANTS[variant]
    other = b"$Comments\nof $MeshFormat 2.2\n$EndComments\n$Comments\n$EndComments\n" + data
    assert facts(read(gmsh, other)) == facts(read(gmsh, data))
    check_splice(gmsh, other)


def test_meshio_reads_moved_points_back(tmp_path: Path) -> None:
    for order in ("", "<"):  # meshio wants nodes to be numbered 1, 2, 3, … in a binary file
        data = gmsh_variants.old(order, tags=range(1, 7), follow=True)
        (tmp_path / "out.msh").write_bytes(out := check_splice(gmsh, data))
        assert np.array_equal(meshio.read(tmp_path / "out.msh").points, read(gmsh, out).points)


@pytest.mark.parametrize("file_format", ["gmsh", "gmsh22"])
@pytest.mark.parametrize("binary", [False, True])
def test_files_of_meshio(file_format: str, binary: bool, tmp_path: Path) -> None:
    mesh = triangle_grid(5, 3)
    if file_format == "gmsh":  # in which meshio cannot write two types without entities
        mesh = Mesh(mesh.points, mesh.cells[:1])
    cells = [(b.kind, b.nodes) for b in mesh.cells]
    tags = {"gmsh:physical": [b.regions.astype(np.int32) for b in mesh.cells]}
    tags["gmsh:geometrical"] = tags["gmsh:physical"]
    if file_format == "gmsh":
        tags = {}
    meshio.write(tmp_path / "a.msh", meshio.Mesh(mesh.points, cells, cell_data=tags), file_format, binary=binary)
    data = (tmp_path / "a.msh").read_bytes()
    parsed = read(gmsh, data)
    assert np.array_equal(parsed.points, mesh.points)
    assert [b.nodes.tolist() for b in parsed.cells] == [b.nodes.tolist() for b in mesh.cells]
    assert [b.regions.tolist() for b in parsed.cells] == [(b.regions * bool(tags)).tolist() for b in mesh.cells]
    (tmp_path / "out.msh").write_bytes(out := check_splice(gmsh, data))
    assert np.array_equal(meshio.read(tmp_path / "out.msh").points, read(gmsh, out).points)
    check_all_cuts_refused(gmsh, data, most=80)


@pytest.mark.parametrize(("order", "follow"), [("", False), ("<", False), (">", True)])
def test_a_cell_that_is_listed_once_for_each_of_its_groups_is_one(order: str, follow: bool) -> None:
    """As Gmsh writes version 2.2. A cell that is twice in one group, or with its nodes in another order, stays."""
    again = [(2, 4, *cell[2:]) for cell in gmsh_variants.TRIANGLES[:2]]
    again += [gmsh_variants.TRIANGLES[4], (2, 9, 22, (3, 4, 2))]
    parsed = read(gmsh, data := gmsh_variants.old(order, follow=follow, again=again))
    assert regions_of(parsed, "triangle") == [10, 10, 4, 4, 0, 0, 9]
    assert parsed.region_names[2, 10] == "steel + air"
    check_splice(gmsh, data)


def test_several_physical_groups_make_a_region_of_their_own() -> None:
    for order in ("", "<"):
        parsed = read(gmsh, gmsh_variants.new(order, groups={22: [3, 4], 23: [4, 3]}))
        assert regions_of(parsed, "triangle") == [3, 3, 8, 8, 9]
        assert parsed.region_names[2, 8] == "steel + air"
        assert parsed.region_names[2, 9] == "air + steel"


def test_a_group_that_is_turned_round_keeps_its_name() -> None:
    parsed = read(gmsh, gmsh_variants.new(groups={22: [-4]}))
    assert regions_of(parsed, "triangle") == [3, 3, -4, -4, 0]
    assert parsed.region_names[2, -4] == "air"


def test_partitioned_entities_have_groups_too() -> None:
    cut = NEW.replace(b"2 22 2 2\n", b"2 31 2 2\n")
    assert regions_of(read(gmsh, cut), "triangle") == [3, 3, 0, 0, 0]
    section = (
        b"$PartitionedEntities\n2\n1\n 9 1\n0 0 1 0\n31 2 22 1 2 0 0 0 1 1 0 1 4 2 5 -5\n$EndPartitionedEntities\n"
    )
    whole = cut.replace(b"$Nodes\n", section + b"$Nodes\n")
    assert regions_of(read(gmsh, whole), "triangle") == [3, 3, 4, 4, 0]


def test_elements_without_tags_and_with_partitions() -> None:
    data = OLD.replace(b"4 2 2 3 21", b"4 2 0").replace(b"5 2 2 3 21", b"5 2 4 3 21 1 2")
    assert regions_of(read(gmsh, data), "triangle") == [0, 3, 4, 4, 0]


def test_second_order_elements_get_the_usual_order() -> None:
    points = np.random.default_rng(0).random((20, 3))
    for kind, size in (
        ("triangle6", 6),
        ("quad8", 8),
        ("quad9", 9),
        ("line3", 3),
        ("tetra10", 10),
        ("hexahedron20", 20),
    ):
        mesh = Mesh(points[:size], (CellBlock(kind, np.arange(size)[None], np.array([2])),))
        data = contents(gmsh.write(mesh))[".msh"]
        assert cells_of(read(gmsh, data), kind) == [list(range(size))]
    assert b"1 1 2 3 4 5 6 7 8 9 12 17 10 18 11 19 20 13 16 14 15\n" in data  # Gmsh's places of VTK's nodes


@given(st.data())
@settings(max_examples=60)
def test_any_spelling_of_the_numbers(data: st.DataObject) -> None:
    numbers = data.draw(st.lists(NUMBERS, min_size=12, max_size=12))
    tags = data.draw(st.lists(st.integers(1, 10**9), min_size=4, max_size=4, unique=True))
    gap, end = data.draw(GAPS), data.draw(ENDS)
    rows = [gap.join(numbers[k : k + 3]) for k in range(0, 12, 3)]
    cells = [(tags[0], tags[1], tags[2]), (tags[3], tags[0], tags[2])]
    if data.draw(st.booleans()):
        nodes = ["4", *(f"{t}{gap}{row}" for t, row in zip(tags, rows, strict=True))]
        elements = ["2", *(f"{k}{gap}2 2 {5 + k} 1 {gap.join(map(str, c))}{gap}" for k, c in enumerate(cells))]
        version, expected = "2.2", [5, 6]
    else:
        nodes = [f"1 4 1{gap}9", "2 1 0 4", *map(str, tags), *rows]
        elements = ["1 2 1 2", f"2{gap}1 2 2", *(f"{k} {gap.join(map(str, c))}" for k, c in enumerate(cells))]
        version, expected = "4.1", [0, 0]
    lines = ["$MeshFormat", f"{version} 0 8", "$EndMeshFormat", "$Nodes", *nodes, "$EndNodes", "$Elements", *elements]
    raw = end.join([*lines, "$EndElements", ""]).encode()
    parsed = read(gmsh, raw)
    assert parsed.points.ravel().tolist() == [float(n) for n in numbers]
    assert cells_of(parsed, "triangle") == [[0, 1, 2], [3, 0, 2]]
    assert regions_of(parsed, "triangle") == expected
    slots = parsed.slots
    assert [raw[a:b].decode() for a, b in zip(slots.starts.ravel(), slots.ends.ravel(), strict=True)] == numbers  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("data", "match"),
    [
        (b"", "line 1: not a Gmsh file"),
        (b"$NOD\n1\n1 0 0 0\n$ENDNOD\n", "format '1' is not supported.*gmsh OLD.msh -save -format msh41"),
        (NEW.replace(b"4.1 0", b"4 0"), "format '4' is not supported.*-format msh41"),
        (NEW.replace(b"4.1 0 8", b"4.1 0 4"), "must say 0 .text. or 1 .binary. and the size 8"),
        (VARIANTS["4.1 little"].replace(b"\1\0\0\0", b"\2\0\0\0", 1), "byte 20: the number 1 must follow"),
        (OLD.replace(b"$Nodes\n6", b"$Nodes\n7"), r"line \d+: expected 28 more numbers"),
        (OLD.replace(b"$Nodes\n6", b"$Nodes\n5"), r"line \d+: \$Nodes goes on where its counts say"),
        (OLD.replace(b"$Nodes\n6", b"$Nodes\n999999999999"), r"line \d+: expected 3999999999996 more numbers"),
        (OLD.replace(b"$Nodes\n6", b"$Nodes\n-6"), "a count is negative"),
        (OLD.replace(b"$Elements\n8", b"$Elements\n9"), r"line \d+: \$Elements ends after 8 of 9 elements"),
        (OLD.replace(b"$Elements\n8", b"$Elements\n7"), r"line \d+: \$Elements goes on where its counts say"),
        (OLD.replace(b"$Elements\n8", b"$Elements\n999999999999"), "ends after 8 of 999999999999 elements"),
        (OLD.replace(b"4 2 2 3 21", b"4 99 2 3 21"), r"line \d+: elements of Gmsh type 99 are not supported"),
        (OLD.replace(b"3 21 3 10 900", b"3 21 3 11 900"), r"line \d+: an element names the node 11, which is not in"),
        (OLD.replace(b"\n10 1.0", b"\n3 1.0"), r"line \d+: the node 3 is given twice"),
        (OLD.replace(b"0.45", b"nan"), r"line \d+: a number was expected, found 'nan'"),
        (OLD.replace(b"$Nodes", b"$ParametricNodes"), r"\$ParametricNodes are not supported"),
        (OLD.replace(b"$PhysicalNames\n3", b"$PhysicalNames\n4"), "line 8: expected a physical name"),
        (OLD.replace(b"$PhysicalNames\n3", b"$PhysicalNames\n2"), r"line 7: \$PhysicalNames does not end where"),
        (OLD + OLD[OLD.index(b"$Nodes") :], r"line \d+: expected a new section, found '\$Nodes'"),
        (OLD + b"rubbish", r"line \d+: expected a new section, found 'rubbish'"),
        (OLD[: OLD.index(b"$Elements")], r"\$Elements missing"),
        (OLD[: OLD.index(b"$Elements")] + b"$Elements\n0\n$EndElements\n", "no elements"),
        (NEW.replace(b"$Nodes\n2 6", b"$Nodes\n2 7"), "announces 7 nodes, but its blocks have 6"),
        (NEW.replace(b"$Nodes\n2 6", b"$Nodes\n3 6"), "expected 3 numbers"),
        (NEW.replace(b"$Nodes\n2 6", b"$Nodes\n1 4"), r"\$Nodes goes on where its counts say"),
        (NEW.replace(b"$Nodes\n2 6", b"$Nodes\n999999999999 6"), "expected 3 numbers"),
        (NEW.replace(b"2 21 0 4", b"2 21 0 999999999999"), "expected 999999999999 more numbers"),
        (NEW.replace(b"2 21 0 4", b"2 21 2 4"), "dimension 2 and parametric 2"),
        (NEW.replace(b"$Elements\n5 8", b"$Elements\n5 9"), "announces 9 elements, but its blocks have 8"),
        (NEW.replace(b"2 21 2 2", b"2 21 2 999999999999"), "more numbers"),
        (NEW.replace(b"$Entities\n1", b"$Entities\n-1"), "a count is negative"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_words(data: bytes, match: str) -> None:
    refused(gmsh, data, match)


@pytest.mark.parametrize("version", [b"2", b"2.0", b"2.1"])
def test_versions_before_and_words_behind_names(version: bytes) -> None:
    other = OLD.replace(b"$MeshFormat\n2.2", b"$MeshFormat\n" + version)
    assert other != OLD
    found, plain = (gmsh.read({".msh": data}) for data in (other, OLD))
    assert np.array_equal(found.points, plain.points)
    assert found.region_names == plain.region_names
    lines = [line + b" lower_dimensional_block" * (line.count(b'"') == 2) for line in OLD.split(b"\n")]
    assert gmsh.read({".msh": b"\n".join(lines)}).region_names == plain.region_names
    assert b"\n".join(lines) != OLD


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_counts_that_lie_are_refused_without_memory(order: str) -> None:
    huge = (10**12).to_bytes(8, "little" if order == "<" else "big")
    data = gmsh_variants.new(order)
    for section in (b"$Entities\n", b"$Nodes\n", b"$Elements\n"):
        for skipped in (0, 8):
            at = data.index(section) + len(section) + skipped
            refused(gmsh, data[:at] + huge + data[at + 8 :], "byte")
    data = gmsh_variants.old(order)
    for section in (b"$Nodes\n6", b"$Elements\n8"):
        refused(gmsh, data.replace(section, section[:-1] + b"999999999999"), "byte")


@given(st.data())
@settings(max_examples=250)
def test_damage_is_refused_in_words(data: st.DataObject) -> None:
    original = VARIANTS[data.draw(st.sampled_from(sorted(VARIANTS)))]
    read_or_refuse(gmsh, {".msh": data.draw(damaged(original))})


def test_conversion_keeps_cells_regions_and_names() -> None:
    for mesh in (mixed_mesh(), triangle_grid(3), triangle_grid(3, 3)):
        back, lost = check_conversion(gmsh, mesh)
        assert np.array_equal(back.points[:, : mesh.points.shape[1]], mesh.points)
        assert back.region_names == mesh.region_names
        for kind in ("triangle", "line", "quad", "vertex"):
            was = sorted(zip(regions_of(mesh, kind), cells_of(mesh, kind), strict=True))
            assert sorted(zip(regions_of(back, kind), cells_of(back, kind), strict=True)) == was
        lost = [text for text in lost if "another order" not in text]
        assert len(lost) == 2 * bool(mesh.point_data)
        assert not lost or ("'weights'" in lost[1] and "material" not in lost[1])  # materials are the physical groups


def test_regions_that_gmsh_cannot_number_get_other_numbers() -> None:
    cells = CellBlock("triangle", np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]]), np.array([-5, 2**40, 1]))
    mesh = Mesh(np.random.default_rng(1).random((5, 2)), (cells,), {(2, -5): 'the "odd"\nname'})
    back, lost = check_conversion(gmsh, mesh)
    assert len(set(regions_of(back, "triangle"))) == 3
    assert "the 'odd' name" in back.region_names.values()
    assert "-5, 1099511627776" in lost[0]


def test_cells_that_gmsh_does_not_have_are_refused() -> None:
    mesh = Mesh(np.random.default_rng(0).random((5, 3)), (CellBlock("polygon", np.arange(5)[None], np.zeros(1)),))
    with pytest.raises(FormatError, match="cannot hold cells of type 'polygon'"):
        gmsh.write(mesh)


@pytest.mark.parametrize(
    ("file", "nodes", "triangles", "lines", "names"),
    [
        ("japan_sea.msh", 8117, {1: 15441}, {100: 196, 200: 488, 300: 109}, {}),
        ("insulated.msh", 67, {1: 45, 2: 66}, {3: 21}, {(1, 3): "convection", (2, 1): "wire", (2, 2): "insulation"}),
        ("internal.msh", 158, {6: 274}, {7: 10, 8: 10, 9: 10, 10: 10, 11: 5},
         {(1, 7): "top", (1, 8): "bottom", (1, 9): "left", (1, 10): "right", (1, 11): "internal", (2, 6): "domain"}),
    ],
)  # fmt: skip
def test_real_files(
    file: str, nodes: int, triangles: dict[int, int], lines: dict[int, int], names: dict[tuple[int, int], str]
) -> None:
    folder = os.environ.get("GMSNET_MESHES")
    if not folder:
        pytest.skip("GMSNET_MESHES does not name the folder of real meshes")
    data = (Path(folder) / file).read_bytes()
    parsed = read(gmsh, data)
    assert len(parsed.points) == nodes
    for kind, expected in (("triangle", triangles), ("line", lines)):
        found = np.unique(regions_of(parsed, kind), return_counts=True)
        assert dict(zip(*map(np.ndarray.tolist, found), strict=True)) == expected
    assert parsed.region_names == names
    check_splice(gmsh, data)


@pytest.mark.parametrize(("regions", "told"), [([1, 2, 1], True), ([1, 1, 2], False), ([7, 7, 7], False)])
@pytest.mark.parametrize("suffix", [".msh", ".stl"])
def test_cells_that_get_another_order_are_told(tmp_path, suffix, regions, told):
    points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 0.0]]
    nodes = np.array([[0, 1, 2], [1, 3, 2], [1, 4, 3]])
    mesh = gmsnet.Mesh(points, [gmsnet.CellBlock("triangle", nodes, regions)])
    lost = gmsnet.write(mesh, tmp_path / f"a{suffix}")
    back = gmsnet.read(tmp_path / f"a{suffix}")
    assert any("they were put in another order" in text for text in lost) is told
    centres = [m.points[np.concatenate([b.nodes for b in m.cells]), :2].mean(axis=1) for m in (mesh, back)]
    assert np.array_equal(*centres) is not told
