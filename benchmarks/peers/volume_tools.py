"""Tools that move the inner nodes of volumes, each from arrays: (points, seconds) of the processor, one thread.

points (N, 3), cells (T, 4) of positive volume, faces (F, 3) of the boundary, held (N,) bool. gmsnet, MFEM and Mesquite
take hexahedra (T, 8) with faces (F, 4), too. Making the tool's own mesh
does not count, nor does reading it; for gmsnet the whole call counts, from arrays to arrays.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

Arrays = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
Found = tuple[np.ndarray, float]
MESQUITE = "MESQUITE_VOLUMES"  # the environment variable that names the program


def timed(job: Callable[[], object]) -> float:
    began = time.process_time()
    job()
    return time.process_time() - began


def gmsnet_with(repeats: int = 1, **options: object) -> Callable[..., Found]:
    """A call with these options; its seconds are the least of the repeats."""

    def run(points, cells, faces, held) -> Found:
        import gmsnet

        mesh = (points, [("tetra" if cells.shape[1] == 4 else "hexahedron", cells)])
        gmsnet.smooth(mesh, max_sweeps=1, threads=1, fixed=held)  # compiles
        job = partial(gmsnet.smooth, mesh, threads=1, fixed=held, **options)
        points = job().points
        return points, min(timed(job) for _ in range(repeats))

    return run


def gmsh_relocate(points, cells, faces, held) -> Found:
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setNumber("Mesh.Renumber", 0)
    mesh, outer = gmsh.model.mesh, np.unique(faces)
    gmsh.model.addDiscreteEntity(2, 1)
    gmsh.model.addDiscreteEntity(3, 1, [1])
    inner = np.setdiff1d(np.arange(len(points)), outer)
    mesh.addNodes(2, 1, outer + 1, points[outer].ravel())
    mesh.addNodes(3, 1, inner + 1, points[inner].ravel())
    mesh.addElementsByType(1, 2, [], (faces + 1).ravel())
    mesh.addElementsByType(1, 4, [], (cells + 1).ravel())
    seconds = timed(lambda: mesh.optimize("Relocate3D", True, 5))
    tags, places, _ = mesh.getNodes()
    moved = np.empty_like(points)
    moved[tags.astype(np.int64) - 1] = places.reshape(-1, 3)
    return moved, seconds


def mmg_moves(points, cells, faces, held) -> Found:
    import mmgpy

    mesh = mmgpy.MmgMesh3D()
    mesh.set_mesh_size(vertices=len(points), tetrahedra=len(cells), triangles=len(faces))
    mesh.set_vertices(points)
    mesh.set_tetrahedra(cells.astype(np.int32))
    mesh.set_triangles(faces.astype(np.int32))
    mesh.set_required_triangles(np.arange(len(faces), dtype=np.int32))
    mesh.set_required_vertices(np.flatnonzero(held).astype(np.int32))
    seconds = timed(lambda: mesh.remesh(verbose=-1, noinsert=1, noswap=1, nosurf=1))
    return np.asarray(mesh.get_vertices()), seconds


def netgen_moves(points, cells, faces, held) -> Found:
    import netgen.meshing as netgen

    netgen.SetMessageImportance(0)
    mesh = netgen.Mesh(dim=3)
    mesh.Add(netgen.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    mesh.AddPoints(points)
    # It wants the other orientation, and else does nothing.
    mesh.AddElements(dim=3, index=1, data=cells[:, [0, 2, 1, 3]].astype(np.int32), base=0)
    mesh.AddElements(dim=2, index=1, data=faces.astype(np.int32), base=0)
    parameters = netgen.MeshingParameters(optimize3d="m", optsteps3d=3, parallel_meshing=False)
    seconds = timed(lambda: mesh.OptimizeVolumeMesh(parameters))
    return np.array(mesh.Coordinates()), seconds  # its memory goes with the mesh


def mfem_tmop(metric: int, iterations: int) -> Callable[..., Found]:
    """Newton's method on the whole mesh, as in mfem_tmop.py; 303 is q − 1."""

    def run(points, cells, faces, held) -> Found:
        import mfem.ser as mfem
        from mfem._ser import tmop_modules as tmop

        mesh, tetra = mfem.Mesh(3, len(points), len(cells), len(faces)), cells.shape[1] == 4
        for place in points.tolist():
            mesh.AddVertex(*place)
        for cell in cells.tolist():
            (mesh.AddTet if tetra else mesh.AddHex)(*cell)
        for face in faces.tolist():
            (mesh.AddBdrTriangle if tetra else mesh.AddBdrQuad)(*face)
        (mesh.FinalizeTetMesh if tetra else mesh.FinalizeHexMesh)(1, 0, False)
        mesh.EnsureNodes()
        collection = mfem.H1_FECollection(1, 3)
        space = mfem.FiniteElementSpace(mesh, collection, 3)
        mesh.SetNodalFESpace(space)
        nodes, rule = mesh.GetNodes(), mfem.IntRules.Get(mfem.Geometry.TETRAHEDRON, 1)
        if not tetra:  # a hexahedron is judged by its corners
            rules = mfem.IntegrationRules(0, mfem.Quadrature1D.GaussLobatto)  # the rule is a part of it
            rule = rules.Get(mfem.Geometry.CUBE, 1)
        metric_of = getattr(tmop, f"TMOP_Metric_{metric}")()
        target = tmop.TargetConstructor(tmop.TargetConstructor.IDEAL_SHAPE_UNIT_SIZE)
        target.SetNodes(nodes)
        integrator = tmop.TMOP_Integrator(metric_of, target)
        integrator.SetIntRule(rule)
        integrator.thisown = False  # it is the form's from here on
        form = mfem.NonlinearForm(space)
        form.AddDomainIntegrator(integrator)
        still = [space.DofToVDof(node, axis) for node in np.flatnonzero(held).tolist() for axis in range(3)]
        form.SetEssentialTrueDofs(mfem.intArray(still))
        linear, jacobi = mfem.MINRESSolver(), mfem.DSmoother(0, 1.0, 1)
        jacobi.SetPositiveDiagonal(True)
        linear.SetPreconditioner(jacobi)
        linear.SetMaxIter(100)
        linear.SetRelTol(1e-12)
        linear.SetAbsTol(0.0)
        linear.SetPrintLevel(-1)
        newton = tmop.TMOPNewtonSolver(rule, 0)
        newton.SetOperator(form)
        newton.SetPreconditioner(linear)
        newton.SetMaxIter(iterations)
        newton.SetRelTol(1e-8)
        newton.SetAbsTol(0.0)
        newton.SetPrintLevel(-1)
        newton.SetAdaptiveLinRtol(2, 0.5, 0.9)
        seconds = timed(lambda: newton.Mult(mfem.Vector(), nodes))
        values = np.array(nodes.GetDataArray())
        by_node = space.GetOrdering() == mfem.Ordering.byVDIM
        return values.reshape(-1, 3) if by_node else values.reshape(3, -1).T, seconds

    return run


