"""The course of each method on a case, with time stamps: for the figure of convergence."""

from __future__ import annotations

import statistics
import time
from typing import Any

from gmsnet.measure.report import ASPECT
from gmsnet.paper.cases import CASES
from gmsnet.paper.contenders import Contender, papers
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result
from gmsnet.paper.units import Context, Unit
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start
from gmsnet.run.sweep import Sweep
from gmsnet.topology.topology import Topology

SHOWN = ("square", "pipe")
REPEATS = 5  # medians of their times are taken


def units(plan: Plan) -> list[Unit]:
    """One for each case shown."""
    return [Unit(name(case), record, {"case": case}) for case in SHOWN]


def name(case: str) -> str:
    """Of a unit."""
    return f"convergence/{case}"


def record(context: Context, case: str) -> Result:
    """q̂ and mean 1/q before the first sweep and after each, and the seconds since the first began."""
    mesh = CASES[case].mesh(0, context.plan.seed)
    topology = Topology.of(mesh)

    def run_of(contender: Contender, sweeps: int) -> dict[str, Any]:
        seconds, qhat, mean_shape = [0.0], list[float](), list[float]()

        def take_down(sweep: Sweep) -> None:
            seconds.append(time.process_time() - began)
            qhat.append(sweep.qhat)
            mean_shape.append(sweep.mean_shape)

        options = SmoothOptions(max_sweeps=sweeps, callback=take_down, best_by=ASPECT, guard="valid")
        run = Run(Start.of(mesh, topology), contender.smoother(), options)
        qhat.append(run.best_score.qhat)
        mean_shape.append(run.best_score.mean_shape)
        began = time.process_time()
        run.to_the_end()
        return {"seconds": seconds, "qhat": qhat, "mean_shape": mean_shape}

    records = {}
    for contender in papers():
        context.go_on()
        run_of(contender, 1)  # compiles
        again = [run_of(contender, context.plan.sweeps) for _ in range(REPEATS)]
        seconds = [statistics.median(each) for each in zip(*(one["seconds"] for one in again), strict=True)]
        records[contender.key] = {**again[0], "seconds": seconds}
    return Result({"records": records})
