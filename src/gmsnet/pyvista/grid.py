"""Meshes of files as grids of PyVista."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from gmsnet import io
from gmsnet.io import convert, vtk_cells
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.region_fields import NAMES, named_rows
from gmsnet.pyvista.library import pyvista


def grid_of(mesh: Mesh) -> Any:
    """An ``UnstructuredGrid`` with the points, cells, data and regions of a mesh.

    Regions are the cell array ``region``, unless cell data tell them apart already; their names are field data.
    Raises InputError for cells that VTK does not have.
    """
    convert.check_kinds(mesh, "VTK", vtk_cells.CODES)
    point_fields, cell_fields, _ = vtk_cells.fields_out(mesh, "VTK")
    cells = [np.insert(block.nodes, 0, block.nodes.shape[1], axis=1).ravel() for block in mesh.cells]
    nothing = np.zeros(0, dtype=np.int64)
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    made = pyvista.UnstructuredGrid(
        np.concatenate([nothing, *cells]),
        np.concatenate([nothing.astype(np.uint8), *vtk_cells.codes(mesh)]),
        points.astype(np.float32) if mesh.single else points,
    )
    for data, fields in ((made.point_data, point_fields), (made.cell_data, cell_fields)):
        for name, values in fields:
            data[name] = values[:, 0] if values.shape[1] == 1 else values
    if mesh.region_names and "region" in made.cell_data:
        made.field_data[NAMES] = named_rows(mesh.region_names)
    return made


def read(path: str | os.PathLike[str], **options: Any) -> Any:
    """The reader that PyVista calls: an ``UnstructuredGrid`` of a file. options: of ``gmsnet.read``.

    Raises FormatError as ``gmsnet.read`` does.
    """
    return grid_of(io.read(path, **options))
