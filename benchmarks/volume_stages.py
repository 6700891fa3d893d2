"""What each stage of the default on tetrahedra is worth: the default, and without each of them, in one table.

    python benchmarks/volume_stages.py [FILE ...] [--nodes 1e4] [--seeds 0 1 2]

Without files: random Delaunay cubes. Figures are over the cells with a free node; seconds are of the
processor, one thread, the least of REPEATS in turns.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from unittest.mock import patch

from machine import describe
from volumes import REPEATS, _blocks, cube, figures

import gmsnet
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import auto, passes, phases
from gmsnet.methods.barrier import Barrier
from gmsnet.run import dihedral_stage
from gmsnet.topology.volume import Volume

PLANS = phases.VOLUME_PLAN, phases.LARGE_VOLUME_PLAN
NEVER = math.inf
POWERS = {"Newton on q": 1.3, "Newton above a wall": 1.3, "room for the worst": 1.0, "mean, worst kept": 1.0}


@contextmanager
def changed(change: Callable[[tuple[phases.Phase, ...]], list[phases.Phase]], **gains: float) -> Iterator[None]:
    """Other plans; gains: what ``passes`` and ``dihedral`` must bring, NEVER for none."""
    plans = [tuple(change(plan)) for plan in PLANS]

    def plan_for(topology: Volume, free: int) -> tuple[phases.Phase, ...]:
        return plans[free > phases.LARGE_VOLUME]

    with (
        patch.object(auto, "plan_for", plan_for),
        patch.object(auto, "IN_SPACE", tuple(plans)),
        patch.object(passes, "IN_SPACE", tuple(plans)),
        patch.object(passes, "LARGE_VOLUME_PLAN", plans[1]),
        patch.object(passes, "PASSES", 1 if gains.get("passes") == NEVER else passes.PASSES),
        patch.object(dihedral_stage, "GAIN", gains.get("dihedral", dihedral_stage.GAIN)),
    ):
        yield


def without(name: str) -> Callable[[tuple[phases.Phase, ...]], list[phases.Phase]]:
    """A plan without the phases of a name."""

    def change(plan: tuple[phases.Phase, ...]) -> list[phases.Phase]:
        left = [phase for phase in plan if phase.name != name]
        return [*left[:-1], left[-1]._replace(looks=True)]

    return change


def by_power(plan: tuple[phases.Phase, ...]) -> list[phases.Phase]:
    """The plan with Newton steps on q^(3/2), as they were before there were walls."""
    return [
        phase._replace(create=partial(Barrier, "q", POWERS[phase.name], phases.ALWAYS))
        if phase.name in POWERS
        else phase
        for phase in plan
    ]


def first_turn(plan: tuple[phases.Phase, ...]) -> list[phases.Phase]:
    """The plan with one turn over the worst cells."""
    turns = [k for k, phase in enumerate(plan) if phase.name == "worst first"]
    return [*plan[: turns[0] + 1], plan[-1]]


WITHOUT: dict[str, Callable[[], AbstractContextManager[None]]] = {
    "the default": lambda: changed(list),
    "without Newton sweeps first": lambda: changed(without("Newton on q")),
    "without the wall before the worst": lambda: changed(without("Newton above a wall")),
    "without the worst cells first": lambda: changed(without("worst first")),
    "without room between turns": lambda: changed(without("room for the worst")),
    "without further turns": lambda: changed(first_turn, passes=NEVER),
    "without the mean after them": lambda: changed(without("mean, worst kept")),
    "powers in the place of walls": lambda: changed(by_power),
    "without dihedral angles": lambda: changed(list, dihedral=NEVER),
}


def run(name: str, mesh: Mesh) -> None:
    """All rows of one mesh."""
    volume, seconds = Volume.of(mesh), dict.fromkeys(WITHOUT, math.inf)
    results = {}
    for _ in range(REPEATS):
        for row, change in WITHOUT.items():
            with change():
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
    parser.add_argument("--nodes", type=float, default=1e4)
    arguments = parser.parse_args()
    print(describe())
    for file in arguments.files:
        run(file, gmsnet.read(file))
    if not arguments.files:
        for seed in arguments.seeds:
            points, cells = cube(int(arguments.nodes), seed)
            run(f"random cube, seed {seed}", Mesh(points, _blocks(cells)))


if __name__ == "__main__":
    main()
