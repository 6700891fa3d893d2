"""The mesh of a live Gmsh model of about 10⁵ nodes: seconds of each step, and are coordinates read back bit for bit?

python benchmarks/gmsh_live.py [--nodes 1e5]
"""

from __future__ import annotations

import argparse
import time

import gmsh
import numpy as np
from machine import describe

import gmsnet.gmsh
from gmsnet.gmsh.coordinates import set_points
from gmsnet.gmsh.live import read

THROWN = {2: 0.25, 3: 0.1}  # of the size, by dimension: tetrahedra are thin by themselves


def planar(nodes: float, recombine: bool) -> float:
    size = 1.06 / np.sqrt(nodes)
    maker = gmsh.model.occ
    maker.cut([(2, maker.addRectangle(0, 0, 0, 1, 1))], [(2, maker.addDisk(0.5, 0.5, 0, 0.2, 0.2))])
    maker.synchronize()
    gmsh.option.setNumber("Mesh.RecombineAll", int(recombine))
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(2)
    return size


def volume(nodes: float) -> float:
    size = 1.0 / nodes ** (1 / 3)
    maker = gmsh.model.occ
    maker.cut([(3, maker.addBox(0, 0, 0, 1, 1, 1))], [(3, maker.addSphere(0.5, 0.5, 0.5, 0.25))])
    maker.synchronize()
    gmsh.option.setNumber("Mesh.RecombineAll", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)
    return size


CASES = {
    "triangles": (2, lambda nodes: planar(nodes, False), "hold"),
    "triangles, sliding": (2, lambda nodes: planar(nodes, False), "slide"),
    "quads": (2, lambda nodes: planar(nodes, True), "hold"),
    "tetrahedra": (3, volume, "hold"),
}


def throw(dimension: int, far: float) -> None:
    rng = np.random.default_rng(0)
    for dim, tag in gmsh.model.getEntities(dimension):
        tags, points, _ = gmsh.model.mesh.getNodes(dim, tag)
        new = points.reshape(-1, 3).copy()
        new[:, :dimension] += far * rng.uniform(-1, 1, size=(len(new), dimension))
        for node, place in zip(tags.tolist(), new, strict=True):
            gmsh.model.mesh.setNode(node, place, [])


def timed(work):
    began = time.perf_counter()
    return work(), time.perf_counter() - began


def carried_out(name: str, nodes: float) -> str:
    """The row of one case."""
    dimension, make, on_geometry = CASES[name]
    gmsh.clear()
    gmsh.model.add(name)
    size, meshing = timed(lambda: make(nodes))
    throw(dimension, THROWN[dimension] * size)
    live, reading = timed(lambda: read(gmsh, None))
    result, whole = timed(lambda: gmsnet.gmsh.smooth(on_geometry=on_geometry))
    _, setting = timed(lambda: set_points(gmsh, live, result.points, result.moved))
    tags, points, _ = gmsh.model.mesh.getNodes()
    order, own = np.argsort(tags), np.argsort(live.tags)
    points = points.reshape(-1, 3)[order]
    exact = np.array_equal(points, result.points[own])
    gmsh.model.mesh.relocateNodes()
    after = gmsh.model.mesh.getNodes()[1].reshape(-1, 3)[order]
    before, now = result.before.shape.min(), result.after.shape.min()
    return (
        f"| {name} | {len(tags):,} | {meshing:.1f} s | {reading:.2f} s | {result.seconds:.2f} s | {whole:.2f} s "
        f"| {setting:.2f} s | {before:.3f} → {now:.3f} | {exact} | {np.abs(after - points).max():.0e} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nodes", type=float, default=1e5)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    given = parser.parse_args()
    print(describe())
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    print("| model | nodes | Gmsh meshes it | read | smooth | all | of it set back | least 1/q | exact | relocated |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name in given.cases:
        carried_out(name, 2000)  # compiles
        print(carried_out(name, given.nodes), flush=True)
    gmsh.finalize()


if __name__ == "__main__":
    main()
