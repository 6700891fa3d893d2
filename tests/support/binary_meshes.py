"""Meshes in HDF5 and netCDF as the programs that own the formats lay them out, made by h5py and SciPy."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import h5py
import numpy as np
from scipy.io import netcdf_file

# Two triangles and a quadrilateral around two inner nodes, a line each at the left and at the right.
POINTS = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [1, 1], [0, 1], [0.4, 0.5], [1.6, 0.4]])
TRIANGLES = np.array([[0, 1, 6], [1, 4, 6], [4, 5, 6], [5, 0, 6], [1, 2, 7], [2, 3, 7]])
QUADS = np.array([[1, 7, 3, 4]])
LINES = np.array([[5, 0], [2, 3]])
GZIP: dict[str, Any] = {"chunks": True, "compression": "gzip", "shuffle": True}


def _file(fill: Callable[[h5py.File], None], **options: Any) -> bytes:
    stream = io.BytesIO()
    with h5py.File(stream, "w", libver=("v110", "v110"), **options) as file:
        fill(file)
    return stream.getvalue()


def _node(parent: h5py.Group, name: str, label: str, data: Any = None, **more: Any) -> h5py.Group:
    """A node of CGNS."""
    made = parent.create_group(name)
    kinds = {"i1": "C1", "i4": "I4", "f4": "R4", "f8": "R8"}
    kind = "MT" if data is None else kinds[np.asarray(data).dtype.str[1:]]
    for key, text, size in (("name", name, 33), ("label", label, 33), ("type", kind, 3)):
        made.attrs[key] = np.array(text.encode(), f"S{size}")
    if data is not None:
        made.create_dataset(" data", data=data, **more)
    return made


def _letters(text: str) -> np.ndarray:
    return np.frombuffer(text.encode(), np.int8)


def _zone(base: h5py.Group, name: str, points: np.ndarray, kind: str, sizes: Any, **how: Any) -> h5py.Group:
    """A zone with its coordinates, (…, axes) as the file lists them."""
    zone = _node(base, name, "Zone_t", np.array(sizes, np.int32))
    _node(zone, "ZoneType", "ZoneType_t", _letters(kind))
    grid = _node(zone, "GridCoordinates", "GridCoordinates_t")
    for axis in range(points.shape[-1]):
        _node(grid, f"Coordinate{'XYZ'[axis]}", "DataArray_t", np.ascontiguousarray(points[..., axis]), **how)
    return zone


def _elements(zone: h5py.Group, sections: Any) -> None:
    """sections: name, type, cells or a list of types and nodes, and how many there are."""
    at = 1
    for name, code, cells, count in sections:
        made = _node(zone, name, "Elements_t", np.array([code, 0], np.int32))
        _node(made, "ElementRange", "IndexRange_t", np.array([at, at + count - 1], np.int32))
        _node(made, "ElementConnectivity", "DataArray_t", (np.ravel(cells) + 1).astype(np.int32))
        at += count


def cgns(
    packed: bool = False, kind: type = np.float64, mixed: bool = False, split: int = 0, joined: str = ""
) -> bytes:  # fmt: skip
    """One zone with a section of each type, or with one of them all.

    split: so many triangles are a section by themselves. joined: where a boundary condition has all faces as a range.
    """

    def fill(file: h5py.File) -> None:
        base = _node(file, "Base", "CGNSBase_t", np.array([2, 2], np.int32))
        how = GZIP if packed else {}
        zone = _zone(base, "blk-1", POINTS.astype(kind), "Unstructured", [[8], [7], [0]], **how)
        sections: list[Any] = [("tri", 5, TRIANGLES, 6), ("quad", 7, QUADS, 1), ("walls", 3, LINES, 2)]
        if mixed:
            rows = [np.array([code - 1, *row]) for _, code, cells, _ in sections[:2] for row in cells.tolist()]
            sections = [("all", 20, np.concatenate(rows), 7), sections[2]]
        if split:
            parts = ("first", 5, TRIANGLES[:split], split), ("tri", 5, TRIANGLES[split:], 6 - split)
            sections[:1] = parts
        _elements(zone, sections)
        condition(zone, "held", [[7]])
        if joined:
            condition(zone, "body", [[1], [7]], joined)
        _node(zone, "FlowSolution", "FlowSolution_t")

    return _file(fill)


def cgns_zones(packed: bool = False, mixed: bool = False) -> bytes:
    """The same mesh in two zones: the triangles of the left, and all other cells, whose points are in another order.

    mixed: one zone is compressed, the other is not.
    """
    left = np.array([0, 1, 4, 5, 6])
    right = np.array([7, 4, 3, 2, 1])

    def fill(file: h5py.File) -> None:
        base = _node(file, "Base", "CGNSBase_t", np.array([2, 2], np.int32))
        how = GZIP if packed else {}
        zone = _zone(base, "right", POINTS[right], "Unstructured", [[5], [3], [0]], **how)
        own = np.argsort(right)
        place = {int(right[k]): int(k) for k in own}
        local = np.vectorize(place.__getitem__)
        _elements(zone, [("tri", 5, local(TRIANGLES[4:]), 2), ("quad", 7, local(QUADS), 1)])
        _node(zone, "ZoneGridConnectivity", "ZoneGridConnectivity_t")
        zone = _zone(base, "left", POINTS[left], "Unstructured", [[5], [4], [0]], **({} if mixed else how))
        _elements(zone, [("tri", 5, np.searchsorted(left, TRIANGLES[:4]), 4)])
        condition(zone, "held", [[5]])

    return _file(fill)


def grid(size: int, left_handed: bool = False) -> np.ndarray:
    """(size, size, size, 3) points of a grid as CGNS lists them: along i first, thrown a little inside."""
    places = np.stack(np.meshgrid(*[np.arange(size) / (size - 1)] * 3, indexing="ij"), axis=-1)[..., ::-1].copy()
    inside = places[1:-1, 1:-1, 1:-1]
    inside += np.random.default_rng(0).uniform(-0.1, 0.1, inside.shape)
    return places[..., [1, 0, 2]] if left_handed else places


def condition(zone: h5py.Group, called: str, points: list[list[int]], where: str = "", family: str = "") -> None:
    """A boundary condition of a list of points, or of a range of two. where: in the grid they are. family: its name."""
    group = zone["ZoneBC"] if "ZoneBC" in zone else _node(zone, "ZoneBC", "ZoneBC_t")
    made = _node(group, called, "BC_t", _letters("FamilySpecified" if family else "BCWall"))
    name, label = ("PointRange", "IndexRange_t") if len(points) == 2 else ("PointList", "IndexArray_t")
    _node(made, name, label, np.array(points, np.int32))
    if where:
        _node(made, "GridLocation", "GridLocation_t", _letters(where))
    if family:
        _node(made, "FamilyName", "FamilyName_t", _letters(family))


def with_conditions(data: bytes, told: dict[str, list[tuple[Any, ...]]]) -> bytes:
    """A CGNS file with boundary conditions. told: the name of a zone → name, points and what ``condition`` takes."""
    memory = io.BytesIO(data)
    with h5py.File(memory, "r+") as file:
        for zone, each in told.items():
            for some in each:
                condition(file["Base"][zone], *some)
    return memory.getvalue()


def cgns_structured(packed: bool = False, left_handed: bool = False) -> bytes:
    """Two blocks of a grid side by side."""
    places = grid(4, left_handed)

    def fill(file: h5py.File) -> None:
        base = _node(file, "Base", "CGNSBase_t", np.array([3, 3], np.int32))
        for k, name in enumerate(("inflow", "outflow")):
            sizes = [[4] * 3, [3] * 3, [0] * 3]
            _zone(base, name, places + np.array([0, 0, k]), "Structured", sizes, **(GZIP if packed else {}))

    return _file(fill)


def med(packed: bool = False) -> bytes:
    """Families of cells and nodes, with groups."""
    how = GZIP if packed else {}

    def fill(file: h5py.File) -> None:
        step = _med_step(file, "plate", 2)
        step.create_dataset("NOE/COO", data=POINTS.T.ravel(), **how)
        step.create_dataset("NOE/FAM", data=np.array([0, 0, 0, 0, 0, 0, 3, 0]))
        cells = (("TR3", TRIANGLES, [-1] * 4 + [-2] * 2), ("QU4", QUADS, [-2]), ("SE2", LINES, [-5, -5]))
        step["NOE/COO"].attrs["NBR"] = len(POINTS)
        for name, rows, families in cells:
            step.create_dataset(f"MAI/{name}/NOD", data=rows.T.ravel() + 1)
            step[f"MAI/{name}/NOD"].attrs["NBR"] = len(rows)
            step.create_dataset(f"MAI/{name}/FAM", data=np.array(families))
        for part, number, text in (("ELEME", -1, "steel"), ("ELEME", -5, "wall"), ("NOEUD", 3, "sensor")):
            family = file.create_group(f"FAS/plate/{part}/FAM_{number}_{text}")
            family.attrs["NUM"] = number
            names = np.zeros((1, 80), np.int8)
            names[0, : len(text)] = np.frombuffer(text.encode(), np.int8)
            one = number < -1  # values that are 80 letters each, as MED's own library writes them, or rows of letters
            kind = np.dtype((np.int8, 80)) if one else np.int8
            family.create_dataset("GRO/NOM", (1,) if one else (1, 80), kind)[...] = names
            family["GRO"].attrs["NBR"] = 1

    return _file(fill)


def _med_step(file: h5py.File, name: str, dimension: int) -> h5py.Group:
    """What holds the nodes and cells of a mesh in MED."""
    mesh = file.create_group(f"ENS_MAA/{name}")
    mesh.attrs["ESP"], mesh.attrs["DIM"] = dimension, dimension
    return mesh.create_group("-0000000000000000001-0000000000000000001")


def med27() -> bytes:
    """The cube of side 2 as one hexahedron of 27 nodes, which MED lists from the bottom to the top."""
    corners = np.array([(x, y, z) for z in (0, 2) for x, y in ((0, 0), (2, 0), (2, 2), (0, 2))], dtype=float)
    edges = [(k, (k + 1) % 4) for k in range(4)]
    edges += [(a + 4, b + 4) for a, b in edges] + [(k, k + 4) for k in range(4)]
    faces = [(0, 1, 2, 3), *((k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4) for k in range(4)), (4, 5, 6, 7), tuple(range(8))]
    points = np.concatenate([corners, *(corners[list(each)].mean(axis=0)[None] for each in (*edges, *faces))])

    def fill(file: h5py.File) -> None:
        step = _med_step(file, "cube", 3)
        step.create_dataset("NOE/COO", data=points.T.ravel())
        step.create_dataset("MAI/H27/NOD", data=np.arange(27) + 1)

    return _file(fill)


def vtkhdf(packed: bool = False, kind: type = np.float64) -> bytes:
    """An unstructured grid of one piece."""
    how = GZIP if packed else {}

    def fill(file: h5py.File) -> None:
        root = file.create_group("VTKHDF")
        root.attrs["Version"], root.attrs["Type"] = [1, 0], np.bytes_("UnstructuredGrid")
        nodes = np.concatenate([TRIANGLES.ravel(), QUADS.ravel()])
        for name, value in (("Points", 8), ("Cells", 7), ("ConnectivityIds", len(nodes))):
            root.create_dataset(f"NumberOf{name}", data=[value])
        root.create_dataset("Points", data=np.pad(POINTS, ((0, 0), (0, 1))).astype(kind), **how)
        root.create_dataset("Connectivity", data=nodes)
        root.create_dataset("Offsets", data=np.cumsum([0] + [3] * 6 + [4]))
        root.create_dataset("Types", data=np.array([5] * 6 + [9], np.uint8))
        root.create_dataset("PointData/heat", data=np.arange(8.0))
        root.create_dataset("CellData/material", data=np.array([1, 1, 1, 1, 2, 2, 2]))

    return _file(fill)


def exodus4(packed: bool = False) -> bytes:
    """Exodus in netCDF-4, as far as h5py alone makes it."""
    how = GZIP if packed else {}

    def fill(file: h5py.File) -> None:
        for axis in range(2):
            file.create_dataset(f"coord{'xy'[axis]}", data=POINTS[:, axis], **how)
        for k, (kind, cells) in enumerate((("TRI3", TRIANGLES), ("QUAD4", QUADS)), 1):
            made = file.create_dataset(f"connect{k}", data=(cells + 1).astype(np.int32))
            made.attrs["elem_type"] = np.bytes_(kind)
        file.create_dataset("eb_prop1", data=np.array([10, 20], np.int32))
        file.create_dataset("elem_ss1", data=np.array([4, 6], np.int32))
        file.create_dataset("side_ss1", data=np.array([1, 1], np.int32))
        file.create_dataset("node_ns1", data=np.array([7], np.int32))

    return _file(fill)


def exodus3(version: int = 2, whole: bool = False) -> bytes:
    """Exodus in the classic form. whole: all coordinates in one variable."""
    stream = io.BytesIO()
    file = netcdf_file(stream, "w", version=version)
    for name, size in (("time_step", None), ("num_nodes", 8),
                       ("num_dim", 2), ("num_el_blk", 2), ("len_name", 33), ("num_el_in_blk1", 6),
                       ("num_nod_per_el1", 3), ("num_el_in_blk2", 1), ("num_nod_per_el2", 4), ("num_side_ss1", 2),
                       ("num_nod_ns1", 1)):  # fmt: skip
        file.createDimension(name, size)

    def variable(name: str, kind: str, dimensions: tuple[str, ...], values: Any, **attributes: str) -> None:
        made = file.createVariable(name, kind, dimensions)
        made[:] = values
        for key, value in attributes.items():
            setattr(made, key, value)

    if whole:
        variable("coord", "d", ("num_dim", "num_nodes"), POINTS.T)
    else:
        variable("coordx", "d", ("num_nodes",), POINTS[:, 0])
        variable("coordy", "d", ("num_nodes",), POINTS[:, 1])
    variable("connect1", "i", ("num_el_in_blk1", "num_nod_per_el1"), TRIANGLES + 1, elem_type="TRI3")
    variable("connect2", "i", ("num_el_in_blk2", "num_nod_per_el2"), QUADS + 1, elem_type="QUAD")
    variable("eb_prop1", "i", ("num_el_blk",), [10, 20])
    names = np.zeros((2, 33), "S1")
    names[0, :5] = list("steel")
    variable("eb_names", "c", ("num_el_blk", "len_name"), names)
    variable("elem_ss1", "i", ("num_side_ss1",), [4, 6])
    variable("side_ss1", "i", ("num_side_ss1",), [1, 1])
    variable("node_ns1", "i", ("num_nod_ns1",), [7])
    variable("time_whole", "d", ("time_step",), [0.5])
    file.flush()
    return stream.getvalue()


XDMF = """<?xml version="1.0"?>
<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>
<Xdmf Version="3.0"><Domain><Grid Name="mesh" GridType="Uniform">
<Geometry GeometryType="XY"><DataItem Dimensions="8 2" NumberType="Float" Precision="8" Format="{how}">
{points}</DataItem></Geometry>
<!-- the cells -->
<Topology TopologyType="Mixed" NumberOfElements="7"><DataItem Dimensions="{count}" NumberType="Int" Format="{how}">
{cells}</DataItem></Topology>
<Attribute Name="material" Center="Cell"><DataItem Dimensions="7" NumberType="Int" Format="XML">1 1 1 1 2 2 2</DataItem>
</Attribute></Grid></Domain></Xdmf>
"""


def xdmf_topology() -> np.ndarray:
    """The list of mixed types."""
    return np.concatenate([np.ravel([[4, *row] for row in TRIANGLES.tolist()]), [5, *QUADS[0].tolist()]])


def xdmf(inside: bool = True) -> bytes:
    """The XML, with the numbers inside or in mesh.h5."""
    cells = xdmf_topology()
    texts = {
        "points": "\n".join(" ".join(map(str, row)) for row in POINTS.tolist()) if inside else "mesh.h5:/points",
        "cells": " ".join(map(str, cells.tolist())) if inside else "mesh.h5:/cells",
    }
    return XDMF.format(how="XML" if inside else "HDF", count=len(cells), **texts).encode()


def xdmf_h5(packed: bool = False) -> bytes:
    """The file beside it."""

    def fill(file: h5py.File) -> None:
        file.create_dataset("points", data=POINTS, **(GZIP if packed else {}))
        file.create_dataset("cells", data=xdmf_topology())

    return _file(fill)
