"""gmsnet beside PyVista's own smoothers on three planar meshes: what becomes of cells and of the boundary.

GMSNET_MESHES=… python benchmarks/pyvista_smooth.py
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pyvista as pv

import gmsnet
from gmsnet.pyvista import grid_of

REPEATS = 3  # the best of so many counts
WAYS = {
    "input": lambda mesh: mesh,
    "`smooth()`": lambda mesh: mesh.smooth(),
    "`smooth(200, boundary_smoothing=False)`": lambda mesh: mesh.smooth(n_iter=200, boundary_smoothing=False),
    "`smooth(200, relaxation_factor=0.5, boundary_smoothing=False)`": lambda mesh: mesh.smooth(
        n_iter=200, relaxation_factor=0.5, boundary_smoothing=False
    ),
    "`smooth_taubin(boundary_smoothing=False)`": lambda mesh: mesh.smooth_taubin(boundary_smoothing=False),
    "`gmsnet.smooth()`": lambda mesh: mesh.gmsnet.smooth(),
}


def random_square() -> pv.PolyData:
    points = np.random.default_rng(0).random((2000, 2))
    return pv.PolyData(np.column_stack([points, np.zeros(2000)])).delaunay_2d()


def real(name: str) -> pv.PolyData:
    """The triangles of a file."""
    grid = grid_of(gmsnet.read(Path(os.environ["GMSNET_MESHES"]) / name))
    return grid.extract_cells(grid.celltypes == pv.CellType.TRIANGLE).extract_surface(algorithm=None)


def boundary(mesh: pv.PolyData) -> np.ndarray:
    """The ids of the nodes of boundary edges."""
    marked = mesh.copy()
    marked["id"] = np.arange(mesh.n_points)
    edges = marked.extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)
    return np.asarray(edges["id"])


def seconds(work, mesh: pv.PolyData) -> tuple[float, pv.PolyData]:
    taken = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        made = work(mesh)
        taken.append(time.perf_counter() - began)
    return min(taken), made


def main() -> None:
    meshes = {
        "random square": random_square(),
        "NACA 0012": real("mesh_NACA0012_inv.su2"),
        "coast": real("japan_sea.msh"),
    }
    for title, mesh in meshes.items():
        ids, extent = boundary(mesh), np.ptp(mesh.points, axis=0).max()
        mesh.gmsnet.smooth()  # compiles
        print(f"\n{title}, {mesh.n_points:,} nodes, {mesh.n_cells:,} triangles\n")
        print("| | inverted | least 1/q | mean 1/q | boundary moved by | ms |")
        print("|---|---|---|---|---|---|")
        for name, work in WAYS.items():
            took, made = seconds(work, mesh)
            report = gmsnet.quality((np.asarray(made.points[:, :2]), mesh.regular_faces))
            off = np.linalg.norm(made.points[ids] - mesh.points[ids], axis=1).max() / extent
            print(
                f"| {name} | {report.inverted:,} | {report.shape.min():.3f} | {report.shape.mean():.3f} "
                f"| {off:.1e} | {1e3 * took:.0f} |"
            )


if __name__ == "__main__":
    main()
