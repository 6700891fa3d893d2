"""Thousands of small meshes smoothed in one process, all methods in turns, some through files: is anything left behind?

    python benchmarks/soak.py [--meshes 10000] [--seed 0]

After every tenth of the meshes: resident memory, open descriptors, threads, and objects that Python's collector knows.
The first three compile and fill caches; exit code 1 if, from their end to the last one, memory has grown by more than
8 MB or if there is any more of the others.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import sys
import tempfile
import threading
import time
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from machine import describe

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import disturb
from gmsnet.io import FORMATS
from gmsnet.methods import METHODS
from gmsnet.parallel import threads as workers
from gmsnet.topology.topology import Topology

WARM = 3  # tenths of the meshes, in which kernels are compiled and libraries loaded
MOST_GROWTH = 8.0  # MB of resident memory


@dataclass(frozen=True)
class Traces:
    """What a process holds. memory: MB."""

    memory: float
    descriptors: int
    threads: int
    objects: int

    @classmethod
    def now(cls) -> Traces:
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return cls(
            pages * os.sysconf("SC_PAGE_SIZE") / 2**20,
            len(os.listdir("/proc/self/fd")),
            max(threading.active_count(), len(os.listdir("/proc/self/task"))),
            len(gc.get_objects()),
        )

    def left_since(self, before: Traces) -> list[str]:
        """What there is more of than before, in words."""
        found = []
        if self.memory > before.memory + MOST_GROWTH:
            found.append(f"{self.memory - before.memory:.1f} MB of memory")
        if self.descriptors > before.descriptors:
            found.append(f"{self.descriptors - before.descriptors} descriptors")
        if self.threads > before.threads:
            found.append(f"{self.threads - before.threads} threads")
        if self.objects > before.objects + 1000:  # what libraries remember of names and types
            found.append(f"{self.objects - before.objects} objects")
        return found


def smooth_one(number: int, random: np.random.Generator, folder: Path) -> None:
    """One mesh of 20 to 300 nodes with the method and by the way that its number tells."""
    written = [key for key, entry in FORMATS.items() if not (entry.folder or entry.own)]
    method, key = list(METHODS)[number % len(METHODS)], written[number % len(written)]
    mesh = gmsnet.random_mesh(int(random.integers(20, 300)), seed=number % 50)
    if number % 5 == 0:
        mesh = disturb(mesh, Topology.of(mesh).free, 0.7, seed=number, keep_valid=False)
    if number % 3 == 0:
        path = folder / f"mesh{FORMATS[key].suffixes[0]}"
        gmsnet.write(mesh, path)
        mesh = gmsnet.read(path)
    options = {"target_quality": 0.4} if number % 7 == 0 and method in ("auto", "laplacian") else {}
    if number % 11 == 0:  # one that fails half-way
        with contextlib.suppress(InputError):
            gmsnet.smooth(mesh, method, max_sweeps=5, callback=_fail)
    result = gmsnet.smooth(mesh, method, max_sweeps=5, threads=1 + number % 3, **options)
    assert result.after.inverted <= result.before.inverted
    if number % 13 == 0:
        result.after.summary(), result.limits
    if number % 3 == 0:
        gmsnet.write(result.mesh, path)


def _fail(_: object) -> None:
    raise InputError("stopped")


def soak(meshes: int, seed: int) -> list[Traces]:
    """What there is after each tenth of the meshes."""
    workers.FEWEST_BLOCKS = 1  # so that threads are started for small meshes too
    random, found = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(meshes):
            smooth_one(number, random, Path(folder))
            if (number + 1) * 10 // meshes > number * 10 // meshes:
                found.append(Traces.now())
                memory, descriptors, threads, objects = astuple(found[-1])
                print(
                    f"{number + 1:>7,} meshes: {memory:.1f} MB, {descriptors} descriptors, {threads} threads, "
                    f"{objects:,} objects",
                    flush=True,
                )
        left = sorted(path.name for path in Path(folder).iterdir() if path.name.startswith("."))
    assert not left, left
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--meshes", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(describe())
    began = time.perf_counter()
    found = soak(options.meshes, options.seed)
    left = found[-1].left_since(found[WARM - 1])
    print(f"{time.perf_counter() - began:.0f} s; left behind since the third tenth: {', '.join(left) or 'nothing'}")
    return int(bool(left))


if __name__ == "__main__":
    sys.exit(main())
