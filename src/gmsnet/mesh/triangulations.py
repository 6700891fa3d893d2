"""Meshes of scikit-fem, Matplotlib and SciPy as a Mesh, and back. None of these libraries is imported here."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.array_forms import Restore, from_pair, in_precision_of, mesh_from_arrays
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.region_fields import combined

# Classes → the kind of cell, and where its nodes are listed the place of each of a Mesh's (None: as in a Mesh).
SKFEM: dict[str, tuple[str, tuple[int, ...] | None]] = {
    "MeshTri1": ("triangle", None), "MeshQuad1": ("quad", None), "MeshTet1": ("tetra", None),
    "MeshHex1": ("hexahedron", (0, 3, 6, 2, 1, 5, 7, 4)), "MeshWedge1": ("wedge", None),
    "MeshTri2": ("triangle6", None), "MeshQuad2": ("quad9", None), "MeshTet2": ("tetra10", None),
}  # fmt: skip
SIMPLEX = {2: "triangle", 3: "tetra"}


def from_skfem(thing: Any) -> tuple[Mesh, Restore]:
    """Of a mesh of one of the classes ``SKFEM``. Out goes the same class.

    Cells belong to one region where the same subdomains hold them. The facets of named boundaries become markers, of
    volumes sets of nodes.
    Raises InputError for other classes of scikit-fem.
    """
    name = next(base.__name__ for base in type(thing).__mro__ if base.__module__.partition(".")[0] == "skfem")
    if name not in SKFEM:
        raise InputError(f"of scikit-fem, gmsnet knows {', '.join(SKFEM)}, not {name}")
    kind, order = SKFEM[name]
    points = np.asarray(thing.doflocs).T
    cells = np.asarray(thing.dofs.element_dofs if name.endswith("2") else thing.t).T
    cells = cells if order is None else cells[:, list(order)]
    subdomains = (thing.subdomains or {}).values()
    regions = combined([np.isin(np.arange(len(cells)), ids) for ids in subdomains], len(cells))
    facets = np.asarray(thing.facets).T if thing.boundaries else np.zeros((0, 2), dtype=np.int64)
    markers = {name: facets[np.asarray(ids)] for name, ids in (thing.boundaries or {}).items()}
    if CELLS[kind].dimension == 3:
        markers = {name: sorted_unique(nodes) for name, nodes in markers.items()}
    mesh, back = mesh_from_arrays(points, {kind: cells}, regions, markers), in_precision_of(points)
    return mesh, lambda new: dataclasses.replace(thing, doflocs=np.ascontiguousarray(back(new).T))


def from_triangulation(thing: Any) -> tuple[Mesh, Restore]:
    """Of a ``Triangulation``: x, y (N,) and triangles (M, 3). Out goes one with the same triangles and mask.

    Masked triangles are no cells. The nodes on the outline of what is left are held as any boundary, so masked
    triangles stay as they are.
    """
    shown = thing.triangles if thing.mask is None else thing.triangles[~np.asarray(thing.mask)]
    mesh, _ = from_pair((np.column_stack([thing.x, thing.y]), shown))
    return mesh, lambda new: type(thing)(new[:, 0], new[:, 1], thing.triangles, thing.mask)


def from_delaunay(thing: Any) -> tuple[Mesh, Restore]:
    """Of a ``Delaunay``: points (N, 2) and simplices (M, 3). Out goes (points, simplices).

    Triangles that were smoothed are no Delaunay triangulation of their points, which another ``Delaunay`` would be.
    """
    if thing.ndim not in SIMPLEX:
        raise InputError(
            f"a Delaunay triangulation of points in {thing.ndim} dimensions is no mesh: give planar points"
        )
    mesh, _ = from_pair((thing.points, {SIMPLEX[thing.ndim]: thing.simplices}))
    return mesh, lambda new: (new.copy(), thing.simplices.copy())
