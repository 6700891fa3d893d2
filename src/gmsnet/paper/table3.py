"""Table 3: GMSNet trained with cosine loss against MetricLoss, on pipe and square."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from gmsnet.measure.report import ASPECT
from gmsnet.paper import printed, trainings
from gmsnet.paper.cases import CASES
from gmsnet.paper.plan import Plan
from gmsnet.paper.qualities import PLACES, Spread, figure
from gmsnet.paper.store import Result, Store
from gmsnet.paper.units import Context, Unit
from gmsnet.run.api import smooth

SHOWN = ("pipe", "square")
LOSSES = ("cosine", "metric")


def units(plan: Plan) -> list[Unit]:
    """One for each case, loss and training."""
    return [
        Unit(name(case, loss, seed), smooth_all, {"case": case, "loss": loss, "seed": seed})
        for case in SHOWN
        for loss in LOSSES
        for seed in trainings.seeds(plan)
    ]


def name(case: str, loss: str, seed: int) -> str:
    """Of a unit."""
    return f"table3/{case}/{loss}/{seed}"


def smooth_all(context: Context, case: str, loss: str, seed: int) -> Result:
    """All runs of a case with the weights of one training; none if it diverged."""
    weights = trainings.weights(context.store, loss, seed)
    if weights is None:
        return Result({"runs": []})
    runs = []
    for run in range(context.plan.runs):
        context.go_on()
        mesh = CASES[case].mesh(run, context.plan.seed)
        result = smooth(
            mesh, "gmsnet", weights=weights, max_sweeps=context.plan.sweeps, threads=1, best_by=ASPECT,
            guard="valid", preserve="none",
        )  # fmt: skip
        runs.append({"after": result.after.summary(), "sweeps": result.sweeps})
    return Result({"runs": runs})


def document(plan: Plan, store: Store) -> dict[str, Any]:
    """Case → loss → the columns: the mean over the runs for each training, and the spread of that over trainings."""
    made: dict[str, Any] = {}
    for case in SHOWN:
        made[case] = {}
        for loss in LOSSES:
            found = [store.load(name(case, loss, seed))["runs"] for seed in trainings.seeds(plan)]
            trained = [runs for runs in found if runs]
            row = printed.table3()[case, loss].values
            columns = {}
            for column in PLACES:
                if trained:
                    means = [Spread.of([figure(run["after"], column) for run in runs]).mean for runs in trained]
                    spread = Spread.of(means)
                    columns[column] = asdict(spread)
                    if column in row:
                        columns[column] |= {"paper": row[column], "difference": spread.mean - row[column]}
            made[case][loss] = {"title": trainings.TITLES[loss], "trainings": len(trained), "columns": columns}
    return made
