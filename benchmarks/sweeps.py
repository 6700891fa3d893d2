"""Nanoseconds per node and sweep, and for the set-up, beside a SciPy sparse-matrix Laplacian sweep in the same run.

    python benchmarks/sweeps.py [--nodes 1e4 1e5 1e6] [--threads 1 2] [--methods laplacian …] [--guards worst valid]
        [--repeats 9] [--json FILE]

L is the unit: one product of the averaging matrix with the coordinates, on one thread, nodes in the same memory order.
All are timed in turns, and medians are printed, because machines are noisy. Medians do not show the looks at all cells
that the guard ``worst`` takes in one sweep of three to twelve. The mesh is a random square (Delaunay of uniform points)
whose nodes stand in the file in random order.
"""

from __future__ import annotations

import argparse
import json
import time
from contextlib import ExitStack
from itertools import product
from statistics import median

import numpy as np
import scipy.sparse
from machine import describe

import gmsnet
from gmsnet.kernels.star.guard import LEVELS, Precision
from gmsnet.measure.totals import totals_of
from gmsnet.methods import METHODS, Field, smoother
from gmsnet.parallel.threads import workers
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology


def averaging_matrix(topology):
    """Row i averages the ring of node i where it is free, and keeps it where it is held; by places in memory."""
    start, ring = topology.near_start, topology.near_ring
    nodes = len(start) - 1
    degree = np.diff(start)
    held = np.flatnonzero(degree == 0)
    rows = np.concatenate([np.repeat(np.arange(nodes), degree), held])
    columns = np.concatenate([ring, held])
    values = np.concatenate([np.repeat(1.0 / np.maximum(degree, 1), degree), np.ones(len(held))])
    return scipy.sparse.csr_matrix((values, (rows, columns)), shape=(nodes, nodes))


def timed(work):
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def measure(nodes, threads, repeats, methods, guards):
    mesh = gmsnet.random_mesh(nodes, seed=0)
    topology = Topology.of(mesh)
    stars = topology.stars
    points = planar_points(mesh)[topology.memory]
    matrix = averaging_matrix(topology)
    jobs = {
        "L": lambda: matrix @ points,
        "set-up": lambda: Topology.of(mesh).stars,
        "measures": lambda: totals_of(points, topology.scored),
    }
    stack = ExitStack()
    for name, method in METHODS.items():
        if name == "auto" or (methods and name not in methods):  # a plan of sweeps of others, which ends
            continue
        for variant in method.variants or [None]:
            for count, guard in product(threads, guards):
                executor = stack.enter_context(workers(count)).for_blocks(len(stars.blocks.filled))
                chosen = smoother(name, variant=variant)
                field = Field(points.copy(), topology, Precision(), LEVELS.index(guard))

                def sweep(chosen=chosen, executor=executor, field=field):
                    chosen.sweep(field, executor, lambda: True)

                label = f"{name} {variant}" if variant else name
                jobs[f"{label}, {guard}, {count} thread{'s' * (count > 1)}"] = sweep
    seconds = {name: [] for name in jobs}
    for _ in range(repeats + 1):
        for name, job in jobs.items():
            seconds[name].append(timed(job))
    stack.close()
    return {name: median(values[1:]) / nodes * 1e9 for name, values in seconds.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e4, 1e5, 1e6])
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--methods", nargs="+", choices=sorted(METHODS))
    parser.add_argument("--guards", nargs="+", choices=LEVELS, default=["worst", "valid"])
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--json")
    options = parser.parse_args()
    print(describe())
    print(f"medians of {options.repeats} runs in turns; ns per node (per sweep), and in units of L")
    results = {}
    for nodes in map(int, options.nodes):
        results[nodes] = figures = measure(nodes, options.threads, options.repeats, options.methods, options.guards)
        print(f"\n{nodes:,} nodes")
        for name, value in figures.items():
            print(f"  {name:44} {value:8.1f} ns   {value / figures['L']:6.2f} L")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"machine": describe(), "ns_per_node": results}, file, indent=1)


if __name__ == "__main__":
    main()
