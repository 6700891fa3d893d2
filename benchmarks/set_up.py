"""What comes before the first sweep: arrays to a mesh, its topology, stars, and the coordinates in memory order.

    python benchmarks/set_up.py [--nodes 1e4 1e5 1e6] [--repeats 15] [--json FILE]

Nanoseconds per node, on one thread, and in L, a sweep of SciPy's sparse averaging matrix over the coordinates in the
same memory order: medians of seconds of the thread, in turns. The mesh is a random square (Delaunay of uniform points)
whose nodes and cells stand in random order. Memory: what the process has at most during the set-up more than before
it, which includes the mesh's own copies of points and cells, 64 bytes a node; each size in a process of its own, where
the system tells (Linux). At the end, what the kernels of the set-up take to compile, each with what it calls.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
from machine import describe
from sweeps import averaging_matrix

import gmsnet
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.selection import fixed_mask
from gmsnet.topology.ordering import near_points
from gmsnet.topology.topology import Topology

ROW_OF_L = 5  # sweeps of L that are timed at once
STATUS, RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def stages(arrays):
    """The set-up, stage by stage: yields the name of each once it is done."""
    mesh, _ = to_mesh(arrays)
    fixed = fixed_mask(mesh)
    yield "to_mesh"
    topology = Topology.of(mesh, fixed)
    yield "topology"
    topology.stars  # noqa: B018 (made when it is first asked for)
    yield "stars"
    topology.changeable, topology.near_free, topology.near_ringed  # noqa: B018
    near_points(mesh, topology)
    yield "the rest"


def arrays_of(nodes):
    mesh = gmsnet.random_mesh(nodes, seed=1)
    return mesh.points.copy(), mesh.cells[0].nodes.copy()


def timed(nodes, repeats):
    """Medians: stage → ns per node, and L."""
    arrays = arrays_of(nodes)
    mesh, _ = to_mesh(arrays)
    topology = Topology.of(mesh)
    matrix, points = averaging_matrix(topology), near_points(mesh, topology)
    found = {}
    for _ in range(repeats + 1):
        began = time.thread_time()
        for name in stages(arrays):
            found.setdefault(name, []).append(time.thread_time() - began)
            began = time.thread_time()
        product = points
        began = time.thread_time()
        for _ in range(ROW_OF_L):
            product = matrix @ product
        found.setdefault("L", []).append((time.thread_time() - began) / ROW_OF_L)
    return {name: median(seconds[1:]) / len(points) * 1e9 for name, seconds in found.items()}


def status(name):
    return int(re.search(rf"{name}:\s+(\d+)", STATUS.read_text())[1]) * 1024


def most_memory(nodes):
    """Bytes per node at the peak of the set-up, in this process; None where the system does not tell."""
    list(stages(arrays_of(1000)))  # what is compiled or loaded at first does not count
    with tempfile.TemporaryDirectory() as folder:
        # Made elsewhere, lest memory that was used for making the mesh be used again.
        subprocess.run([sys.executable, __file__, "--make", folder, "--nodes", str(nodes)], check=True)
        arrays = tuple(np.load(Path(folder) / f"{name}.npy") for name in ("points", "cells"))
    if not RESET.exists():
        return None
    before = status("VmRSS")
    RESET.write_text("5")
    list(stages(arrays))
    return (status("VmHWM") - before) / len(arrays[0])


def compile_seconds():
    """Kernel → seconds, with nothing cached."""
    from numba.core import event

    class Listener(event.Listener):
        def __init__(self):
            self.seconds, self.open = {}, []

        def on_start(self, event):
            self.open.append((event.data["dispatcher"].py_func.__name__, time.thread_time()))

        def on_end(self, event):
            name, began = self.open.pop()
            if not self.open:
                self.seconds[name] = self.seconds.get(name, 0.0) + time.thread_time() - began

    listener = Listener()
    arrays = arrays_of(1000)
    with event.install_listener("numba:compile", listener):
        list(stages(arrays))
    return listener.seconds


def elsewhere(option, nodes, **environment):
    """What this script prints with an option, in a process of its own."""
    command = [sys.executable, __file__, option, "--nodes", str(nodes)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, env=os.environ | environment).stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e4, 1e5, 1e6])
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--json")
    for option in ("--memory", "--compile"):
        parser.add_argument(option, action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--make", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    sizes = [int(nodes) for nodes in options.nodes]
    if options.make:
        points, cells = arrays_of(sizes[0])
        np.save(options.make / "points.npy", points)
        np.save(options.make / "cells.npy", cells)
    elif options.memory:
        print(json.dumps(most_memory(sizes[0])))
    elif options.compile:
        print(json.dumps(compile_seconds()))
    else:
        report(sizes, options.repeats, options.json)


def report(sizes, repeats, file):
    print(describe())
    rows = {}
    print(f"\n  {'nodes':>9}   to_mesh  topology     stars  the rest       all              L   memory")
    for nodes in sizes:
        row = rows[nodes] = timed(nodes, repeats) | {"bytes": elsewhere("--memory", nodes)}
        names = ("to_mesh", "topology", "stars", "the rest")
        total = sum(row[name] for name in names)
        memory = "" if row["bytes"] is None else f"{row['bytes']:5.0f} B"
        columns = "".join(f"{row[name]:7.0f} ns" for name in names)
        print(f"  {nodes:9,}{columns}{total:7.0f} ns = {total / row['L']:4.1f} L {row['L']:4.1f} ns  {memory}")
    with tempfile.TemporaryDirectory() as folder:
        seconds = elsewhere("--compile", sizes[0], GMSNET_CACHE=folder)
    print(f"\n  {sum(seconds.values()):.1f} s to compile: " + ", ".join(f"{k} {v:.2f}" for k, v in seconds.items()))
    if file:
        document = {"machine": describe(), "set-up": rows, "compile": seconds}
        Path(file).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
