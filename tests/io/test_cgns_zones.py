"""CGNS files of several zones, unstructured and structured: one mesh, written back zone by zone."""

from __future__ import annotations

import io
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import binary_meshes as made
from support.contracts import check_splice, read, refused
from support.damage import cells_of, damaged, read_or_refuse

import gmsnet
from gmsnet.io import cgns
from gmsnet.io.stored import ColumnSlots, SharedSlots

FILES = {
    "zones": made.cgns_zones(), "packed": made.cgns_zones(packed=True),
    "mixed": made.cgns_zones(packed=True, mixed=True), "structured": made.cgns_structured(),
    "structured, packed": made.cgns_structured(packed=True),
}  # fmt: skip


def places(parsed, kind: str) -> set[frozenset[tuple[float, ...]]]:
    """The cells of a kind by the places of their corners, whatever the numbers of the nodes."""
    return {frozenset(map(tuple, parsed.points[list(cell)].tolist())) for cell in cells_of(parsed, kind)}


def in_zones(data: bytes) -> dict[str, np.ndarray]:
    """Path of each array of coordinates → its values."""
    with h5py.File(io.BytesIO(data)) as file:
        return {
            f"{zone.name}/{axis}": grid[f"Coordinate{axis}/ data"][()]
            for zone in file["Base"].values()
            if "GridCoordinates" in zone
            for grid in [zone["GridCoordinates"]]
            for axis in "XYZ"
            if f"Coordinate{axis}" in grid
        }


@pytest.mark.parametrize("key", ["zones", "packed", "mixed"])
def test_zones_are_one_mesh(key: str) -> None:
    parsed, whole = read(cgns, FILES[key]), read(cgns, made.cgns())
    assert len(parsed.points) == len(whole.points)
    for kind in ("triangle", "quad"):
        assert places(parsed, kind) == places(whole, kind)
    assert dict(parsed.region_names) == {(2, 1): "left/tri", (2, 2): "right/tri", (2, 3): "right/quad"}
    assert {name: parsed.points[nodes].tolist() for name, nodes in parsed.node_sets.items()} == {
        "left/held": [made.POINTS[6].tolist()]
    }
    assert {"the division into 2 zones", "interfaces"} <= set(parsed.unread)
    assert isinstance(parsed.slots, ColumnSlots if key == "zones" else SharedSlots)


def test_sections_of_several_types_in_one_boundary_condition_are_one_region(tmp_path: Path) -> None:
    apart = {(2, 1): "tri", (2, 2): "quad", (1, 3): "walls"}
    joined = read(cgns, made.cgns(joined="CellCenter"))
    assert dict(joined.region_names) == {(2, 1): "body", (1, 2): "walls"}
    assert {int(region) for block in joined.cells if block.dimension == 2 for region in block.regions} == {1}
    assert dict(read(cgns, made.cgns()).region_names) == apart
    assert dict(read(cgns, made.cgns(joined="Vertex")).region_names) == apart
    assert list(dict(read(cgns, made.cgns(joined="CellCenter", split=2)).region_names).values()) == [
        "first", "tri", "quad", "walls",
    ]  # fmt: skip
    held = []
    for name, data in {"apart": made.cgns(), "joined": made.cgns(joined="CellCenter")}.items():
        (tmp_path / f"{name}.cgns").write_bytes(data)
        held.append(gmsnet.smooth(gmsnet.read(tmp_path / f"{name}.cgns")).held)
    assert "interface between regions" in held[0]
    assert "interface between regions" not in held[1]


@pytest.mark.parametrize("key", FILES)
def test_both_zones_get_the_same_coordinates(key: str) -> None:
    data = FILES[key]
    parsed, out = read(cgns, data), check_splice(cgns, data)
    assert parsed.points.dtype == np.float64
    again = read(cgns, out)
    assert len(again.points) == len(parsed.points)  # those that were one node still are
    assert [block.nodes.tolist() for block in again.cells] == [block.nodes.tolist() for block in parsed.cells]
    old, new = in_zones(data), in_zones(out)
    assert old.keys() == new.keys()
    assert {path: (each.shape, each.dtype) for path, each in old.items()} == {
        path: (each.shape, each.dtype) for path, each in new.items()
    }


@pytest.mark.parametrize("left_handed", [False, True])
def test_structured_zones_are_hexahedra(left_handed: bool) -> None:
    parsed = read(cgns, made.cgns_structured(left_handed=left_handed))
    assert len(parsed.points) == 7 * 4 * 4
    cells = np.concatenate([block.nodes for block in parsed.cells if block.kind == "hexahedron"])
    assert len(cells) == 54
    steps = parsed.points[cells[:, [1, 3, 4]]] - parsed.points[cells[:, :1]]
    assert (np.linalg.det(steps) > 0).all()
    spread = np.ptp(parsed.points[cells], axis=1)
    assert spread.max() < 0.6
    assert dict(parsed.region_names) == {(3, 1): "inflow", (3, 2): "outflow"}


