"""Processes that are killed while they write a mesh over and over, and what is on the disk then.

``python tests/support/killing.py [--kills 600] [--nodes 3000] [--seed 0] [--whole 60]`` prints the tally; exit code 1
where anything was damaged, missing or left. --whole: how many more runs of the command line are killed, from its start
on.
"""

from __future__ import annotations

import argparse
import itertools
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import gmsnet
from gmsnet.mesh.mesh import Mesh

CASES = {  # of each, the target and the file that its mesh was read from: spliced if alike, else converted
    "SU2, spliced": ("out.su2", "in.su2"),
    "Gmsh, spliced": ("out.msh", "in.msh"),
    "VTU, converted": ("out.vtu", "in.su2"),
    "PLY, converted": ("out.ply", "in.msh"),
    "Triangle's pair, spliced": ("out.node", "in.node"),
    "Triangle's pair, converted": ("out.node", "in.su2"),
}


@dataclass
class Tally:
    """kills: in all. while_writing: of them, those that left a temporary file. damaged: targets that were neither the
    old nor the new mesh, missing ones, or pairs that do not belong together. left: files that a second run left."""

    kills: int = 0
    while_writing: int = 0
    damaged: int = 0
    left: int = 0

    def add(self, other: Tally) -> None:
        for field in fields(self):
            setattr(self, field.name, getattr(self, field.name) + getattr(other, field.name))


def two_versions(folder: Path, source: str, nodes: int) -> tuple[Mesh, Mesh]:
    """A mesh as it was read, and with every free node elsewhere."""
    gmsnet.write(gmsnet.random_mesh(nodes, seed=nodes), folder / source)
    mesh = gmsnet.read(folder / source)
    return mesh, mesh.with_points(gmsnet.smooth(mesh, "laplacian", max_sweeps=3).points)


def contents(folder: Path, target: str) -> dict[str, bytes]:
    stem = target.partition(".")[0]
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name.startswith(f"{stem}.")}


def leftovers(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


def killed_while_writing(folder: Path, case: str, kills: int, nodes: int, seed: int) -> Tally:
    """Kills processes that write the two versions of a mesh in turns, at random moments."""
    target, source = CASES[case]
    versions = two_versions(folder, source, nodes)
    allowed = []
    for mesh in versions:
        gmsnet.write(mesh, folder / target)
        allowed.append(contents(folder, target))
    assert allowed[0] != allowed[1]
    began = time.perf_counter()
    for mesh in versions:
        gmsnet.write(mesh, folder / target)
    longest, moments, tally = time.perf_counter() - began, random.Random(seed), Tally()
    for _ in range(kills):
        child = os.fork()
        if child == 0:
            try:
                while True:
                    for mesh in versions:
                        gmsnet.write(mesh, folder / target)
            finally:
                os._exit(1)
        time.sleep(moments.uniform(0.0, longest))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        assert os.WIFSIGNALED(status), "the child ended by itself"
        found = contents(folder, target)
        tally.add(Tally(1, bool(leftovers(folder)), found not in allowed, 0))
        gmsnet.write(versions[0], folder / target)  # the second run
        tally.left += len(leftovers(folder))
        tally.damaged += contents(folder, target) != allowed[0]
    return tally


def killed_runs(folder: Path, kills: int, nodes: int, seed: int) -> Tally:
    """Kills ``gmsnet smooth FILE --in-place`` at random moments of its whole life."""
    path = folder / "mesh.su2"
    gmsnet.write(gmsnet.random_mesh(nodes, seed=nodes), path)
    old = path.read_bytes()
    command = [sys.executable, "-m", "gmsnet", "smooth", str(path), "--in-place", "--quiet", "--max-sweeps", "5"]

    def seconds() -> float:
        path.write_bytes(old)
        began = time.perf_counter()
        subprocess.run(command, check=True)
        return time.perf_counter() - began

    longest = max(seconds(), seconds())  # the first one may compile
    new, moments, tally = path.read_bytes(), random.Random(seed), Tally()
    assert new != old
    for _ in range(kills):
        path.write_bytes(old)
        with subprocess.Popen(command) as process:
            time.sleep(moments.uniform(0.0, longest))
            process.kill()
        left = leftovers(folder)
        tally.add(Tally(1, bool(left), not path.exists() or path.read_bytes() not in (old, new), 0))
        if left:
            subprocess.run(command, check=True)
            tally.left += len(leftovers(folder))
    return tally


STEPS = ("open", "dup", "stat", "fstat", "fchown", "fchmod", "fsync", "replace", "unlink", "close")


def killed_at_each_step(folder: Path, case: str, nodes: int, after: bool) -> Tally:
    """Kills processes before, or after, each of the calls to the system that writing makes."""
    target, source = CASES[case]
    old, new = two_versions(folder, source, nodes)
    allowed = []
    for mesh in (new, old):
        gmsnet.write(mesh, folder / target)
        allowed.append(contents(folder, target))
    tally = Tally()
    while True:
        child = os.fork()
        if child == 0:
            steps, leave = itertools.count(), os._exit
            for name in STEPS:
                setattr(os, name, _killing(getattr(os, name), steps, tally.kills, after))
            try:
                gmsnet.write(new, folder / target)
            finally:
                leave(0)
        if os.WIFEXITED(os.waitpid(child, 0)[1]):  # there are no more steps
            return tally
        tally.add(Tally(1, bool(leftovers(folder)), contents(folder, target) not in allowed, 0))
        gmsnet.write(old, folder / target)
        tally.left += len(leftovers(folder))


def _killing(call: Callable[..., Any], steps: Iterator[int], last: int, after: bool) -> Callable[..., Any]:
    def counted(*given: Any, **options: Any) -> Any:
        is_last = next(steps) == last
        if is_last and not after:
            os.kill(os.getpid(), signal.SIGKILL)
        result = call(*given, **options)
        if is_last:
            os.kill(os.getpid(), signal.SIGKILL)
        return result

    return counted


def tallies(kills: int, nodes: int, seed: int) -> Iterator[tuple[str, Tally]]:
    for number, case in enumerate(CASES):
        with tempfile.TemporaryDirectory() as folder:
            for after in (False, True):
                step = "after each step" if after else "before each step"
                yield f"{case}, {step}", killed_at_each_step(Path(folder), case, 200, after)
            yield (
                f"{case}, at random",
                killed_while_writing(Path(folder), case, -(-kills // len(CASES)), nodes, seed + number),
            )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in (("kills", 600), ("nodes", 3000), ("seed", 0), ("whole", 60)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    total = Tally()
    for case, tally in tallies(options.kills, options.nodes, options.seed):
        print(f"{case}: {tally}", flush=True)
        total.add(tally)
    with tempfile.TemporaryDirectory() as folder:
        tally = killed_runs(Path(folder), options.whole, options.nodes, options.seed)
    print(f"the command line: {tally}")
    total.add(tally)
    print(f"all: {total}")
    return int(bool(total.damaged or total.left))


if __name__ == "__main__":
    sys.exit(main())
