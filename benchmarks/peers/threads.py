"""gmsnet with several threads on one mesh: python -m peers.threads JOB.json RESULT.json, in the folder benchmarks.

Seconds of the clock here. The numbers of threads take turns; medians count.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from peers.ours import Smooth
from peers.peer import Plane
from peers.table import named


def measured(job: dict[str, Any]) -> dict[str, Any]:
    """Seconds of the whole call, and of the sweeps alone, for each number of threads; and whether the bits agree."""
    plane, peer = Plane.load(job["mesh"]), named(job["peer"])
    tools = {count: Smooth(plane, threads=count, **peer.options) for count in job["threads"]}
    effort = next(iter(tools.values())).efforts()[-1]
    whole: dict[int, list[float]] = {count: [] for count in tools}
    alone: dict[int, list[float]] = {count: [] for count in tools}
    for _ in range(job["repeats"]):
        for count, tool in tools.items():
            began = time.perf_counter()
            tool.smooth(effort)
            whole[count].append(time.perf_counter() - began)
            alone[count].append(tool.smoothing_alone(effort, time.perf_counter))
    results = [tool.points() for tool in tools.values()]
    return {
        "threads": list(tools),
        "whole": [median(seconds) for seconds in whole.values()],
        "smoothing": [median(seconds) for seconds in alone.values()],
        "same_bits": all(np.array_equal(points, results[0]) for points in results),
    }


def main() -> None:
    job, result = (Path(name) for name in sys.argv[1:])
    result.write_text(json.dumps(measured(json.loads(job.read_text(encoding="utf-8")))) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
