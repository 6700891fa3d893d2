"""The tools that gmsnet is compared with, each with the options that served it best, and those that cannot be had.

How the options were found: each tool's documentation, then trials on random squares and jittered good meshes of 10,000
nodes. Averaging tools run without relaxation (factor 1: faster by half and no worse than the small factors that some
have by default) and without a convergence test; none has one that sees quality. QUAD_PEERS are for quad_peers.py alone.
"""

from __future__ import annotations

from peers.mesquite_wrappers import PROGRAM
from peers.peer import AVERAGING, OURS, QUALITY, Peer

SWEEPS = (1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 30, 50)
NEWTON = (3, 5, 7, 10, 15, 20, 25, 30, 40, 60)
TMOP = {"linear_iterations": 100, "adaptive": 2, "tolerance": 1e-10}

PEERS = [
    Peer("SciPy matrix", AVERAGING, "scipy_matrix:Laplacian", ("scipy",), SWEEPS, "sweeps", "BSD",
         note="the product of a sparse averaging matrix with the coordinates"),
    Peer("VTK constrained", AVERAGING, "vtk_filters:Constrained", ("vtk",), SWEEPS, "iterations", "BSD",
         {"relaxation": 1.0}, note="vtkConstrainedSmoothingFilter, given its stencils"),
    Peer("VTK smooth", AVERAGING, "vtk_filters:Smooth", ("vtk",), SWEEPS, "iterations", "BSD", {"relaxation": 1.0},
         note="vtkSmoothPolyDataFilter, boundary smoothing off"),
    Peer("VTK windowed sinc", AVERAGING, "vtk_filters:WindowedSinc", ("vtk",), (10, 20, 30, 50, 100), "iterations",
         "BSD", {"pass_band": 0.001}, note="vtkWindowedSincPolyDataFilter, boundary smoothing off"),
    Peer("trimesh", AVERAGING, "trimesh_filter:Laplacian", ("trimesh", "scipy"), SWEEPS, "iterations", "MIT",
         {"lamb": 1.0}, note="filter_laplacian with pinned vertices, no volume constraint"),
    Peer("MeshLib", AVERAGING, "meshlib_relax:Relax", ("meshlib",), SWEEPS, "iterations", "non-commercial",
         {"force": 1.0}, note="relax"),
    Peer("PyMeshLab", AVERAGING, "pymeshlab_filter:Laplacian", ("pymeshlab",), SWEEPS, "steps", "GPL-3",
         {"cotangentweight": False}, note="apply_coord_laplacian_smoothing; cotangent weights leave a plane as it is"),
    Peer("Gmsh Relocate2D", QUALITY, "gmsh_optimize:Optimize", ("gmsh",), (1, 2, 3, 5, 10, 20), "iterations",
         "GPL-2+", {"method": "Relocate2D"}, most_nodes=2e5),
    Peer("Gmsh Laplace2D", QUALITY, "gmsh_optimize:Optimize", ("gmsh",), (1, 2, 3, 5, 10), "iterations", "GPL-2+",
         {"method": "Laplace2D"}, most_nodes=2e5),
    Peer("Mmg", QUALITY, "mmg_moves:Moves", ("mmgpy",), (1, 2, 3, 5, 10, 20), "passes", "LGPL-3",
         {"noinsert": 1, "noswap": 1, "nosurf": 1, "nofem": 1}),
    Peer("Netgen", QUALITY, "netgen_smoothing:Smoothing", ("netgen-mesher",), (1, 2, 3, 5, 10, 20), "steps", "LGPL-2.1",
         {"elsizeweight": 0.0}, most_nodes=2e5, note='optimize2d="m"; the weight of the size spoils mean and minimum'),
    Peer("MFEM TMOP 2", QUALITY, "mfem_tmop:Tmop", ("mfem",), NEWTON, "Newton steps", "BSD",
         {"metric": 2, **TMOP}, most_nodes=2e5, note="metric 2: q − 1"),
    Peer("MFEM TMOP 58", QUALITY, "mfem_tmop:Tmop", ("mfem",), NEWTON, "Newton steps", "BSD",
         {"metric": 58, **TMOP}, most_nodes=2e5, note="metric 58: 4q(q − 1)"),
    Peer("L-BFGS on q²", QUALITY, "whole_mesh:Lbfgs", ("numba",), (10, 20, 50, 100, 200, 500, 20_000), "iterations",
         "MIT", {"power": 2}, most_nodes=2e5, note="all nodes at once; our own, compiled: benchmarks/barrier.py"),
    Peer("paper: smart Laplacian", QUALITY, "paper_python:Python", ("numpy",), (1, 2, 3, 5, 10), "sweeps", "MIT",
         {"move": "smart_laplacian"}, most_nodes=2e5, note="plain Python, as the paper's timings (gmsnet.paper.plain)"),
    Peer("paper: GMSNet", QUALITY, "paper_python:Python", ("torch", "torch-geometric"), (1, 2, 3, 5, 10), "sweeps",
         "MIT", {"move": "gmsnet"}, most_nodes=2e5, note="plain Python and PyTorch, a node at a time, as the paper's"),
]  # fmt: skip

QUAD_PEERS = [
    Peer("meshkernel", QUALITY, "meshkernel_orthogonalize:Orthogonalize", ("meshkernel",), (1, 2, 3, 5, 10, 20),
         "outer iterations", "LGPL", {"factor": 0.5},
         note="the default 0.975 has a smaller mean and least 1/q, and smoothing alone, 0, inverts cells"),
    Peer("Mesquite Newton", QUALITY, "mesquite_wrappers:Wrapper", (), (1, 2, 3), "calls", "LGPL-2.1",
         {"wrapper": "ShapeImprovementWrapper"}, program=PROGRAM),
    Peer("Mesquite CG", QUALITY, "mesquite_wrappers:Wrapper", (), (1, 2, 3, 5, 10), "calls", "LGPL-2.1",
         {"wrapper": "ShapeImprover"}, most_nodes=2e4, program=PROGRAM),
]  # fmt: skip

OWN = [
    Peer("gmsnet auto", OURS, "ours:Smooth", ("gmsnet",), (), "sweeps", "MIT", {"method": "auto"}),
    Peer("gmsnet laplacian plain", OURS, "ours:Smooth", ("gmsnet",), (), "sweeps", "MIT",
         {"method": "laplacian", "variant": "plain", "guard": "valid"}),
    Peer("gmsnet laplacian smart", OURS, "ours:Smooth", ("gmsnet",), (), "sweeps", "MIT",
         {"method": "laplacian", "variant": "smart"}),
    Peer("gmsnet gmsnet", OURS, "ours:Smooth", ("gmsnet",), (), "sweeps", "MIT", {"method": "gmsnet"}),
    Peer("gmsnet barrier", OURS, "ours:Smooth", ("gmsnet",), (), "sweeps", "MIT", {"method": "barrier"}),
]  # fmt: skip

DEFAULT = OWN[0].name

ABSENT = {
    "optimesh": "0.12 refuses to be imported without a licence key; 0.8, which did not, has been withdrawn from PyPI",
    "CGAL angle_and_area_smoothing": "no package on PyPI has it (cgal 6.0.1, compas_cgal 0.10, loop_cgal 1.0, pycglib)",
}  # tool → why it is not in the table


def named(name: str) -> Peer:
    """The row with this name. Raises KeyError."""
    return {peer.name: peer for peer in (*PEERS, *QUAD_PEERS, *OWN)}[name]
