"""VTK's files in HDF5 (``.vtkhdf``, needs h5py): unstructured grids of one piece and one time step.

Only the points are written again.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import vtk_cells
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.hdf5 import File, Node, shown
from gmsnet.io.ranges import Column, Plan, Ranges, Rows
from gmsnet.io.stored import Part, coordinates
from gmsnet.io.vtk_runs import Field, tables_of, told_by
from gmsnet.mesh.mesh import Mesh

name = "VTKHDF"
suffixes: tuple[str, ...] = (".vtkhdf",)


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".vtkhdf"]
    file = File(data)
    root = file.root.need("VTKHDF")
    kind = root.attribute("Type")
    if kind != "UnstructuredGrid":
        raise FormatError(f"a VTKHDF file of type {str(kind)[:24]!r} is not read: write it as an UnstructuredGrid")
    if root.get("Steps") is not None:
        raise FormatError("the file has time steps: write one of them into a file of its own")
    count, cells = _only(root, "NumberOfPoints"), _only(root, "NumberOfCells")
    place = root.need("Points")
    if place.shape() != (count, 3):
        raise FormatError(f"{shown(place.path)}: the shape {place.shape()} instead of ({count}, 3)")
    points, slots, single = coordinates([Part(place, (0, 1, 2))], data)
    offsets, types, nodes = (root.need(key).integers().reshape(-1) for key in ("Offsets", "Types", "Connectivity"))
    sizes = np.diff(offsets)
    if len(types) != cells or len(sizes) != cells or (sizes < 0).any() or int(sizes.sum()) != len(nodes):
        raise FormatError("Offsets, Types and Connectivity do not fit the number of cells")

    def blame(index: int, message: str) -> NoReturn:
        raise FormatError(f"/VTKHDF/Connectivity: {message} (counted from 0)")

    unread: list[str] = []
    fields = [_fields(root.get(key), of, unread) for key, of in (("PointData", count), ("CellData", cells))]
    unread += ["fields of the whole grid"] * (root.get("FieldData") is not None)
    return vtk_cells.parsed(points, slots, single, types, sizes, nodes, fields[0], fields[1], blame, unread)


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a file lie; None where they are compressed or in chunks, and of grids with ghost cells, with
    regions by several fields, with cells of no certain number of nodes, or whose types alternate often."""
    with File.opened(file.path) as opened:
        root = opened.root.need("VTKHDF")
        if root.attribute("Type") != "UnstructuredGrid" or root.get("Steps") is not None:
            return None
        count, cells = _only(root, "NumberOfPoints"), _only(root, "NumberOfCells")
        points, offsets, types, nodes = (root.need(key) for key in ("Points", "Offsets", "Types", "Connectivity"))
        fields = [_in_rows(root.get(key)) for key in ("PointData", "CellData")]
        elsewhere = any(each.is_elsewhere() for each in (points, offsets, types, nodes))
        begin, at = points.offset(), nodes.offset()
        whole = [each.shape() for each in (points, offsets, types, nodes)]
        if elsewhere or begin is None or at is None or whole[:3] != [(count, 3), (cells + 1,), (cells,)] or not cells:
            return None
        told = told_by(file, fields[0], fields[1], (count, cells))
        real = points.dtype()
        if told is None or real[1:] not in ("f4", "f8") or nodes.dtype()[1] not in "iu":
            return None
        listed = Rows(at, whole[3][0], 0, nodes.dtype())
        tables = tables_of(types.some, cells, whole[3][0], listed, offsets.some, told.regions)
        place = Rows(begin, count, 3 * int(real[2:]), real, 3)
        blocks = [[table] for table in tables]
        return Plan([Column(place)], blocks, real[1:] == "f4", fixed=told.fixed) if tables else None


def _in_rows(group: Node | None) -> list[Field]:
    """The data of points or cells, and where they stand."""
    found = []
    for node in group.members() if group is not None else ():
        if node.is_data and node.numeric():
            begin, shape = node.offset(), node.shape()
            width = 1 if len(shape) == 1 else shape[-1]
            size = int(node.dtype()[2:]) * width
            there = begin is not None and len(shape) in (1, 2) and not node.is_elsewhere()
            found.append(Field(node.name, Rows(begin or 0, shape[0], size, node.dtype(), width) if there else None))
    return found


def _only(root: Node, key: str) -> int:
    found = root.need(key).integers().reshape(-1)
    if len(found) != 1 or found[0] < 0:
        raise FormatError(f"{shown(f'{root.path}/{key}')}: {len(found)} pieces: only grids of one are smoothed")
    return int(found[0])


def _fields(group: Node | None, count: int, unread: list[str]) -> list[tuple[str, NDArray[Any]]]:
    """The data of points or cells; those of no numbers are named in ``unread``."""
    found = []
    for node in group.members() if group is not None else ():
        if not node.is_data or not node.numeric():
            unread.append(f"the texts {node.name[:40]!r}")
            continue
        values = node.array("iuf")
        if values.ndim not in (1, 2) or len(values) != count:
            raise FormatError(f"{shown(node.path)}: the shape {values.shape} does not fit {count} rows")
        found.append((node.name, values.astype(values.dtype.newbyteorder("="))))
    return found


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
