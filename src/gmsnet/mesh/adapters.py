"""Arrays and other libraries' objects as a Mesh, and back: the type that came in goes out.

Types are told by the names of their modules, so none of the libraries is imported here.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.array_forms import (
    Restore,
    dimension_of,
    face,
    from_mapping,
    from_pair,
    in_precision_of,
    indices,
    members,
)
from gmsnet.mesh.arrays import coordinates
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.fem import from_dolfinx, from_meshkernel, from_netgen, from_plex, from_sfepy
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.region_fields import NAMES, combined, names_a_region, names_of_rows
from gmsnet.mesh.triangulations import from_delaunay, from_skfem, from_triangulation
from gmsnet.mesh.vtk_types import POLYLINE, POLYVERTEX, STRIP, VTK_KINDS, VTK_ORDERS

NOWHERE = np.zeros((), dtype=np.int64)  # the region of cells without any, once for all of them
NOWHERE.flags.writeable = False
FEM = (
    ("dolfinx", "Mesh", from_dolfinx), ("petsc4py", "DMPlex", from_plex), ("sfepy", "Mesh", from_sfepy),
    ("netgen", "Mesh", from_netgen), ("meshkernel", "Mesh2d", from_meshkernel),
)  # fmt: skip
VTK_CHAINS = {POLYVERTEX: ("vertex", 1), POLYLINE: ("line", 2)}  # of any number of nodes, taken as their pieces


def to_mesh(thing: Any) -> tuple[Mesh, Restore]:
    """A mesh in whatever form it came, and the way back.

    thing: a Mesh; ``(points, cells)`` arrays or a mapping ``{"points": …, "cells": …, "regions": …, "markers": …}``
    (see ``mesh_from_arrays``); a ``Mesh`` of meshio or meshlane; an ``UnstructuredGrid`` or ``PolyData`` of PyVista; a
    ``MeshTri``, ``MeshQuad``, ``MeshTet`` or ``MeshHex`` of scikit-fem; a ``Triangulation`` of Matplotlib; a
    ``Delaunay`` of SciPy; a ``Mesh`` of sfepy, Netgen or dolfinx; a ``DMPlex`` of PETSc; a ``Mesh2d`` of MeshKernel.
    Points in single precision give a Mesh with ``single`` set.

    restore(points): points (N×dim, float64) → the type that came in, with these coordinates and all else equal. The
    thing itself is never changed. Points come back as float64, or as float32 where they were float32. A ``Delaunay``
    comes back as (points, simplices): triangles that were smoothed are no Delaunay triangulation of their points. So do
    meshes of dolfinx and PETSc, which cannot be copied.

    Raises InputError where the thing is none of these, or its arrays do not describe a mesh.
    """
    if isinstance(thing, Mesh):
        return thing, thing.with_points
    names = {(base.__module__.partition(".")[0], base.__name__) for base in type(thing).__mro__}
    if names & {("meshio", "Mesh"), ("meshlane", "Mesh")}:
        return _from_meshio(thing)
    if names & {("pyvista", "UnstructuredGrid"), ("pyvista", "PolyData")}:
        return _from_pyvista(thing)
    libraries = {library for library, _ in names}
    if "skfem" in libraries:
        return from_skfem(thing)
    if ("matplotlib", "Triangulation") in names:
        return from_triangulation(thing)
    if ("scipy", "Delaunay") in names:
        return from_delaunay(thing)
    for library, called, convert in FEM:
        if (library, called) in names:
            return convert(thing)
    if isinstance(thing, Mapping):
        return from_mapping(thing)
    if isinstance(thing, (tuple, list)) and len(thing) == 2:
        return from_pair(thing)
    if "pyvista" in libraries:
        mend = "call its .cast_to_unstructured_grid() first (or .combine(), where it holds several blocks)"
    elif "ngsolve" in libraries:
        mend = "give its .ngmesh"
    elif "vtkmodules" in libraries:
        mend = "wrap it with pyvista.wrap() first"
    elif isinstance(thing, str) or hasattr(thing, "__fspath__"):
        mend = "read the file first, with gmsnet.read()"
    else:
        mend = "give (points, cells) arrays, or a mesh of gmsnet, meshio, meshlane, PyVista, scikit-fem or Matplotlib"
    raise InputError(f"{type(thing).__module__}.{type(thing).__qualname__} is not a mesh that gmsnet knows: {mend}")


def _from_meshio(thing: Any) -> tuple[Mesh, Restore]:
    blocks: list[tuple[str, NDArray[np.int64]]] = []
    for block in thing.cells:
        blocks += _even(block.type, block.data)
    cell_data = {
        name: np.concatenate([np.asarray(array) for array in arrays])
        for name, arrays in thing.cell_data.items()
        if arrays and not any(array is None for array in arrays)
    }
    names = {
        (int(np.ravel(value)[1]), int(np.ravel(value)[0])): name  # meshio keeps (tag, dimension)
        for name, value in (thing.field_data or {}).items()
        if np.size(value) == 2 and np.asarray(value).dtype.kind in "iu"
    }
    start = np.cumsum([0, *(len(block.data) for block in thing.cells)])
    sets = {
        name: np.concatenate(
            [
                members(ids, len(block.data), f"set {name!r}") + at
                for ids, block, at in zip(per_block, thing.cells, start, strict=False)
            ]
            or [np.zeros(0, dtype=np.int64)]
        )
        for name, per_block in (thing.cell_sets or {}).items()
        if not name.startswith("gmsh:")  # meshio keeps other things of Gmsh under such names
    }
    node_sets = {
        name: members(ids, len(thing.points), f"set {name!r}") for name, ids in (thing.point_sets or {}).items()
    }
    mesh = _mesh(thing.points, blocks, cell_data, thing.point_data, names, sets, node_sets)
    return mesh, _refill(lambda: copy.deepcopy(thing), thing.points)


def _from_pyvista(thing: Any) -> tuple[Mesh, Restore]:
    # A PolyData as a grid has its cells in the same order: vertices, lines, faces, strips.
    grid = thing if hasattr(thing, "celltypes") else thing.cast_to_unstructured_grid()
    # Older releases of PyVista call the same array "offset".
    offsets = np.asarray(grid.cell_offsets if hasattr(type(grid), "cell_offsets") else grid.offset)
    names = names_of_rows(np.ravel(thing.field_data[NAMES])) if NAMES in thing.field_data else {}
    points = np.asarray(thing.points)
    mesh = mesh_of_vtk(
        points, np.asarray(grid.celltypes), offsets, np.asarray(grid.cell_connectivity), thing.cell_data,
        thing.point_data, names,
    )  # fmt: skip
    return mesh, _refill(lambda: thing.copy(deep=True), points)


def mesh_of_vtk(
    points: NDArray[Any],
    types: NDArray[Any],
    offsets: NDArray[Any],
    connectivity: NDArray[Any],
    cell_fields: Mapping[str, Any],
    point_fields: Mapping[str, Any],
    names: Mapping[tuple[int, int], str] | None = None,
) -> Mesh:
    """Of VTK's arrays: types (n,), offsets (n + 1,) into connectivity, and data of cells and points by name.

    names: (dimension, number) → the name of the regions of that number in the cell field "region".
    """
    sizes, connectivity = np.diff(offsets), connectivity.astype(np.int64, copy=False)
    change = (np.diff(types) != 0) | (np.diff(sizes) != 0)
    ends = [*(np.flatnonzero(change) + 1).tolist(), len(types)] if len(types) else []
    blocks: list[tuple[str, NDArray[np.int64]]] = []
    source: list[NDArray[np.int64]] = []  # the cell of the grid that each cell of the mesh came from
    start = 0
    for end in ends:
        code, size = int(types[start]), int(sizes[start])
        nodes = connectivity[offsets[start] : offsets[end]].reshape(end - start, size)
        cells = np.arange(start, end)
        if code in VTK_CHAINS:
            kind, width = VTK_CHAINS[code]
            nodes = np.lib.stride_tricks.sliding_window_view(nodes, width, axis=1).reshape(-1, width)
            cells = np.repeat(cells, size - width + 1)
        elif code == STRIP:
            raise InputError(f"cell {start} (counted from 0) is a triangle strip: call .triangulate() first")
        else:
            kind = VTK_KINDS.get(code, f"VTK type {code}")
            if code in VTK_ORDERS:
                nodes = nodes[:, VTK_ORDERS[code]]
        blocks.append(face(kind, nodes))
        source.append(cells)
        start = end
    taken = np.concatenate(source) if source else np.zeros(0, dtype=np.int64)
    cell_data = {name: np.asarray(values)[taken] for name, values in cell_fields.items()}
    point_data = {name: np.asarray(values) for name, values in point_fields.items()}
    return _mesh(points, blocks, cell_data, point_data, names)


def _mesh(
    points: ArrayLike,
    blocks: Sequence[tuple[str, NDArray[np.int64]]],
    cell_data: Mapping[str, NDArray[Any]] | None = None,
    point_data: Mapping[str, NDArray[Any]] | None = None,
    names: Mapping[tuple[int, int], str] | None = None,
    cell_sets: Mapping[str, NDArray[np.int64]] | None = None,
    node_sets: Mapping[str, NDArray[np.int64]] | None = None,
) -> Mesh:
    """cell_data: one array over all cells. cell_sets: name → cells.

    names: (dimension, tag) → name; tags are those of the cell data gmsh:physical, or region without these.
    """
    array = coordinates(points)
    cell_data, node_sets = cell_data or {}, dict(node_sets or {})
    counts = [len(nodes) for _, nodes in blocks]
    region: NDArray[np.int64] = np.broadcast_to(NOWHERE, sum(counts))
    region_names: dict[tuple[int, int], str] = {}
    if cell_data or cell_sets:
        region = np.zeros(len(region), dtype=np.int64)
        dimensions = [dimension_of(kind) for kind, _ in blocks]
        dimension = np.repeat(dimensions, counts).astype(np.int64)
        tags = cell_data.get("gmsh:physical", cell_data.get("region"))
        for dim in np.unique(dimension).tolist():
            of_dim = np.flatnonzero(dimension == dim)
            fields = [values[of_dim] for name, values in cell_data.items() if names_a_region(name)]
            # The outline of a named set of faces is a shape that the user has drawn, as much as the one of a region.
            fields += [np.isin(of_dim, cells) for cells in (cell_sets or {}).values()] if dim == 2 else []
            region[of_dim] = combined(fields, len(of_dim))
            for (named_dim, tag), name in (names or {}).items():
                if tags is not None and named_dim == dim:
                    tagged = of_dim[np.ravel(tags[of_dim]) == tag]
                    region_names.update({(dim, number): name for number in np.unique(region[tagged]).tolist()})
    region.flags.writeable = False  # so that it need not be copied
    breaks = np.cumsum(counts)[:-1].tolist()
    for name, ids in (cell_sets or {}).items():
        parts = np.split(np.isin(np.arange(len(region)), ids), breaks)
        nodes = [nodes[part].ravel() for (_, nodes), part in zip(blocks, parts, strict=True)]
        node_sets[name] = sorted_unique(np.concatenate([node_sets.get(name, np.zeros(0, dtype=np.int64)), *nodes]))
    cells = tuple(
        CellBlock(kind, nodes, part)
        for (kind, nodes), part in zip(blocks, np.split(region, breaks), strict=bool(blocks))
    )
    return Mesh(
        points=array,
        cells=cells,
        region_names=region_names,
        point_data=dict(point_data or {}),
        cell_data={name: tuple(np.split(values, breaks)) if blocks else () for name, values in cell_data.items()},
        node_sets=node_sets,
        single=array.dtype.kind == "f" and array.dtype.itemsize == 4,
    )


def _refill(copied: Callable[[], Any], points: Any) -> Restore:
    back = in_precision_of(points)

    def restore(new: NDArray[np.float64]) -> Any:
        made = copied()
        made.points = back(new)
        return made

    return restore


def _even(kind: str, data: Any) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """A block of meshio, cut where the number of nodes changes (its polygons may be lists of different lengths)."""
    if kind.startswith("polyhedron"):
        raise InputError("the mesh has polyhedra: of volumes, tetrahedra, pyramids, wedges and hexahedra are smoothed")
    if isinstance(data, np.ndarray):
        yield face(kind, indices(data, f"{kind} cells"))
        return
    for _, run in itertools.groupby(data, key=len):
        yield face(kind, indices(list(run), f"{kind} cells"))
