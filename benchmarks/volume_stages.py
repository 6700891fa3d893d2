"""What each stage of the default on tetrahedra is worth: the default, and without each of them, in one table.

    python benchmarks/volume_stages.py [FILE ...] [--seeds 0 1 2]

Without files: random Delaunay cubes of 10,000 nodes. Figures are over the cells with a free node; seconds are of the
processor, one thread, the least of REPEATS in turns.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from machine import describe
from volumes import REPEATS, _blocks, cube, figures

import gmsnet
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import auto, phases
from gmsnet.run import dihedral_stage, mean_stage
from gmsnet.topology.volume import Volume

NEWTON, WORST, KEPT = phases.VOLUME_PLAN
NEVER = math.inf


@contextmanager
def changed(plan: tuple[phases.Phase, ...] = phases.VOLUME_PLAN, **gains: float) -> Iterator[None]:
    """Another plan; gains: what ``passes``, ``dihedral`` and ``mean`` must bring, NEVER for none."""
    with (
        patch.object(auto, "plan_for", lambda topology: plan),
        patch.object(auto, "IN_SPACE", (plan,)),
        patch.object(auto, "PASSES", 1 if gains.get("passes") == NEVER else auto.PASSES),
        patch.object(dihedral_stage, "GAIN", gains.get("dihedral", dihedral_stage.GAIN)),
        patch.object(mean_stage, "GAIN", gains.get("mean", mean_stage.GAIN)),
    ):
        yield


WITHOUT = {
    "the default": lambda: changed(),
    "without Newton sweeps first": lambda: changed((WORST, KEPT)),
    "without the worst cells first": lambda: changed((NEWTON, KEPT)),
    "without Newton sweeps after them": lambda: changed((NEWTON, WORST._replace(looks=True))),
    "without further turns": lambda: changed(passes=NEVER),
    "without dihedral angles": lambda: changed(dihedral=NEVER),
    "without the mean last": lambda: changed(mean=NEVER),
}


def run(name: str, mesh: Mesh) -> None:
    """All rows of one mesh."""
    volume, seconds = Volume.of(mesh), dict.fromkeys(WITHOUT, math.inf)
    results = {}
    for _ in range(REPEATS):
        for row, without in WITHOUT.items():
            with without():
                began = time.process_time()
                results[row] = gmsnet.smooth(mesh, threads=1)
                seconds[row] = min(seconds[row], time.process_time() - began)
    print(f"\n{name}: {len(volume.free):,} free nodes; input: {figures(mesh, volume)}")
    for row, result in results.items():
        print(f"  {row:34} {figures(result.mesh, volume)}, {seconds[row]:.3f} s")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*")
    parser.add_argument("--seeds", nargs="*", type=int, default=range(3))
    arguments = parser.parse_args()
    print(describe())
    for file in arguments.files:
        run(file, gmsnet.read(file))
    if not arguments.files:
        for seed in arguments.seeds:
            points, cells = cube(10_000, seed)
            run(f"random cube, seed {seed}", Mesh(points, _blocks(cells)))


if __name__ == "__main__":
    main()
