"""Tangled meshes of tetrahedra whose valid places are known: how many are mended, and what it takes.

python benchmarks/volume_tangles.py [--each 3]

Random cubes, lattices, parts with holes and layered volumes; all free nodes thrown by 0.5, 1, 3 and 6 of their mean
edges, put anywhere in the box of the mesh, into one point, or mirrored at its middle; the boundary stays. Prints a line
for each kind of tangle, and each mesh that is not mended.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import gmsnet
from gmsnet.generate import disturb, lattice_volume, layered_volume, part_volume, random_volume
from gmsnet.topology.volume import Volume

THROWN = (0.5, 1.0, 3.0, 6.0)
FOLDED = ("one point", "mirrored")


def meshes(seed):
    """(name, mesh) of each domain."""
    yield "random 2,000", random_volume(2000, seed=seed)
    yield "random 10,000", random_volume(10_000, seed=seed)
    free = Volume.of(lattice := lattice_volume(10)).free
    yield "lattice 10", disturb(lattice, free, 0.2, seed=seed)
    yield "part 12", part_volume(12 + seed % 3)
    yield "layered 10", layered_volume(10, 6, first=0.1, growth=1.3, seed=seed)


def tangles(mesh, seed):
    """(kind, mesh) of each tangle."""
    free, rng = Volume.of(mesh).free, np.random.default_rng(seed)
    for amount in THROWN:
        yield f"{amount:g} edges", disturb(mesh, free, amount, seed=seed, keep_valid=False)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    for kind in ("anywhere", *FOLDED):
        points = mesh.points.copy()
        if kind == "anywhere":
            points[free] = low + (high - low) * rng.random((len(free), 3))
        elif kind == "one point":
            points[free] = (low + high) / 2 + 1e-3 * (high - low)
        else:
            points[free, 0] = (low + high)[0] - points[free, 0]
        yield kind, mesh.with_points(points)


def main():
    """Runs all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--each", type=int, default=6, help="seeds of each domain")
    seeds = parser.parse_args().each
    gmsnet.smooth(random_volume(200), threads=1)
    found = {}
    for seed in range(seeds):
        for name, mesh in meshes(seed):
            for kind, tangled in tangles(mesh, seed):
                began = time.process_time()
                result = gmsnet.smooth(tangled, threads=1)
                seconds = time.process_time() - began
                left, free = result.after.inverted, len(result.topology.free)
                found.setdefault(kind, []).append((left, seconds / free * 1e4, result.before.inverted))
                if left:
                    print(
                        f"{name}, seed {seed}, {kind}: {left} of {result.before.inverted} left; {result.notes}",
                        flush=True,
                    )
    print("| tangle | meshes | mended | s of CPU for 1e4 nodes, median, most |\n|---|---|---|---|")
    for kind, rows in found.items():
        left, seconds, _ = map(np.array, zip(*rows, strict=True))
        print(f"| {kind} | {len(rows)} | {(left == 0).sum()} | {np.median(seconds):.2f}, {seconds.max():.2f} |")


if __name__ == "__main__":
    main()