def test_structured_zones_are_smoothed(tmp_path: Path) -> None:
    path = tmp_path / "a.cgns"
    path.write_bytes(FILES["structured"])
    result = gmsnet.smooth(gmsnet.read(path))
    assert result.moved.sum() == 2 * 2**3  # those between the zones and of the boundary stay
    assert result.after.inverted == 0
    assert gmsnet.write(result.mesh, path) == []
    assert gmsnet.read(path).points.tolist() == result.points.tolist()


def test_a_planar_structured_zone() -> None:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        base = made._node(file, "Base", "CGNSBase_t", np.array([2, 2], np.int32))
        points = np.stack(np.meshgrid(np.arange(3.0), np.arange(4.0)), axis=-1)
        made._zone(base, "plate", points, "Structured", [[3, 4], [2, 3], [0, 0]])
    parsed = read(cgns, stream.getvalue())
    assert sorted(map(sorted, cells_of(parsed, "quad"))) == sorted(
        [i + 3 * j, i + 1 + 3 * j, i + 3 * j + 3, i + 3 * j + 4] for i in range(2) for j in range(3)
    )
    check_splice(cgns, stream.getvalue())


def changed(data: bytes, change) -> bytes:
    stream = io.BytesIO(data)
    with h5py.File(stream, "r+") as file:
        change(file)
    return stream.getvalue()


def test_errors() -> None:
    def shorter(file: h5py.File) -> None:
        file["Base/outflow/ data"][0, 0] = 5

    refused(cgns, changed(FILES["structured"], shorter), "/Base/outflow: 64 points are no grid of two or three axes")

    def linked(file: h5py.File) -> None:
        del file["Base/left/GridCoordinates/CoordinateX/ data"]
        file["Base/left/GridCoordinates/CoordinateX/ data"] = file["Base/right/GridCoordinates/CoordinateX/ data"]

    refused(cgns, changed(FILES["zones"], linked), "share an array of coordinates")

    def flat(file: h5py.File) -> None:
        made._zone(file["Base"], "more", np.zeros((2, 2, 3)), "Structured", [[2, 2], [1, 1], [0, 0]])

    refused(cgns, changed(FILES["zones"], flat), "some zones have two axes of coordinates, others three")

    def bare(file: h5py.File) -> None:
        for name in ("left/tri", "right/tri", "right/quad"):
            del file[f"Base/{name}"]

    refused(cgns, changed(FILES["zones"], bare), "no zone has cells")

    def none(file: h5py.File) -> None:
        del file["Base/left"], file["Base/right"]

    refused(cgns, changed(FILES["zones"], none), "the file has no zones")


@pytest.mark.parametrize("key", FILES)
@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_damage(key: str, data: st.DataObject) -> None:
    read_or_refuse(cgns, {".cgns": data.draw(damaged(FILES[key]))})


@pytest.mark.parametrize("key", ["zones", "structured"])
def test_vtk_reads_what_is_written(key: str, tmp_path: Path) -> None:
    module = pytest.importorskip("vtkmodules.vtkIOCGNSReader")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    path, out = tmp_path / "a.cgns", tmp_path / "b.cgns"
    path.write_bytes(FILES[key])
    mesh = gmsnet.read(path)
    gmsnet.write(mesh.with_points(mesh.points * 1.5), out)
    reader = module.vtkCGNSReader()
    reader.SetFileName(str(out))
    reader.UpdateInformation()
    reader.EnableAllBases()
    reader.Update()
    found, base = set(), reader.GetOutput().GetBlock(0)
    for k in range(base.GetNumberOfBlocks()):
        found |= set(map(tuple, vtk_to_numpy(base.GetBlock(k).GetPoints().GetData()).tolist()))
    new = np.zeros((len(mesh.points), 3))
    new[:, : mesh.points.shape[1]] = mesh.points * 1.5
    assert found == set(map(tuple, new.tolist()))


