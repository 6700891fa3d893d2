"""What ranks cost: seconds and messages of a sweep, and memory, of a grid of triangles that no rank ever has whole.

    mpiexec -n 2 python benchmarks/ranks.py --nodes 1e6
    python benchmarks/ranks.py --nodes 1e6 --threads 2

Each rank makes its own strip of a jittered grid, with global ids. Printed by the first rank: the median of the seconds
from sweep to sweep, measures included; for each rank its nodes, what it sends in a sweep, and its peak memory; beside
it what the model says (docs/distributed.md). With --threads one process does without ranks.
"""

from __future__ import annotations

import argparse
import math
import resource
import time

import numpy as np

import gmsnet.distributed
from gmsnet.distributed.library import mpi

SWEEPS = 10


def strip(side: int, rank: int, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The points, triangles and global ids of a strip of rows of a grid of side × side nodes."""
    first, last = (number * (side - 1) // size for number in (rank, rank + 1))
    rows, columns = np.mgrid[first : last + 1, 0:side]
    ids = (rows * side + columns).ravel()
    shift = np.stack([_noise(ids), _noise(ids + side * side)], axis=1)
    inner = ((rows > 0) & (rows < side - 1) & (columns > 0) & (columns < side - 1)).ravel()
    points = np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.3 * shift * inner[:, None]
    local = np.arange(len(ids)).reshape(rows.shape)
    a, b, c, d = (each.ravel() for each in (local[:-1, :-1], local[:-1, 1:], local[1:, 1:], local[1:, :-1]))
    return points / side, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]), ids


def _noise(numbers: np.ndarray) -> np.ndarray:
    """−1 … 1 by the number alone, so that all ranks have the same at one node."""
    mixed = (numbers.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(40)
    return mixed / 2.0**23 - 1.0


def peak() -> float:
    """Megabytes that this process has had at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _without_ranks(mesh: tuple[np.ndarray, np.ndarray], ids: np.ndarray, **options: object) -> gmsnet.SmoothResult:
    return gmsnet.smooth(mesh, **options)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=float, default=1e6)
    parser.add_argument("--method", default="barrier")
    parser.add_argument("--threads", type=int, default=0)
    given, comm = parser.parse_args(), mpi().COMM_WORLD
    side = math.isqrt(int(given.nodes))
    options = {"method": given.method, "preserve": "none", "guard": "valid", "threads": max(given.threads, 1)}
    smooth = _without_ranks if given.threads else gmsnet.distributed.smooth
    small = strip(60, comm.rank, comm.size)
    smooth(small[:2], small[2], max_sweeps=2, **options)  # compiled
    points, triangles, ids = strip(side, comm.rank, comm.size)
    before = peak()
    comm.Barrier()
    began, ends = time.perf_counter(), list[float]()
    found = smooth(
        (points, triangles), ids, max_sweeps=SWEEPS, callback=lambda _: ends.append(time.perf_counter()), **options
    )
    share = side * side / comm.size
    sweep = float(np.median(np.diff(ends))) if ends else 0.0
    if comm.rank == 0:
        who = f"{given.threads} threads" if given.threads else f"{comm.size} ranks"
        print(
            f"{side * side:,} nodes, {who}: to the end of the first sweep {ends[0] - began:.2f} s, a sweep "
            f"{1e3 * sweep:.1f} ms, the whole call {found.seconds:.2f} s"
        )
    if given.threads:
        return
    told = comm.gather((len(ids), found.messages / found.sweeps, found.bytes / found.sweeps, before, peak()))
    if comm.rank == 0:
        print(f"least 1/q {found.before.shape_min:.4f} → {found.after.shape_min:.4f}; {found.gathered or 'shared out'}")
        for rank, (nodes, messages, size, first, last) in enumerate(told):
            neighbours = (rank > 0) + (rank < comm.size - 1)
            print(
                f"rank {rank}: {nodes:,} nodes; {messages:.0f} messages and {size:,.0f} bytes a sweep "
                f"(two rows to each of {neighbours}: {32 * (side - 2) * neighbours:,} at most); {first:.0f} MB "
                f"before, {last:.0f} MB at most, {(last - first) * 2**20 / share:.0f} bytes a node of its share"
            )


if __name__ == "__main__":
    main()
