"""Tools that move the nodes of triangle surfaces and keep their connectivity. Each is told points, rows and returns
points and the seconds that its own call took."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Found = tuple[Floats, float]
Tool = Callable[[Floats, NDArray[np.int64]], Found]
HAUSDORFF = 1e-3  # of the diagonal: Mmg's hausd


def timed(job: Callable[[], object]) -> tuple[object, float]:
    begun = time.perf_counter()
    found = job()
    return found, time.perf_counter() - begun


def gmsnet_with(**options: object) -> Tool:
    def run(points: Floats, rows: NDArray[np.int64]) -> Found:
        import gmsnet
        from gmsnet.mesh.cell_block import CellBlock

        mesh = gmsnet.Mesh(points, (CellBlock("triangle", rows, np.zeros(len(rows), dtype=np.int64)),))
        gmsnet.smooth(mesh, threads=1, **options)
        result, seconds = timed(lambda: gmsnet.smooth(mesh, threads=1, **options))
        return result.points, seconds

    return run


def mmgs(points: Floats, rows: NDArray[np.int64]) -> Found:
    import mmgpy

    mesh = mmgpy.MmgMeshS()
    mesh.set_mesh_size(vertices=len(points), triangles=len(rows), edges=0)
    mesh.set_vertices(points)
    mesh.set_triangles(rows.astype(np.int32))
    hausd = HAUSDORFF * float(np.linalg.norm(np.ptp(points, axis=0)))
    _, seconds = timed(lambda: mesh.remesh(verbose=-1, noinsert=1, noswap=1, hausd=hausd, ar=30.0))
    return np.asarray(mesh.get_vertices()), seconds


def _polydata(points: Floats, rows: NDArray[np.int64]):
    import pyvista

    return pyvista.PolyData(points, np.hstack([np.full((len(rows), 1), 3), rows]).ravel())


def vtk_laplacian(points: Floats, rows: NDArray[np.int64]) -> Found:
    mesh = _polydata(points, rows)
    found, seconds = timed(lambda: mesh.smooth(n_iter=100, feature_smoothing=False, feature_angle=30.0))
    return np.asarray(found.points, dtype=float), seconds


def vtk_taubin(points: Floats, rows: NDArray[np.int64]) -> Found:
    mesh = _polydata(points, rows)
    found, seconds = timed(lambda: mesh.smooth_taubin(n_iter=50, feature_angle=30.0))
    return np.asarray(found.points, dtype=float), seconds


def trimesh_humphrey(points: Floats, rows: NDArray[np.int64]) -> Found:
    import trimesh

    mesh = trimesh.Trimesh(points, rows, process=False)
    _, seconds = timed(lambda: trimesh.smoothing.filter_humphrey(mesh))
    return np.asarray(mesh.vertices), seconds


def meshlab(points: Floats, rows: NDArray[np.int64]) -> Found:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, rows.astype(np.int32)))
    _, seconds = timed(lambda: meshes.apply_coord_taubin_smoothing())
    return meshes.current_mesh().vertex_matrix(), seconds


def libigl_flow(points: Floats, rows: NDArray[np.int64]) -> Found:
    """One implicit step of mean-curvature flow, as libigl's tutorial has it (205)."""
    import igl
    from scipy.sparse.linalg import spsolve

    def step() -> Floats:
        laplacian = igl.cotmatrix(points, rows)
        mass = igl.massmatrix(points, rows, igl.MASSMATRIX_TYPE_BARYCENTRIC)
        return np.asarray(spsolve(mass - 1e-3 * laplacian, mass @ points))

    found, seconds = timed(step)
    return found, seconds


TOOLS: dict[str, Tool] = {
    "gmsnet auto": gmsnet_with(),
    "gmsnet, Hausdorff 0.1 %": gmsnet_with(hausdorff=HAUSDORFF),
    "gmsnet, needles free": gmsnet_with(free_needles=True),
    "gmsnet, needles free, 0.1 %": gmsnet_with(free_needles=True, hausdorff=HAUSDORFF),
    "Mmgs (no insertion, no swap)": mmgs,
    "VTK smooth, 100 passes": vtk_laplacian,
    "VTK Taubin, 50 passes": vtk_taubin,
    "trimesh Humphrey": trimesh_humphrey,
    "MeshLab Taubin": meshlab,
    "libigl mean-curvature flow": libigl_flow,
}
