"""Which losses train GMSNet and which do not, by one rule for all of them."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gmsnet.learn.losses import LOSSES
from gmsnet.paper import trainings
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Store

TAIL = 0.1  # of the epochs, the last ones
LEAST_GAIN = 0.5  # of the way from no move to the optimum of each star, in MetricLoss
MOST_SWING = 0.1  # of that way, between the 5th and the 95th percentile of the second half of the epochs
EARLY = 20  # epochs that are not counted as worse than no move: every training begins so
RULE = (
    f"A training converges if it ends with finite numbers, its validation MetricLoss (median of the last {TAIL:.0%} of "
    f"the epochs) has gone at least {LEAST_GAIN:.0%} of the way from no move at all to the optimum of each star, and "
    f"swings in the second half of the epochs by at most {MOST_SWING:.0%} of that way (5th to 95th percentile)."
)


@dataclass(frozen=True)
class Training:
    """How one training went, in validation MetricLoss, whatever it minimised.

    gain: share of the way from ``before`` to ``optimum`` at the end. swing: of the second half, in the same unit.
    worse: share of the epochs after the first 20 that are worse than no move at all. settled: the epoch from which on
    the gain stayed above 90 % of its final value, None where it never was.
    """

    loss: str
    seed: int
    ending: str
    epochs: int
    end: float
    gain: float
    swing: float
    worse: float
    settled: int | None

    @property
    def converged(self) -> bool:
        """By the rule."""
        return self.ending == "finished" and self.gain >= LEAST_GAIN and self.swing <= MOST_SWING


@dataclass(frozen=True)
class Study:
    """before, optimum: the validation MetricLoss with no move, and with the best one for each star."""

    before: float
    optimum: float
    trainings: list[Training]

    def of(self, loss: str) -> list[Training]:
        """Those of one loss."""
        return [each for each in self.trainings if each.loss == loss]

    def converged(self, loss: str) -> int:
        """How many of them converged."""
        return sum(each.converged for each in self.of(loss))


def study(plan: Plan, store: Store) -> Study:
    """From the results of the trainings. All have the same meshes, so MetricLoss's marks are those of all."""
    marks = store.load(trainings.name("metric", trainings.seeds(plan)[0]))["losses"]
    before, optimum = float(marks["validation_loss_before"]), float(marks["validation_loss_optimum"])
    found = [
        _judge(loss, seed, store.load(trainings.name(loss, seed)), before, optimum)
        for loss in LOSSES
        for seed in trainings.seeds(plan)
    ]
    return Study(before, optimum, found)


def _judge(loss: str, seed: int, result: dict[str, Any], before: float, optimum: float) -> Training:
    curve = [math.inf if v is None else v for v in result["history"]["validation_metric_loss"]]
    gains = [(before - value) / (before - optimum) for value in curve]
    gain = statistics.median(gains[-max(2, round(TAIL * len(gains))) :])
    half = gains[len(gains) // 2 :]
    swing = _percentile(half, 0.95) - _percentile(half, 0.05) if all(map(math.isfinite, half)) else math.inf
    late = gains[EARLY:]
    worse = sum(each < 0 for each in late) / len(late) if late else math.nan
    low = [k for k, each in enumerate(gains, start=1) if each < 0.9 * gain]
    settled = (low[-1] + 1 if low else 1) if gain > 0 else None
    end = before - gain * (before - optimum)
    return Training(loss, seed, result["ending"], len(curve), end, gain, swing, worse, settled)


def _percentile(values: Sequence[float], share: float) -> float:
    ordered = sorted(values)
    return ordered[round(share * (len(ordered) - 1))]
