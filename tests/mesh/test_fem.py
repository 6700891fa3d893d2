"""Meshes of FEM codes: those of libraries that are installed, and stand-ins for dolfinx and PETSc, which are not.

A stand-in has the attributes that the library documents, under its module's name, and no more.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.optional import library

import gmsnet
from gmsnet.cells.dual import ideal_corners
from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.mesh.adapters import to_mesh

POINTS = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.2, 0.7]], dtype=float)
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])


def stand_in(module: str, name: str, **members: Any) -> Any:
    return type(name, (), {"__module__": module, **members})()


def check(thing: Any, points: Any) -> Any:
    """The inner node moves to a better place, the thing itself stays. Returns what comes out."""
    before = np.array(points(thing))
    result = gmsnet.smooth(thing)
    assert np.array_equal(points(thing), before)
    assert result.after.shape.min() > result.before.shape.min()
    return result.mesh


@pytest.mark.filterwarnings("ignore")  # its own
def test_sfepy() -> None:
    fem = library("sfepy.discrete.fem")
    mesh = fem.Mesh.from_data("square", POINTS, None, [TRIANGLES], [np.array([1, 1, 1, 1])], ["2_3"])
    out = check(mesh, lambda mesh: mesh.coors)
    assert type(out) is type(mesh)
    assert np.array_equal(out.coors[:4], POINTS[:4])
    assert np.abs(out.coors[4] - 0.5).max() < 0.05
    assert out.get_conn("2_3").tolist() == TRIANGLES.tolist()
    parted = fem.Mesh.from_data("square", POINTS, None, [TRIANGLES], [np.array([1, 2, 1, 1])], ["2_3"])
    assert np.array_equal(gmsnet.smooth(parted).mesh.coors, POINTS)  # the interface is held


def test_netgen() -> None:
    geometry = library("netgen.geom2d")
    for quads in (False, True):
        mesh = geometry.unit_square.GenerateMesh(maxh=0.3, quad_dominated=quads)
        given, _ = to_mesh(mesh)
        inner = np.setdiff1d(
            np.arange(len(given.points)), [n for b in given.cells if b.kind == "line" for n in b.nodes]
        )
        for k, point in enumerate(mesh.Points()):
            if k == inner[0]:
                point[0] += 0.04
        out = check(mesh, lambda mesh: mesh.Coordinates())
        assert type(out) is type(mesh)
        assert len(out.Elements2D()) == len(mesh.Elements2D())
        again, _ = to_mesh(out)
        assert [b.nodes.tolist() for b in again.cells] == [b.nodes.tolist() for b in given.cells]


def test_netgen_volumes() -> None:
    csg = library("netgen.csg")
    geometry = csg.CSGeometry()
    geometry.Add(csg.Sphere(csg.Pnt(0, 0, 0), 1))
    mesh = geometry.GenerateMesh(maxh=0.6)
    given, _ = to_mesh(mesh)
    assert {b.kind for b in given.cells} == {"tetra", "triangle"}
    assert sum(len(b.nodes) for b in given.cells if b.kind == "tetra") == len(mesh.Elements3D())
    result = gmsnet.smooth(mesh)
    assert result.after.inverted == 0
    mesh.SecondOrder()
    with pytest.raises(InputError, match="give the mesh at order 1"):
        to_mesh(mesh)


def test_meshkernel() -> None:
    meshkernel = library("meshkernel")
    kernel = meshkernel.MeshKernel()
    edges = np.array([0, 1, 1, 2, 2, 3, 3, 0, 0, 4, 1, 4, 2, 4, 3, 4], dtype=np.int32)
    kernel.mesh2d_set(meshkernel.Mesh2d(POINTS[:, 0].copy(), POINTS[:, 1].copy(), edges))
    mesh = kernel.mesh2d_get()
    out = check(mesh, lambda mesh: np.column_stack([mesh.node_x, mesh.node_y]))
    assert type(out) is type(mesh)
    assert out.face_nodes.tolist() == mesh.face_nodes.tolist()
    kernel.mesh2d_set(out)
    again = kernel.mesh2d_get()
    assert sorted(zip(again.node_x, again.node_y, strict=True)) == sorted(zip(out.node_x, out.node_y, strict=True))
    with pytest.raises(InputError, match="has no faces"):
        to_mesh(meshkernel.Mesh2d(POINTS[:, 0].copy(), POINTS[:, 1].copy(), edges))


def dolfinx_mesh(cells: np.ndarray, name: str, points: np.ndarray = POINTS, size: int = 1) -> Any:
    geometry = SimpleNamespace(x=np.pad(points, ((0, 0), (0, 3 - points.shape[1]))), dofmap=cells, dim=points.shape[1])
    topology = SimpleNamespace(cell_name=lambda: name)
    return stand_in("dolfinx.mesh", "Mesh", geometry=geometry, topology=topology, comm=SimpleNamespace(size=size))


def test_dolfinx_stand_in() -> None:
    mesh = dolfinx_mesh(TRIANGLES.astype(np.int32), "triangle")
    x, cells = check(mesh, lambda mesh: mesh.geometry.x)
    assert x.shape == (5, 3)
    assert cells.tolist() == TRIANGLES.tolist()
    quads, _ = to_mesh(dolfinx_mesh(np.array([[0, 1, 3, 2]]), "quadrilateral"))
    assert quads.cells[0].nodes.tolist() == [[0, 1, 2, 3]]
    cube = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], dtype=float)
    hexes, _ = to_mesh(dolfinx_mesh(np.arange(8)[None], "hexahedron", cube))
    assert hexes.points[hexes.cells[0].nodes[0]].tolist() == [
        [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]
    ]  # fmt: skip
    with pytest.raises(InputError, match="gather the mesh on one process"):
        to_mesh(dolfinx_mesh(TRIANGLES, "triangle", size=2))
    with pytest.raises(InputError, match="only those of degree 1"):
        to_mesh(dolfinx_mesh(np.zeros((1, 6), int), "triangle"))
    base = cube[[0, 1, 2, 3, 4]]
    pyramids, _ = to_mesh(dolfinx_mesh(np.arange(5)[None], "pyramid", base))
    assert pyramids.points[pyramids.cells[0].nodes[0]].tolist() == base[[0, 1, 3, 2, 4]].tolist()
    assert to_mesh(dolfinx_mesh(np.arange(6)[None], "prism", cube[[0, 1, 2, 4, 5, 6]]))[0].cells[0].kind == "wedge"
    with pytest.raises(InputError, match="'interval' are not known"):
        to_mesh(dolfinx_mesh(TRIANGLES, "interval"))


def plex(size: int = 1, cells: np.ndarray = TRIANGLES) -> Any:
    count = len(cells)
    return stand_in(
        "petsc4py.PETSc", "DMPlex", comm=SimpleNamespace(size=size),
        getCoordinateDim=lambda self: 2, getDimension=lambda self: 2,
        getCoordinatesLocal=lambda self: SimpleNamespace(array=POINTS.ravel()),
        getDepthStratum=lambda self, depth: (count, count + 5), getHeightStratum=lambda self, height: (0, count),
        getTransitiveClosure=lambda self, cell: (
            np.array([cell, 20, 21, 22, *(cells[cell] + count)]), np.zeros(4 + cells.shape[1], int)),
    )  # fmt: skip


def test_plex_stand_in() -> None:
    points, cells = check(plex(), lambda mesh: POINTS)
    assert points.shape == (5, 2)
    assert [kind for kind, _ in cells] == ["triangle"]
    with pytest.raises(InputError, match="before it is distributed"):
        to_mesh(plex(2))
    with pytest.raises(InputError, match="has 5 vertices"):
        to_mesh(plex(cells=np.array([[0, 1, 2, 3, 4]])))


def solid_plex(kind: str, tensor: bool) -> Any:
    """An ideal cell in the order of PETSc, whose first facet is seen from outside."""
    ideal = ideal_corners(CELLS[kind])
    swap = {"tetra": (0, 1), "hexahedron": (1, 3), "wedge": (1, 2), "pyramid": (1, 3)}[kind]  # as DMPlexInvertCell
    cone = list(range(len(ideal)))
    if not tensor:
        cone[swap[0]], cone[swap[1]] = cone[swap[1]], cone[swap[0]]
    number = {"tetra": 6, "hexahedron": 10 if tensor else 7, "wedge": 9 if tensor else 8, "pyramid": 11}[kind]
    return stand_in(
        "petsc4py.PETSc", "DMPlex", comm=SimpleNamespace(size=1),
        getCoordinateDim=lambda self: 3, getDimension=lambda self: 3,
        getCoordinatesLocal=lambda self: SimpleNamespace(array=ideal.ravel()),
        getDepthStratum=lambda self, depth: (1, 1 + len(ideal)), getHeightStratum=lambda self, height: (0, 1),
        getTransitiveClosure=lambda self, cell: (np.array([0, 50, 51, *(1 + np.array(cone))]), None),
        getCellType=lambda self, cell: number,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "tensor"),
    [
        ("tetra", False),
        ("hexahedron", False),
        ("hexahedron", True),
        ("wedge", False),
        ("wedge", True),
        ("pyramid", False),
    ],
)
def test_volumes_of_plex_are_turned_to_the_order_of_meshio(kind: str, tensor: bool) -> None:
    mesh, _ = to_mesh(solid_plex(kind, tensor))
    (block,) = mesh.cells
    assert block.kind == kind
    assert block.nodes.tolist() == [list(range(len(mesh.points)))]
    assert gmsnet.quality(mesh).shape.min() == pytest.approx(1.0)


@pytest.mark.parametrize(
    "name", ["MeshTri1", "MeshQuad1", "MeshTet1", "MeshHex1", "MeshWedge1", "MeshTri2", "MeshQuad2", "MeshTet2"]
)
def test_all_meshes_of_scikit_fem(name: str) -> None:
    """Cells are valid as they come, middles lie on their edges, and only points that are free move."""
    skfem = pytest.importorskip("skfem")
    made = getattr(skfem, name)
    grid = made() if name == "MeshWedge1" else made().refined(1 if name == "MeshQuad2" else 2)  # wedges: two of them
    mesh, restore = to_mesh(grid)
    assert gmsnet.quality(mesh).inverted == 0
    (block,) = mesh.cells
    for edge in block.cell.edges:
        ends, middle = mesh.points[block.nodes[:, edge[:2]]], block.nodes[:, edge[2:]]
        if middle.shape[1]:
            assert np.abs(mesh.points[middle[:, 0]] - ends.mean(axis=1)).max() < 1e-12
    thrown = mesh.points.copy()
    inner = np.setdiff1d(np.arange(len(thrown)), np.flatnonzero(np.isin(thrown, (0.0, 1.0)).any(axis=1)))
    thrown[inner] += np.random.default_rng(0).uniform(-0.02, 0.02, (len(inner), thrown.shape[1]))
    result = gmsnet.smooth(restore(thrown))
    assert type(result.mesh) is type(grid)
    assert np.array_equal(result.mesh.t, grid.t)
    assert result.after.inverted == 0
    assert np.array_equal(result.mesh.doflocs.T, result.points)
    assert result.moved.any() == (len(inner) > 0)


def test_other_meshes_of_scikit_fem_are_refused() -> None:
    skfem = pytest.importorskip("skfem")
    with pytest.raises(InputError, match=r"knows .*MeshWedge1, .* not MeshHex2"):
        to_mesh(skfem.MeshHex2())
