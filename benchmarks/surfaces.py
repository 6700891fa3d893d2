"""gmsnet.smooth on surfaces in space beside other tools that keep the connectivity, in one table.

    python benchmarks/surfaces.py [--meshes NAME ...] [--tools NAME ...] [--nodes 5000] [--python OTHER]

Each tool runs in a process of its own. --python: an interpreter that has the other tools (mmgpy, pyvista, trimesh,
pymeshlab, libigl); gmsnet runs in this one. A tool that is not there is left out, and said so. Seconds are those of the
tool's own call on one thread, gmsnet's after a first one that compiles. Figures are of the geometric 1/q; distances are
those of the result's facets from the input's, over the diagonal.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from machine import describe
from peers.surface_tools import TOOLS

import gmsnet
from gmsnet import generate
from gmsnet.generate import disturb_on
from gmsnet.measure.surface_change import Compared, surface_change

MADE = {
    "sphere": "sphere_surface", "torus": "torus_surface", "cylinder": "cylinder", "cone": "cone_surface",
    "organic": "organic_surface", "bracket": "bracket",
}  # fmt: skip
FILES = ("sph.vtk", "42400-IDGH.stl", "hemisphere.off", "maxFace.obj", "footbones.ply")
OURS = "gmsnet"


def arrays(name: str, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles."""
    if name in MADE:
        mesh = disturb_on(getattr(generate, MADE[name])(nodes), 0.4, seed=1).mesh
    else:
        mesh = gmsnet.read(Path(os.environ["GMSNET_MESHES"], name))
    rows = np.concatenate([block.nodes for block in mesh.cells if block.kind == "triangle"]).astype(np.int64)
    ids, rows = np.unique(rows, return_inverse=True)
    return mesh.points[ids].astype(float), rows.reshape(-1, 3)


def shapes(points: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The geometric 1/q of triangles."""
    a, b, c = points[rows].transpose(1, 0, 2)
    lengths = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return 2.0 * np.sqrt(3.0) * area / np.maximum(lengths, np.finfo(float).tiny)


def row(tool: str, points: np.ndarray, rows: np.ndarray, program: str) -> str:
    with tempfile.TemporaryDirectory() as folder:
        source, target = str(Path(folder, "in.npz")), str(Path(folder, "out.npz"))
        np.savez(source, points=points, rows=rows)
        call = [
            sys.executable if tool.startswith(OURS) else program,
            str(Path(__file__).parent / "peers" / "surface_worker.py"),
        ]
        try:
            done = subprocess.run(
                [*call, tool, source, target], capture_output=True, text=True, timeout=300, check=False
            )
        except subprocess.TimeoutExpired:
            return f"| {tool} | beyond 300 s | | | | |"
        if done.returncode or not Path(target).exists():
            lines = done.stderr.strip().splitlines() or ["no result"]
            return f"| {tool} | left out: {lines[-1][:80]} | | | | |"
        with np.load(target) as found:
            new, seconds = found["points"], float(found["seconds"])
    if len(new) != len(points):
        return f"| {tool} | other nodes: {len(new):,} | | | | |"
    quality, change = shapes(new, rows), surface_change(Compared(rows, points, new))
    assert change is not None
    return (
        f"| {tool} | {quality.min():.3f} | {quality.mean():.3f} | {change.hausdorff / change.diagonal:.2g} | "
        f"{change.normal:.0f}° | {seconds:.3f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", nargs="*", default=[*MADE])
    parser.add_argument("--tools", nargs="*", default=[*TOOLS])
    parser.add_argument("--nodes", type=int, default=5000)
    parser.add_argument("--python", default=sys.executable)
    given = parser.parse_args()
    print(describe())
    for name in given.meshes:
        points, rows = arrays(name, given.nodes)
        quality = shapes(points, rows)
        print(f"\n**{name}**, {len(points):,} nodes, {len(rows):,} triangles\n")
        print("| tool | least 1/q | mean 1/q | Hausdorff | normals turn | seconds |\n|---|---|---|---|---|---|")
        print(f"| input | {quality.min():.3f} | {quality.mean():.3f} | | | |", flush=True)
        for tool in given.tools:
            print(row(tool, points, rows, given.python), flush=True)


if __name__ == "__main__":
    main()
