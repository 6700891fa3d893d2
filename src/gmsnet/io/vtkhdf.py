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
from gmsnet.io.hdf5_rows import rows_of, stored_points
from gmsnet.io.ranges import Column, Plan
from gmsnet.io.rows import Ranges
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
    """How the numbers of a file lie; None of grids with regions by several fields, and with cells of no certain number
    of nodes."""
    with File.opened(file.path) as opened:
        root = opened.root.need("VTKHDF")
        if root.attribute("Type") != "UnstructuredGrid" or root.get("Steps") is not None:
            return None
        count, cells = _only(root, "NumberOfPoints"), _only(root, "NumberOfCells")
        place, offsets, types, listed = (root.need(key) for key in ("Points", "Offsets", "Types", "Connectivity"))
        points, nodes, codes = rows_of(place), rows_of(listed), rows_of(types)
        if points is None or nodes is None or codes is None or points.dtype[1:] not in ("f4", "f8"):
            return None
        if nodes.dtype[1] not in "iu" or codes.dtype[1] not in "iu":
            return None
        if (points.rows, points.width, nodes.width) != (count, 3, 1):
            return None
        if (offsets.shape(), types.shape()) != ((cells + 1,), (cells,)) or not cells:
            return None
        told = told_by(file, _fields_in(root.get("PointData")), _fields_in(root.get("CellData")), (count, cells))
        if told is None:
            return None
        blocks = [[each] for each in tables_of(file, codes, nodes, offsets.some, told.without_ghosts)]
        column = Column(points)
        encoded = stored_points([{place.path: column}])
        return Plan([column], blocks, points.dtype[1:] == "f4", (), told.fixed, encoded) if blocks else None


def _fields_in(group: Node | None) -> list[Field]:
    """The data of points or cells, and where they stand."""
    members = group.members() if group is not None else ()
    return [Field(node.name, rows_of(node)) for node in members if node.is_data and node.numeric()]


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
