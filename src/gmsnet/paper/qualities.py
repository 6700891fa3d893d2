"""The qualities of Table 2: each method on each case, with a new seed of the case in each run."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gmsnet.paper import contenders, printed
from gmsnet.paper.cases import CASES
from gmsnet.paper.contenders import Contender
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result, Store
from gmsnet.paper.units import Context, Unit

# Each column of the table, in 1/q_V as the paper forms it and in 1/q, and where QualityReport.summary() has it.
PLACES: dict[str, tuple[str, ...]] = {
    "min_angle_min": ("min_angle", "min"),
    "min_angle_mean": ("min_angle", "mean"),
    "max_angle_max": ("max_angle", "max"),
    "max_angle_mean": ("max_angle", "mean"),
    "inv_q_min": ("aspect", "min"),
    "inv_q_mean": ("aspect", "mean"),
    "shape_min": ("shape", "min"),
    "shape_mean": ("shape", "mean"),
    "qhat": ("qhat_aspect",),
    "inverted": ("inverted",),
}
LOW_IS_GOOD = ("max_angle_max", "max_angle_mean", "inverted")


def units(plan: Plan, among: Sequence[Contender]) -> list[Unit]:
    """One for each case, run and method."""
    return [
        Unit(name(case, run, each), smooth_once, {"case": case, "run": run, "key": each.key})
        for case in CASES
        for run in range(plan.runs)
        for each in among
    ]


def name(case: str, run: int, contender: Contender) -> str:
    """Of a unit."""
    return f"quality/{case}/{contender.key}/{run}"


def smooth_once(context: Context, case: str, run: int, key: str) -> Result:
    """One method on one case in one run, on one thread."""
    contender = contenders.named(key)
    mesh = CASES[case].mesh(run, context.plan.seed)
    result = contender.smooth(mesh, context.plan.sweeps)
    held = sum(len(ids) for ids in result.held.values())
    return Result(
        {
            "before": result.before.summary(),
            "after": result.after.summary(),
            "nodes": len(mesh.points) - held,
            "sweeps": result.sweeps,
            "stop_reason": result.stop_reason,
        }
    )


@dataclass(frozen=True)
class Spread:
    """A figure over the runs."""

    mean: float
    deviation: float  # of the sample; 0 for a single run
    least: float
    most: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Of at least one value."""
        deviation = statistics.stdev(values) if len(values) > 1 else 0.0
        return cls(math.fsum(values) / len(values), deviation, min(values), max(values))


@dataclass(frozen=True)
class Row:
    """A method (or the origin) on a case. columns: by the names in PLACES. free: nodes that may move."""

    case: str
    label: str
    columns: dict[str, Spread]
    printed: dict[str, float]  # empty where the paper has no such row
    sweeps: Spread | None = None
    free: Spread | None = None


def rows(plan: Plan, store: Store, among: Sequence[Contender]) -> list[Row]:
    """For each case the origin and each method, from the results of the units."""
    made = []
    for case in CASES:
        found = {each.key: [store.load(name(case, run, each)) for run in range(plan.runs)] for each in among}
        first = next(iter(found.values()))
        free = Spread.of([each["nodes"] for each in first])
        made.append(
            Row(case, printed.ORIGIN, _columns([each["before"] for each in first]), _printed(case, printed.ORIGIN),
                free=free)
        )  # fmt: skip
        for each in among:
            results = found[each.key]
            sweeps = Spread.of([result["sweeps"] for result in results])
            columns = _columns([result["after"] for result in results])
            made.append(Row(case, each.label, columns, _printed(case, each.printed), sweeps, free))
    return made


def figure(summary: dict[str, Any], column: str) -> float:
    """A column out of the answer of QualityReport.summary()."""
    value: Any = summary
    for key in PLACES[column]:
        value = value[key]
    return float(value)


def _columns(summaries: Sequence[dict[str, Any]]) -> dict[str, Spread]:
    return {column: Spread.of([figure(each, column) for each in summaries]) for column in PLACES}


def _printed(case: str, label: str) -> dict[str, float]:
    row = printed.table2().get((case, label))
    return row.values if row else {}
