"""Grids that were deformed as a whole, at three sizes: how near to the even grid a call comes, and in what time.

    python benchmarks/deformed.py [--columns 100 316 1000] [--kinds sheared gently swirled zigzag Kershaw]
        [--cells triangle quad]

Triangles are halves of squares: q̂ can come to 0.3720 and the least 1/q to 0.8660; of quads the least 1/q to 1. Time is
that of a whole call of ``gmsnet.smooth`` with its defaults on one thread, after one on a small mesh. L is one product
of SciPy's sparse matrix that averages the nodes around each free node with the coordinates, in memory order: 10 of them
in a row, over 10, the least of three. Both are seconds of the processor.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from machine import describe
from scipy.sparse import csr_array

import gmsnet
from gmsnet.generate import kershaw_mesh, sheared_mesh, swirled_mesh, zigzag_mesh
from gmsnet.topology.topology import Topology

KINDS = {
    "sheared": lambda columns, cells: sheared_mesh(columns, amplitude=0.9, waves=3, cells=cells),
    "gently": lambda columns, cells: sheared_mesh(columns, amplitude=0.5, waves=1, cells=cells),
    "swirled": lambda columns, cells: swirled_mesh(columns, cells=cells),
    "zigzag": lambda columns, cells: zigzag_mesh(columns, cells=cells),
    "Kershaw": lambda columns, cells: kershaw_mesh(columns, columns),  # of quads, whatever cells are asked for
}
ROW, SMALL = 10, 20


def unit(mesh):
    """L, in seconds."""
    topology = Topology.of(mesh)
    degree = np.diff(topology.near_start)
    share = np.repeat(1.0 / np.maximum(degree, 1), degree)
    matrix = csr_array((share, topology.near_ring, topology.near_start), shape=(len(degree), len(degree)))
    points, found = mesh.points[topology.memory], []
    for _ in range(3):
        began = time.process_time()
        for _ in range(ROW):
            points = matrix @ points
        found.append((time.process_time() - began) / ROW)
    return min(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--columns", nargs="+", type=int, default=[100, 316, 1000])
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--cells", nargs="+", choices=("triangle", "quad"), default=["triangle"])
    options = parser.parse_args()
    print(describe())
    print(f"\n  {'':20} {'nodes':>9}       q̂  least 1/q  mean 1/q  seconds      L  ns of L a node")
    for cells in options.cells:
        for kind in options.kinds:
            gmsnet.smooth(KINDS[kind](SMALL, cells), threads=1)
            for columns in options.columns:
                mesh = KINDS[kind](columns, cells)
                began = time.process_time()
                after = gmsnet.smooth(mesh, threads=1).after
                seconds, product = time.process_time() - began, unit(mesh)
                nodes = len(mesh.points)
                text = f"  {f'{kind}, {cells}s':20} {nodes:9,} {after.qhat:8.4f}  {after.shape.min():9.4f}"
                text += f" {after.shape.mean():9.4f}  {seconds:7.3f} {seconds / product:6.0f}"
                print(f"{text}  {1e9 * product / nodes:6.1f}", flush=True)


if __name__ == "__main__":
    main()
