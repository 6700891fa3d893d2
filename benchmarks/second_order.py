"""Second-order meshes: how many cells are valid, and how good straight cells are, before and after smoothing.

    PYTHONPATH=tests GMSNET_MESHES=… GMSNET_REFEREE=… python benchmarks/second_order.py [--meshes 200] [--method auto]

First the files of GMSNET_MESHES with second-order cells, as they are and with inner nodes thrown. Then curved meshes as
the tests generate them; those of even numbers are thrown into invalid cells from a mesh that is valid. Each is written,
smoothed, and given to the independent referee that GMSNET_REFEREE names (``compare``). Columns: cells not certified
valid, the least and the mean 1/q of straight cells, and the least certified bound over a straight cell's size.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from support import curved_meshes

import gmsnet
from gmsnet.generate.curved import throw
from gmsnet.mesh.mesh import Mesh

FILES = ("square-disc-p2.vtk", "quadratic_quad.msh", "star-mixed-p2.vtk")


def inputs(meshes: int) -> Iterator[tuple[str, Mesh]]:
    """Names and meshes."""
    folder = os.environ.get("GMSNET_MESHES")
    for name in FILES if folder else ():
        mesh = gmsnet.read(Path(folder or "") / name)
        yield name, mesh
        flat = mesh if mesh.points.shape[1] == 2 else Mesh(mesh.points[:, :2], mesh.cells, mesh.region_names)
        yield f"{name}, thrown", throw(flat, middles=0.4, corners=0.3, seed=1)
    for seed in range(meshes):
        yield f"generated {seed}", (curved_meshes.known_valid if seed % 2 else curved_meshes.thrown)(seed)


def accepted(before: Mesh, after: Mesh, folder: Path) -> str:
    """What the referee says of the two, "" if nothing; "no referee" if there is none."""
    program = os.environ.get("GMSNET_REFEREE")
    if not program:
        return "no referee"
    gmsnet.write(before, folder / "in.vtk")
    gmsnet.write(gmsnet.read(folder / "in.vtk").with_points(_spatial(after.points)), folder / "out.vtk")
    call = [sys.executable, program, "compare", str(folder / "in.vtk"), str(folder / "out.vtk")]
    verdict = subprocess.run(call, capture_output=True, text=True, check=False)
    return "" if verdict.returncode == 0 else verdict.stdout + verdict.stderr


def _spatial(points: np.ndarray) -> np.ndarray:
    return points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))])


def main() -> None:
    """The table, and what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--meshes", type=int, default=200)
    parser.add_argument("--method", default="auto")
    options = parser.parse_args()
    count, shapes, wrong = Counter[str](), [], []
    print(f"{'':34}invalid      least 1/q       mean 1/q        least bound      seconds")
    with tempfile.TemporaryDirectory() as folder:
        for name, mesh in inputs(options.meshes):
            start = time.perf_counter()
            result = gmsnet.smooth(mesh, options.method)
            seconds = time.perf_counter() - start
            before, after = (curved_meshes.judged(each) for each in (mesh, mesh.with_points(result.points)))
            invalid = [int((sign != 1).sum()) for sign, _ in (before, after)]
            bound = [float(quality.min()) for _, quality in (before, after)]
            least = [report.totals.shape_min for report in (result.before, result.after)]
            mean = [report.totals.shape_mean for report in (result.before, result.after)]
            shapes.append([*least, *mean, *bound, bool(invalid[0])])
            count["invalid before"] += invalid[0]
            count["invalid after"] += invalid[1]
            count["meshes invalid before"] += bool(invalid[0])
            count["meshes invalid after"] += bool(invalid[1])
            verdict = accepted(mesh, mesh.with_points(result.points), Path(folder))
            count["refused by the referee"] += bool(verdict)
            if verdict or invalid[1]:
                wrong.append(f"{name}: {invalid[1]} invalid; {verdict}")
            if not name.startswith("generated"):
                pairs = "  ".join(f"{a:7.4f} {b:7.4f}" for a, b in (least, mean, bound))
                print(f"{name:34}{invalid[0]:4} {invalid[1]:4}  {pairs}  {seconds:6.2f}", flush=True)
    table = np.array(shapes[-options.meshes :], dtype=float) if options.meshes else np.empty((0, 7))
    for name, some in (("generated, valid", table[:, 6] == 0), ("generated, invalid", table[:, 6] == 1)):
        if some.any():
            pairs = "  ".join(f"{a:7.4f} {b:7.4f}" for a, b in table[some, :6].mean(axis=0).reshape(3, 2))
            print(f"{name + f' ({some.sum()}), means':45}{pairs}")
    worse = table[:, 1] < table[:, 0] - 1e-12, table[:, 3] < table[:, 2] - 1e-12, table[:, 5] < table[:, 4] - 1e-12
    print("of generated meshes worse in least, mean, bound:", *(int(column.sum()) for column in worse))
    print(", ".join(f"{name}: {number}" for name, number in count.items()))
    print("\n".join(wrong))


if __name__ == "__main__":
    main()