def mesquite(wrapper: str) -> Callable[..., Found]:
    def run(points, cells, faces, held) -> Found:
        with TemporaryDirectory() as folder:
            given, found = Path(folder, "given"), Path(folder, "found")
            with given.open("w") as file:
                file.write(f"{len(points)} {len(cells)} {cells.shape[1]}\n")
                np.savetxt(file, np.column_stack([points, held]), "%.17g %.17g %.17g %d")
                np.savetxt(file, cells, "%d")
            subprocess.run([os.environ[MESQUITE], wrapper, given, found], check=True)
            with found.open() as file:
                seconds = sum(map(float, file.readline().split()))
                return np.loadtxt(file), seconds

    return run


TOOLS: dict[str, Callable[..., Found]] = {
    "gmsnet": gmsnet_with(),
    "Gmsh Relocate3D": gmsh_relocate,
    "Mmg3D, moves alone": mmg_moves,
    "Netgen m": netgen_moves,
    "MFEM TMOP 301": mfem_tmop(301, 60),
    "MFEM TMOP 302": mfem_tmop(302, 60),
    "MFEM TMOP 303": mfem_tmop(303, 60),
    "Mesquite ShapeImprovementWrapper": mesquite("ShapeImprovementWrapper"),
    "Mesquite ShapeImprover": mesquite("ShapeImprover"),
}

WAYS: dict[str, dict[str, str]] = {
    "auto": {},
    "barrier": {"method": "barrier"},
    "barrier on q": {"method": "barrier", "objective": "q"},
    "Newton on η": {"method": "optimize", "variant": "newton", "objective": "metric"},
}


def tool_named(name: str) -> Callable[..., Found]:
    """One of TOOLS, or of gmsnet: "gmsnet, N°" with N as the minimum dihedral angle, "WAY, N sweeps" with at most N."""
    if name.endswith(" sweeps"):
        way, sweeps = name.removesuffix(" sweeps").split(", ")
        return gmsnet_with(repeats=3, max_sweeps=int(sweeps), **WAYS[way])
    if name.startswith("gmsnet, "):
        return gmsnet_with(target_dihedral=float(name.removeprefix("gmsnet, ").removesuffix("°")))
    return TOOLS[name]
