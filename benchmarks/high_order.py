"""gmsnet.smooth beside Gmsh's optimisers of second-order tetrahedra.

    python benchmarks/high_order.py [--threshold 0.1]

Spheres and boxes with holes by Gmsh, without its own optimisation. Told are the cells, the least ``minSJ`` as Gmsh
measures it with how many are not positive, and seconds of the processor of the whole call on one thread. Gmsh's tools
may move the boundary along the CAD; ``HighOrder`` is tried with the boundary fixed, too, in a process of its own, for
it may end the program. --threshold is its Mesh.HighOrderThresholdMin.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import gmsh
import numpy as np
from machine import describe

import gmsnet

PARTS = ("sphere", "box with a cylinder's hole", "box with a ball's hole")
SIZES = (0.55, 0.35)
Found = tuple[np.ndarray, float]


def make(part: str, size: float) -> None:
    """The mesh of a part in the live model."""
    gmsh.clear()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.HighOrderOptimize", 0)
    occ = gmsh.model.occ
    if part == PARTS[0]:
        occ.addSphere(0, 0, 0, 1)
    else:
        box = occ.addBox(-1, -1, -1, 2, 2, 2)
        hole = occ.addCylinder(0, 0, -1, 0, 0, 2, 0.5) if part == PARTS[1] else occ.addSphere(0, 0, 0, 0.5)
        occ.cut([(3, box)], [(3, hole)])
    occ.synchronize()
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)


def measured() -> np.ndarray:
    """Gmsh's minSJ of all volume cells of the live model."""
    return np.asarray(gmsh.model.mesh.getElementQualities(np.concatenate(gmsh.model.mesh.getElements(3)[1]), "minSJ"))


def as_it_is() -> None:
    """The mesh without any optimiser."""


def ours() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mesh.msh")
        gmsh.write(str(path))
        mesh = gmsnet.read(path)
        gmsnet.smooth(mesh, threads=1)  # compiles
        began = time.process_time()
        points = gmsnet.smooth(mesh, threads=1).points
        ours.seconds = time.process_time() - began
        gmsnet.write(mesh.with_points(points), path)
        gmsh.clear()
        gmsh.open(str(path))


def gmsh_by(name: str, fixed: bool, threshold: float) -> Callable[[], None]:
    def optimise() -> None:
        gmsh.option.setNumber("Mesh.HighOrderFixBoundaryNodes", int(fixed))
        gmsh.option.setNumber("Mesh.HighOrderThresholdMin", threshold)
        gmsh.model.mesh.optimize(name)

    return optimise


def run(part: str, size: float, tool: str, threshold: float) -> Found:
    """minSJ of the cells, and the seconds."""
    gmsh.initialize()
    make(part, size)
    tools = {
        "input": as_it_is,
        "gmsnet": ours,
        "HighOrder": gmsh_by("HighOrder", False, threshold),
        "HighOrder, boundary fixed": gmsh_by("HighOrder", True, threshold),
        "HighOrderElastic": gmsh_by("HighOrderElastic", False, threshold),
    }
    began = time.process_time()
    tools[tool]()
    seconds = ours.seconds if tool == "gmsnet" else time.process_time() - began
    return measured(), seconds


def main() -> None:
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--threshold", type=float, default=0.1)
    options = parser.parse_args()
    print(describe())
    for part in PARTS:
        for size in SIZES:
            for tool in ("input", "gmsnet", "HighOrder", "HighOrder, boundary fixed", "HighOrderElastic"):
                with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
                    try:
                        found, seconds = pool.submit(run, part, size, tool, options.threshold).result()
                    except BrokenProcessPool:
                        print(f"{part:28}{size:5} {tool:27} ended its program", flush=True)
                        continue
                invalid = int((found <= 0.0).sum())
                print(
                    f"{part:28}{size:5} {tool:27}{len(found):6}{found.min():9.4f}{invalid:4}{seconds:8.3f}", flush=True
                )


if __name__ == "__main__":
    main()
