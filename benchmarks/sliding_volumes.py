"""Tetrahedra whose boundary nodes slide, beside the same with a boundary that stays.

    python benchmarks/sliding_volumes.py [FILE ...]

Without files: a box and an L-shaped part of cubes of six tetrahedra each, whose nodes are thrown by up to 0.35 cubes,
along their sides where they lie on any; a part with a cylindrical and a spherical hole; a ball of random nodes. Figures
are over all cells. Times are of the processor, one thread, the least of REPEATS.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from itertools import permutations
from pathlib import Path

import numpy as np
from machine import describe
from scipy.spatial import Delaunay

import gmsnet
from gmsnet.generate.marked_volume import outer_faces
from gmsnet.generate.volumes import determinants, part_volume
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

REPEATS = 3
Keep = Callable[[np.ndarray], np.ndarray]


def thrown(cells: int, keep: Keep, share: float = 0.35, seed: int = 0) -> Mesh:
    """Those of cells³ cubes that are kept, six tetrahedra each, in a unit cube; their nodes are thrown."""
    place = np.arange((cells + 1) ** 3).reshape(cells + 1, cells + 1, cells + 1)
    points, cubes = np.argwhere(place >= 0) / cells, np.argwhere(place[1:, 1:, 1:] >= 0)
    cubes = cubes[keep(cubes)]
    corners = [np.cumsum([np.zeros(3, dtype=int), *way], axis=0) for way in permutations(np.eye(3, dtype=int))]
    rows = np.concatenate([place[tuple((cubes[:, None] + way).transpose(2, 0, 1))] for way in corners])
    turned = determinants(points, rows) < 0.0
    rows[turned] = rows[turned][:, [0, 2, 1, 3]]
    used, rows = np.unique(rows, return_inverse=True)
    points, rows = points[used], rows.reshape(-1, 4)
    on = np.zeros(points.shape, dtype=bool)
    for face in outer_faces({"tetra": rows})["triangle"]:
        on[face] |= np.ptp(points[face], axis=0) == 0.0
    shift = np.where(on, 0.0, np.random.default_rng(seed).uniform(-share, share, points.shape) / cells)
    while (low := determinants(points + shift, rows) < 0.02 / cells**3).any():
        shift[rows[low]] *= 0.6
    return mesh_of(points + shift, rows)


def ball(nodes: int, seed: int = 0) -> Mesh:
    """The Delaunay tetrahedra of random nodes on the unit sphere and inside."""
    random = np.random.default_rng(seed)
    outer = random.normal(size=(4 * round(nodes ** (2 / 3)), 3))
    inner = random.uniform(-1.0, 1.0, (3 * nodes, 3))
    inner = inner[np.linalg.norm(inner, axis=1) < 0.9][:nodes]
    points = np.concatenate([outer / np.linalg.norm(outer, axis=1)[:, None], inner])
    rows = Delaunay(points).simplices.astype(np.int64)
    turned = determinants(points, rows) < 0.0
    rows[turned] = rows[turned][:, [0, 2, 1, 3]]
    return mesh_of(points, rows[determinants(points, rows) > 1e-6 / nodes])


def mesh_of(points: np.ndarray, rows: np.ndarray) -> Mesh:
    """One region of tetrahedra."""
    return Mesh(points, (CellBlock("tetra", rows, np.zeros(len(rows), dtype=np.int64)),))


def meshes(files: list[str]) -> Iterator[tuple[str, Mesh]]:
    """Names and meshes."""
    for file in files:
        yield Path(file).name, gmsnet.read(file)
    if not files:
        yield "box", thrown(12, lambda cube: np.ones(len(cube), dtype=bool))
        yield "L-shaped part", thrown(12, lambda cube: (cube[:, :2] < 6).any(axis=1))
        yield "part with holes", part_volume(16)
        yield "ball", ball(4000)


def run(name: str, mesh: Mesh) -> None:
    """One mesh."""
    print(f"\n{name}: {len(mesh.points):,} nodes")
    for slide in (None, True):
        seconds = []
        for _ in range(REPEATS):
            began = time.process_time()
            result = gmsnet.smooth(mesh, slide=slide, threads=1)
            seconds.append(time.process_time() - began)
        if slide is None:
            print(f"  input   {figures(result.before)}")
        told = [note for note in result.notes if note.startswith("slide: ")]
        print(
            f"  {'slides' if slide else 'stays '}  {figures(result.after)}, {min(seconds):.3f} s", *told, sep="\n    "
        )


def figures(report: gmsnet.QualityReport) -> str:
    """Over all cells."""
    low, high = report.min_dihedral.min(), report.max_dihedral.max()
    return f"least η {report.shape.min():.4f}, mean η {report.shape.mean():.4f}, dihedral {low:.1f}–{high:.1f}°"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*")
    print(describe())
    for name, mesh in meshes(parser.parse_args().files):
        run(name, mesh)


if __name__ == "__main__":
    main()
