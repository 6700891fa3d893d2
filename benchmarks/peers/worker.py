"""One tool on one mesh in a process of its own: python -m peers.worker JOB.json RESULT.json, in the folder benchmarks.

The job: the tool's name, the files of the mesh and of a small one to warm up with, how often to repeat, and how many
seconds all runs with one effort may take before they are not repeated any more.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from peers.checks import behaviour, figures
from peers.memory import forget_peak, peak
from peers.peer import OURS, Peer, Plane
from peers.table import named

PRODUCTS = 20  # of the matrix, that are timed at once
PARTS = ("set_up", "smoothing", "back")


@dataclass(frozen=True, eq=False)
class Run:
    """What one run took, and what came out.

    seconds: of the processor, for each of PARTS. clock: of the clock, in all. peak: of memory, since it was last
    forgotten. points, cells: as they are then.
    """

    seconds: list[float]
    clock: float
    peak: int
    points: np.ndarray
    cells: np.ndarray | None


class Unit:
    """L: one product of SciPy's averaging matrix with the coordinates, nodes in reverse Cuthill–McKee order."""

    def __init__(self, plane: Plane) -> None:
        from peers.scipy_matrix import averaging, in_good_order  # not before the tool's memory has been looked at

        good = in_good_order(plane)
        self.matrix, self.points = averaging(good), good.points
        self.seconds()  # that was to warm up

    def seconds(self) -> float:
        """Of the processor, for one."""
        points, began = self.points, time.process_time()
        for _ in range(PRODUCTS):
            points = self.matrix @ points
        return (time.process_time() - began) / PRODUCTS


def tool_of(peer: Peer) -> Any:
    """The class that a row of the table names."""
    module, name = peer.tool.split(":")
    return getattr(importlib.import_module(f"peers.{module}"), name)


def fresh(plane: Plane) -> Plane:
    """A copy of the mesh, so that nothing is left from the run before."""
    gc.collect()
    return Plane(plane.points.copy(), plane.cells.copy(), plane.quads.copy())


def run(peer: Peer, arrays: Plane, effort: int) -> Run:
    """From arrays to arrays."""
    create = tool_of(peer)
    clock, moments = time.perf_counter(), [time.process_time()]
    tool = create(arrays, **peer.options)
    moments.append(time.process_time())
    tool.smooth(effort)
    moments.append(time.process_time())
    points = tool.points()
    moments.append(time.process_time())
    clock, most = time.perf_counter() - clock, peak()
    points = points.copy()  # they may be the tool's own memory
    seconds = getattr(tool, "seconds", None) or np.diff(moments).tolist()
    return Run(seconds, clock, most, points, tool.cells())


def level(effort: int, runs: list[Run], units: list[float], plane: Plane) -> dict[str, Any]:
    """Medians of the runs with one effort, and what came out of the last. units: the L beside each run."""
    points, cells = runs[-1].points, runs[-1].cells
    did = behaviour(plane, points, cells)
    totals = [sum(each.seconds) for each in runs]
    return {
        "effort": effort,
        "runs": len(runs),
        "seconds": median(totals),
        "units": median(total / unit for total, unit in zip(totals, units, strict=True)),
        "clock": median(each.clock for each in runs),
        **{part: median(each.seconds[k] for each in runs) for k, part in enumerate(PARTS)},
        "figures": figures(points, plane.cells if cells is None else cells) if did["points_kept"] else None,
        "behaviour": did,
    }


def measured(job: dict[str, Any]) -> dict[str, Any]:
    """What the tool of the job does on its mesh, and how long it takes."""
    peer, plane = named(job["peer"]), Plane.load(job["mesh"])
    run(peer, Plane.load(job["small"]), max(peer.efforts, default=100))
    efforts = peer.efforts or tool_of(peer)(plane, **peer.options).efforts()  # ours: compiled on the way, by size

    arrays, before = fresh(plane), forget_peak()
    first = run(peer, arrays, efforts[-1])
    memory = {"before": before, "peak": first.peak}

    unit = Unit(plane)
    runs: dict[int, list[Run]] = {effort: [] for effort in efforts}
    units: dict[int, list[float]] = {effort: [] for effort in efforts}
    runs[efforts[-1]].append(first)
    units[efforts[-1]].append(unit.seconds())
    for _ in range(job["repeats"]):  # efforts take turns, so that what else the machine does falls on all of them
        for effort in efforts:
            taken = sum(each.clock for each in runs[effort])
            if len(runs[effort]) < job["repeats"] and taken < job["patience"]:
                units[effort].append(unit.seconds())
                runs[effort].append(run(peer, fresh(plane), effort))
    found: dict[str, Any] = {
        "memory": memory,
        "L": median(one for those in units.values() for one in those),
        "levels": [level(effort, runs[effort], units[effort], plane) for effort in efforts],
    }
    if peer.kind == OURS:
        tool = tool_of(peer)(plane, **peer.options)
        found["smoothing_alone"] = median(tool.smoothing_alone(efforts[-1]) for _ in range(job["repeats"]))
    return found


def pin() -> None:
    """The process to one processor: some tools start as many threads as they see."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def answer(measured: Callable[[dict[str, Any]], Any]) -> None:
    """Measures the job in the first file named on the command line and writes what was found to the second."""
    job, result = (Path(name) for name in sys.argv[1:])
    pin()
    found = measured(json.loads(job.read_text(encoding="utf-8")))
    result.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    answer(measured)
