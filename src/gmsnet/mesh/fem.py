"""Meshes of FEM codes and mesh generators as a Mesh, and back, told by their types: none of them is imported here."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import face_name
from gmsnet.errors import InputError
from gmsnet.mesh.array_forms import Restore, mesh_from_arrays
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Ints = NDArray[np.int64]

# Names of dolfinx → the kind of cell, and where its nodes are listed row by row the place of each of a Mesh's.
DOLFINX: dict[str, tuple[str, tuple[int, ...]]] = {
    "triangle": ("triangle", (0, 1, 2)), "quadrilateral": ("quad", (0, 1, 3, 2)),
    "tetrahedron": ("tetra", (0, 1, 2, 3)),
    "hexahedron": ("hexahedron", (0, 1, 3, 2, 4, 5, 7, 6)),
    "prism": ("wedge", (0, 1, 2, 3, 4, 5)), "pyramid": ("pyramid", (0, 1, 3, 2, 4)),
}  # fmt: skip
SFEPY = {"1_2": "line", "2_3": "triangle", "2_4": "quad", "3_4": "tetra", "3_8": "hexahedron", "3_6": "wedge"}
VOLUMES = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron"}
# PETSc's cells have their first facet seen from outside: where a Mesh's nodes stand in theirs (DMPlexReorderCell). Its
# tensor products of a triangle or a quad with a segment have them as a Mesh has.
PLEX: dict[int, tuple[int, ...]] = {
    4: (1, 0, 2, 3),
    5: (0, 3, 2, 1, 4),
    6: (0, 2, 1, 3, 4, 5),
    8: (0, 3, 2, 1, 4, 5, 6, 7),
}
PLEX_TENSORS = (9, 10)  # numbers of DM_POLYTOPE


def from_dolfinx(thing: Any) -> tuple[Mesh, Restore]:
    """Of a ``dolfinx.mesh.Mesh`` on one process. Out goes (x, cells): the points (N, 3), for ``geometry.x[:] = x``.

    Raises InputError for a mesh on several processes, for other cells and for those of higher order.
    """
    if thing.comm.size > 1:
        raise InputError("a dolfinx mesh on several processes: nodes that they share would go to different places: "
                         "gather the mesh on one process, or smooth the file before it is read")  # fmt: skip
    topology = thing.topology
    called = topology.cell_name() if hasattr(topology, "cell_name") else str(topology.cell_type).rpartition(".")[2]
    dofs = np.asarray(getattr(thing.geometry.dofmap, "array", thing.geometry.dofmap))
    if called not in DOLFINX:
        raise InputError(f"dolfinx cells of the type {called!r} are not known: known are {', '.join(DOLFINX)}")
    kind, order = DOLFINX[called]
    if dofs.ndim == 1:
        dofs = dofs.reshape(-1, len(order))
    if dofs.shape[1] != len(order):
        raise InputError(f"dolfinx cells of the type {called!r} with {dofs.shape[1]} nodes: only those of degree 1 are")
    points, dimension = np.array(thing.geometry.x), int(thing.geometry.dim)
    mesh = mesh_from_arrays(points[:, : max(2, dimension)], [(kind, dofs[:, list(order)])])

    def restore(new: NDArray[np.float64]) -> Any:
        made = points.copy()
        made[:, : new.shape[1]] = new
        return made, dofs.copy()

    return mesh, restore


def from_plex(thing: Any) -> tuple[Mesh, Restore]:
    """Of a ``petsc4py.PETSc.DMPlex`` on one process. Out goes (points, cells), the points in the order of its local
    coordinates, the nodes of cells in meshio's.

    Raises InputError for a mesh on several processes, one of higher degree, and for polyhedra.
    """
    if thing.comm.size > 1:
        raise InputError("a DMPlex on several processes: nodes that they share would go to different places: "
                         "smooth it before it is distributed")  # fmt: skip
    dimension = int(thing.getCoordinateDim())
    points = np.array(thing.getCoordinatesLocal().array, dtype=np.float64).reshape(-1, dimension)
    first, end = thing.getDepthStratum(0)
    if len(points) != end - first:
        raise InputError(
            f"a DMPlex of {end - first} vertices with {len(points)} points: only those of degree 1 are known"
        )
    of_cells = 2 if int(thing.getDimension()) == 2 else 3
    kinds = {3: "triangle", 4: "quad"} if of_cells == 2 else VOLUMES
    cells: dict[str, list[list[int]]] = {}
    for cell in range(*thing.getHeightStratum(0)):
        closure = np.asarray(thing.getTransitiveClosure(cell)[0])
        nodes = (closure[(closure >= first) & (closure < end)] - first).tolist()
        if len(nodes) not in kinds:
            raise InputError(
                f"cell {cell} of the DMPlex has {len(nodes)} vertices: known are {', '.join(kinds.values())}"
            )
        if of_cells == 3 and int(thing.getCellType(cell)) not in PLEX_TENSORS:
            nodes = [nodes[place] for place in PLEX[len(nodes)]]
        cells.setdefault(kinds[len(nodes)], []).append(nodes)
    blocks = [(kind, np.array(rows)) for kind, rows in cells.items()]
    return mesh_from_arrays(points, blocks), lambda new: (new.copy(), blocks)


def from_sfepy(thing: Any) -> tuple[Mesh, Restore]:
    """Of a ``Mesh`` of sfepy, whose cell groups are regions. Out goes a copy."""
    groups = np.asarray(thing.cmesh.cell_groups)
    cells, regions = [], []
    for description in thing.descs:
        if description not in SFEPY:
            raise InputError(f"sfepy cells of the kind {description!r} are not known: known are {', '.join(SFEPY)}")
        nodes, own = thing.get_conn(description, ret_cells=True)
        cells.append((SFEPY[description], np.asarray(nodes)))
        regions.append(groups[np.asarray(own)])

    def restore(new: NDArray[np.float64]) -> Any:
        made = thing.copy()
        made.coors[:] = new
        return made

    return mesh_from_arrays(np.array(thing.coors), cells, regions), restore


def from_netgen(thing: Any) -> tuple[Mesh, Restore]:
    """Of a ``netgen.meshing.Mesh``, whose materials are regions and whose boundaries are held. Out goes a copy.

    Raises InputError for curved elements and those of higher order.
    """
    points = np.array(thing.Coordinates(), dtype=np.float64)
    volumes = list(thing.Elements3D())
    blocks = _elements(volumes, VOLUMES) if volumes else []
    blocks += _elements(thing.Elements2D(), {3: "triangle", 4: "quad"})
    blocks += _elements(thing.Elements1D(), {2: "line"})

    def restore(new: NDArray[np.float64]) -> Any:
        made = thing.Copy()
        for point, place in zip(made.Points(), new.tolist(), strict=True):
            for axis, value in enumerate(place):
                point[axis] = value
        return made

    return Mesh(points, tuple(blocks)), restore


def _elements(elements: Iterable[Any], kinds: dict[int, str]) -> list[CellBlock]:
    """Elements of Netgen, which counts their points from 1, those of one kind together."""
    rows: dict[int, tuple[list[list[int]], list[int]]] = {}
    for element in elements:
        nodes = [point.nr - 1 for point in element.points]
        if len(nodes) not in kinds:
            raise InputError(f"Netgen elements of {len(nodes)} points are not known here: give the mesh at order 1")
        of, regions = rows.setdefault(len(nodes), ([], []))
        of.append(nodes)
        regions.append(element.index)
    return [CellBlock(kinds[size], np.array(of), np.array(regions)) for size, (of, regions) in rows.items()]


def from_meshkernel(thing: Any) -> tuple[Mesh, Restore]:
    """Of a ``Mesh2d`` of MeshKernel with its faces. Out goes a copy, with the middles of edges; those of faces, which
    MeshKernel computes itself, are left out.
    """
    sizes = np.asarray(thing.nodes_per_face).astype(np.int64)
    listed = np.asarray(thing.face_nodes).astype(np.int64)
    if not len(sizes) or int(sizes.sum()) != len(listed):
        raise InputError("the Mesh2d has no faces: take it with mesh2d_get(), which finds them")
    first = np.cumsum(sizes) - sizes
    cells = [(face_name(size), listed[first[sizes == size][:, None] + np.arange(size)]) for size in
             np.unique(sizes).tolist()]  # fmt: skip

    def restore(new: NDArray[np.float64]) -> Any:
        made, edges = copy.copy(thing), np.asarray(thing.edge_nodes).reshape(-1, 2)
        made.node_x, made.node_y = new[:, 0].copy(), new[:, 1].copy()
        made.edge_x, made.edge_y = (new[edges, axis].mean(axis=1) for axis in (0, 1))
        made.face_x, made.face_y = np.empty(0), np.empty(0)
        return made

    return mesh_from_arrays(np.column_stack([thing.node_x, thing.node_y]), cells), restore
