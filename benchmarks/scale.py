"""How time and memory grow with the mesh and with threads, beside what the machine's memory can do.

    python benchmarks/scale.py [--nodes 1e4 1e5 1e6] [--threads 1 2] [--rounds 9] [--patience 60] [--json FILE]
    python benchmarks/scale.py --nodes 1e5 1e7 --keep FOLDER       # 1e7: five minutes for the mesh, 5 GB
    python benchmarks/scale.py --volumes                           # of tetrahedra; 1e6: ten minutes for the mesh

For each size: nanoseconds per node of one sweep of some methods and of a whole call of ``gmsnet.smooth`` (arrays in,
arrays and both reports out), with each number of threads, all in turns; the least of the rounds is printed. The points
must be the same bits for any number of threads. Bytes per node: the peak of a process of its own during one call,
beyond what it held before, the input arrays among that; what a first call leaves behind (compiled code) does not count.

Others may use the machine at the same time. What they use is measured with each sample (Linux); a round begins once
they use less than a twentieth, or when ``--patience`` seconds have passed; samples with less than that are preferred,
and the share that others had in the sample that is printed stands beside it.

The meshes are random squares (Delaunay of uniform points), nodes and cells in random order; those of more than two
million nodes are put together of squares of about a million. ``--keep`` keeps them for the next run. ``--volumes``
takes random cubes of tetrahedra instead, Delaunay of uniform points.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
from machine import describe, others_use
from set_up import RESET, status

import gmsnet
from gmsnet.generate.volumes import random_volume
from gmsnet.kernels.jit.compile import LANES, kernel
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.star.space_blocks import LANES3, SpaceBlocks
from gmsnet.mesh.adapters import to_mesh
from gmsnet.methods import Field, smoother
from gmsnet.parallel.threads import workers
from gmsnet.topology import ordering
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

METHODS = {False: ("laplacian", "barrier", "gmsnet"), True: ("laplacian", "barrier")}  # in space?
TILE, LINE = 10**6, 64  # nodes; bytes
QUIET = 0.05  # of the machine
ENOUGH = 4 * 10**6  # nodes in a sample of sweeps: a tenth of a second, for what others use is told in hundredths
STREAM = 2**24  # float64 in each array of the copy and of the triad: 128 MiB


def square(nodes, seed=1):
    """Points and cells of a random square."""
    side = round((nodes / TILE) ** 0.5) if nodes > 2 * TILE else 1
    points, cells, count = [], [], 0
    for tile in range(side * side):
        mesh = gmsnet.random_mesh(round(nodes / side**2), seed=seed + tile)
        points.append(mesh.points + np.array([tile % side, tile // side]))
        cells.append(mesh.cells[0].nodes + count)
        count += len(mesh.points)
    points, cells = np.concatenate(points), np.concatenate(cells)
    rim = np.flatnonzero((np.abs(points - np.rint(points)) < 1e-12).any(axis=1))  # nodes evenly spaced: tiles match
    _, first, same = np.unique(np.rint(points[rim] * 2.0**30), axis=0, return_index=True, return_inverse=True)
    number = np.arange(len(points))
    number[rim] = rim[first][same.ravel()]
    kept = np.flatnonzero(number == np.arange(len(points)))
    order = np.random.default_rng(seed)
    place, shuffled = np.empty(len(points), dtype=np.int64), np.empty((len(kept), 2))
    place[kept] = order.permutation(len(kept))
    shuffled[place[kept]] = points[kept] / side
    cells = place[number[cells]]
    order.shuffle(cells)
    return shuffled, cells


def cube(nodes, seed=1):
    """Points and cells of a random cube, in random order."""
    mesh = random_volume(nodes, seed=seed)
    order = np.random.default_rng(seed)
    place = order.permutation(len(mesh.points))
    points = np.empty_like(mesh.points)
    points[place] = mesh.points
    cells = place[next(block for block in mesh.cells if block.kind == "tetra").nodes]
    order.shuffle(cells)
    return points, [("tetra", cells)]


def arrays_of(nodes, folder, volumes):
    """Points and cells, from the folder if they are there."""
    made, prefix = (cube, "volume-") if volumes else (square, "")
    files = [Path(folder) / f"{prefix}{name}-{nodes}.npy" for name in ("points", "cells")]
    if not all(file.exists() for file in files):
        points, cells = made(nodes)
        for file, array in zip(files, (points, cells[0][1] if volumes else cells), strict=True):
            np.save(file, array)
    points, cells = (np.load(file) for file in files)
    return points, [("tetra", cells)] if volumes else cells


class Samples:
    """Seconds of some jobs, in turns, and the share of the machine that others used meanwhile."""

    def __init__(self, jobs):
        self.jobs, self.taken = jobs, {name: [] for name in jobs}

    def take(self, rounds, patience):
        """So many rounds, after one that does not count."""
        for job in self.jobs.values():
            job()
        for _ in range(rounds):
            until = time.perf_counter() + patience / rounds
            while time.perf_counter() < until and others_use(lambda: time.sleep(0.5))[1] > QUIET:
                pass
            for name, job in self.jobs.items():
                self.taken[name].append(others_use(job))
        return self

    def least(self):
        """Name → seconds and the share of others, of the quickest quiet sample, or of the quickest of all."""
        found = {}
        for name, taken in self.taken.items():
            quiet = [sample for sample in taken if sample[1] <= QUIET]
            found[name] = min(quiet or taken)
        return found


def sweeps(arrays, threads, rounds, patience):
    """(method, threads) → ns per node, others' share; and the bytes per node that the caches must exchange for one."""
    mesh, _ = to_mesh(arrays)
    volumes = mesh.has_volumes
    topology = Volume.of(mesh) if volumes else Topology.of(mesh)
    points = (
        ordering.taken(ordering.space_points(mesh), topology.memory)
        if volumes
        else ordering.near_points(mesh, topology)
    )
    lanes, _ = LANES3 if volumes else LANES, topology.stars  # made before, as in a call
    del mesh
    found, often = {}, math.ceil(ENOUGH / len(points) / (10 if volumes else 1))
    for method in METHODS[volumes]:
        fields, jobs, pools = {}, {}, []
        for count in threads:
            pools.append(workers(count))
            executor, chosen = pools[-1].__enter__().for_blocks(len(topology.free) // lanes), smoother(method)
            field = fields[count] = Field(points.copy(), topology, Precision())

            def sweep(chosen=chosen, executor=executor, field=field):
                for _ in range(often):
                    chosen.sweep(field, executor, lambda: True)

            jobs[count] = sweep
        for count, (seconds, of_others) in Samples(jobs).take(rounds, patience).least().items():
            found[method, count] = seconds / often / len(points) * 1e9, of_others
        for pool in pools:
            pool.__exit__(None, None, None)
        assert all((field.points == fields[threads[0]].points).all() for field in fields.values()), method
    return found, traffic(topology) / len(points)


def traffic(topology):
    """Bytes that a sweep moves if a colour finds no coordinates in the cache: their lines once each, and indices."""
    blocks, first, lines = topology.stars.blocks, topology.stars.first, 0
    if isinstance(blocks, SpaceBlocks):
        rings, lanes, spokes = blocks.ring, LANES3, blocks.spoke.nbytes
    else:
        rings, lanes, spokes = blocks.rings, LANES, 0
    nodes = LINE // (32 if spokes else 16)  # in a line
    ends = np.append(blocks.offset, len(rings))
    for start, end in pairwise(first):
        centres = np.unique(blocks.centre[start * lanes : end * lanes] // nodes)
        around = np.unique(rings[ends[start] : ends[end]] // nodes)
        lines += len(np.union1d(centres, around)) + len(centres)  # what is read, what is written back
    return lines * LINE + rings.nbytes + blocks.centre.nbytes + spokes


def calls(arrays, threads, rounds, patience):
    """Threads → ns per node of a whole call, others' share."""
    found, often = {}, math.ceil(ENOUGH / 20 / len(arrays[0]))

    def call(count):
        for _ in range(often):
            found[count] = gmsnet.smooth(arrays, threads=count).points

    least = Samples({count: lambda count=count: call(count) for count in threads}).take(rounds, patience).least()
    assert all((points == found[threads[0]]).all() for points in found.values())
    return {count: (seconds / often / len(arrays[0]) * 1e9, share) for count, (seconds, share) in least.items()}


def peak(arrays, count):
    """Bytes per node at the peak of a call in this process; None where the system does not tell."""
    gmsnet.smooth(
        (cube if arrays[0].shape[1] == 3 else square)(1000), threads=count
    )  # little, lest memory be at hand that was used for it
    if not RESET.exists():
        return None
    before = status("VmRSS")
    RESET.write_text("5")
    gmsnet.smooth(arrays, threads=count)
    return (status("VmHWM") - before) / len(arrays[0])


@kernel
def copy(a, b, c, first, last):
    """a = b."""
    for i in range(first, last):
        a[i] = b[i]


@kernel
def triad(a, b, c, first, last):
    """a = b + 3c."""
    for i in range(first, last):
        a[i] = b[i] + 3.0 * c[i]


def bandwidth(threads, rounds, patience):
    """(what, threads) → GB/s, others' share: of arrays that no cache holds; what is written is read first, too."""
    arrays = [np.full(STREAM, float(k)) for k in range(3)]

    def stream(work, count):
        ends = [STREAM * k // count for k in range(count + 1)]
        others = [threading.Thread(target=work, args=(*arrays, *ends[k : k + 2])) for k in range(1, count)]
        for other in others:
            other.start()
        work(*arrays, 0, ends[1])
        for other in others:
            other.join()

    jobs = {(w, n): lambda w=w, n=n: stream(w, n) for w in (copy, triad) for n in threads}
    passes = {copy: 3, triad: 4}
    least = Samples(jobs).take(rounds, patience).least()
    return {
        (work.__name__, n): (passes[work] * 8 * STREAM / seconds / 1e9, share)
        for (work, n), (seconds, share) in least.items()
    }


def in_words(figures, unit):
    return "   ".join(f"{name}: {value:.1f} {unit} (others {share:.0%})" for name, (value, share) in figures.items())


def report(sizes, threads, rounds, patience, folder, file, volumes):
    print(describe())
    streams = bandwidth(threads, rounds, patience)
    for name in ("copy", "triad"):
        print(f"{name}, threads  {in_words({n: streams[name, n] for n in threads}, 'GB/s')}")
    rows = []
    for nodes in sizes:
        arrays = arrays_of(nodes, folder, volumes)
        count = len(arrays[0])
        found, moved = sweeps(arrays, threads, rounds, patience)
        whole = calls(arrays, threads, rounds if count < TILE else 3, patience)
        del arrays
        command = [sys.executable, __file__, "--keep", str(folder), "--nodes", str(nodes), "--memory"]
        command += ["--volumes"] * volumes + ["--threads"]
        held = {n: json.loads(subprocess.check_output([*command, str(n)])) for n in threads}
        print(f"\n{count:,} nodes; ns per node, by threads")
        for method in METHODS[volumes]:
            own = {n: found[method, n] for n in threads}
            gain = own[threads[0]][0] / own[threads[-1]][0]
            rates = ", ".join(f"{moved / own[n][0]:.1f}" for n in threads)
            print(f"  {method:12} {in_words(own, 'ns')}   {gain:.2f} times as fast   at most {rates} GB/s")
        gain = whole[threads[0]][0] / whole[threads[-1]][0]
        print(f"  {'whole call':12} {in_words(whole, 'ns')}   {gain:.2f} times as fast")
        print(f"  a sweep moves at most {moved:.0f} bytes per node; peak memory, bytes per node, by threads: {held}")
        rows.append(
            {
                "nodes": count,
                "sweeps": [{"method": m, "threads": n, "ns": v, "others": s} for (m, n), (v, s) in found.items()],
                "call": [{"threads": n, "ns": v, "others": s} for n, (v, s) in whole.items()],
                "bytes moved": moved,
                "peak bytes": held,
            }
        )
    if file:
        streams = [{"what": w, "threads": n, "GB/s": v, "others": s} for (w, n), (v, s) in streams.items()]
        document = {"machine": describe(), "bandwidth": streams, "sizes": rows}
        Path(file).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e4, 1e5, 1e6])
    parser.add_argument("--threads", nargs="+", type=int, default=sorted({1, min(2, os.cpu_count() or 1)}))
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--patience", type=float, default=60.0)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--json")
    parser.add_argument("--volumes", action="store_true", help="tetrahedra")
    parser.add_argument("--memory", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    sizes = [int(nodes) for nodes in options.nodes]
    if options.memory:
        print(json.dumps(peak(arrays_of(sizes[0], options.keep, options.volumes), options.threads[0])))
        return
    with tempfile.TemporaryDirectory() as folder:
        if options.keep:
            options.keep.mkdir(parents=True, exist_ok=True)
        folder = options.keep or Path(folder)
        report(sizes, options.threads, options.rounds, options.patience, folder, options.json, options.volumes)


if __name__ == "__main__":
    main()