GRID = {
    "vertices": ([[1, 1, 1], [4, 1, 4]], "", lambda at: at[:, 1] == 0),
    "three": ([[2, 3, 4], [2, 2, 2], [1, 1, 1]], "Vertex", lambda at: np.isin(at @ [1, 10, 100], [321, 111, 0])),
    "faces of i": ([[4, 1, 1], [4, 3, 3]], "IFaceCenter", lambda at: at[:, 0] == 3),
    "a face of j": ([[2, 1, 2]], "JFaceCenter", lambda at: (at[:, 1] == 0) & np.all((at[:, ::2] % 3) > 0, axis=1)),
    "faces": ([[1, 1, 4], [3, 2, 4]], "FaceCenter", lambda at: (at[:, 2] == 3) & (at[:, 1] < 3)),
    "cells": ([[1, 1, 1], [3, 3, 3]], "CellCenter", lambda at: at[:, 0] >= 0),
    "outside": ([[1, 1, 1], [5, 1, 4]], "", lambda at: at[:, 0] < 0),
    "unclear": ([[1, 1, 1], [3, 3, 3]], "FaceCenter", lambda at: at[:, 0] < 0),
}


@pytest.mark.parametrize("key", GRID)
def test_boundary_conditions_of_a_grid_are_node_sets(key: str) -> None:
    points, where, chosen = GRID[key]
    data = made.with_conditions(made.cgns_structured(), {"inflow": [(key, points, where, "Base/family")]})
    parsed = read(cgns, data)
    # Points of the grid have their index along i in their first coordinate, but for those inside, which are thrown.
    at = np.rint(3.0 * parsed.points).astype(np.int64)
    wanted = np.flatnonzero(chosen(at) & (at[:, 2] <= 3))
    if not len(wanted):
        assert not parsed.node_sets
        return
    assert {name: nodes.tolist() for name, nodes in parsed.node_sets.items()} == {
        key: wanted.tolist(), "family": wanted.tolist()
    }  # fmt: skip


def test_a_family_is_of_all_zones() -> None:
    told = {
        "left": [("seal", [[1], [2]], "Vertex", "WALL")],
        "right": [("WALL", [[1], [3], [2]], "Vertex", "WALL")],
    }
    parsed = read(cgns, made.with_conditions(made.cgns_zones(), told))
    sets = {name: set(map(tuple, parsed.points[nodes].tolist())) for name, nodes in parsed.node_sets.items()}
    assert {*sets} == {"left/held", "left/seal", "right/WALL", "WALL"}
    assert sets["WALL"] == sets["left/seal"] | sets["right/WALL"]
    assert [len(sets[name]) for name in ("left/seal", "right/WALL")] == [2, 3]


def test_one_name_in_two_zones_is_one_set() -> None:
    wall = ("wall", [[1, 1, 1], [4, 4, 1]])
    parsed = read(cgns, made.with_conditions(made.cgns_structured(), {"inflow": [wall], "outflow": [wall]}))
    assert {name: len(nodes) for name, nodes in parsed.node_sets.items()} == {"wall": 32}
    assert set(parsed.points[parsed.node_sets["wall"], 2].tolist()) == {0.0, 1.0}


ELEMENTS = {
    "quads": ([[7], [7]], "CellCenter", made.QUADS),
    "lines": ([[8], [9]], "EdgeCenter", made.LINES),
    "some triangles": ([[2], [4], [2]], "CellCenter", made.TRIANGLES[[1, 3]]),
    "a range of points": ([[2], [5]], "Vertex", np.arange(1, 5)),
}


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("key", ELEMENTS)
def test_boundary_conditions_of_elements_are_node_sets(key: str, mixed: bool) -> None:
    points, where, wanted = ELEMENTS[key]
    parsed = read(cgns, made.with_conditions(made.cgns(mixed=mixed), {"blk-1": [(key, points, where)]}))
    # A section of several types does not tell which of its elements are the second to the fourth.
    told = not (mixed and where == "CellCenter")
    assert {name: nodes.tolist() for name, nodes in parsed.node_sets.items()} == (
        {"held": [6]} | ({key: np.unique(wanted).tolist()} if told else {})
    )


def test_a_name_of_a_boundary_condition_holds_its_nodes(tmp_path: Path) -> None:
    inside = [[2, 2, 2], [3, 3, 3], [2, 3, 2]]
    data = made.with_conditions(made.cgns_structured(), {"inflow": [("probe", inside)]})
    (tmp_path / "a.cgns").write_bytes(data)
    mesh = gmsnet.read(tmp_path / "a.cgns")
    moved = np.any(gmsnet.smooth(mesh).points != mesh.points, axis=1)
    held = np.any(gmsnet.smooth(mesh, fixed=mesh.markers["probe"]).points != mesh.points, axis=1)
    assert len(mesh.markers["probe"]) == 3
    assert moved[mesh.markers["probe"]].all()
    assert not held[mesh.markers["probe"]].any()
