"""Which trainings converge, by the rule, from curves whose end is known."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("matplotlib")

from gmsnet.paper import study, trainings
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result, Store

PLAN = Plan(runs=1, sweeps=1, seed=0, quick=True)
BEFORE, OPTIMUM, EPOCHS = 0.3, 0.2, 200


def curve(gain: float, swing: float = 0.0, speed: float = 10.0) -> list[float]:
    """Falls from BEFORE by this share of the way, and swings about that."""
    epoch = np.arange(1, EPOCHS + 1)
    gains = gain * (1.0 - np.exp(-epoch / speed)) + swing / 2 * np.where(epoch % 2 == 0, 1.0, -1.0)
    return (BEFORE - gains * (BEFORE - OPTIMUM)).tolist()


def studied(tmp_path, curves, ending="finished") -> study.Study:
    store = Store(tmp_path)
    for loss in trainings.TITLES:
        for seed in trainings.seeds(PLAN):
            values = curves.get(loss, curve(0.9))
            result = {
                "ending": ending if loss in curves else "finished",
                "history": {"validation_metric_loss": values},
                "losses": {"validation_loss_before": BEFORE, "validation_loss_optimum": OPTIMUM},
            }
            store.save(trainings.name(loss, seed), Result(result), 0.0)
    return study.study(PLAN, store)


def test_a_settled_training_converges(tmp_path):
    found = studied(tmp_path, {})
    assert (found.before, found.optimum) == (BEFORE, OPTIMUM)
    assert found.converged("metric") == PLAN.training_seeds
    first = found.of("metric")[0]
    assert first.gain == pytest.approx(0.9, abs=1e-6)
    assert first.end == pytest.approx(0.21, abs=1e-6)
    assert first.swing < 1e-3
    assert first.worse == 0
    assert first.settled == 24  # 1 − exp(−24/10) is the first above 0.9


@pytest.mark.parametrize(
    ("values", "ending"),
    [
        (curve(0.4), "finished"),  # too little
        (curve(0.9, swing=0.3), "finished"),  # never steady
        (curve(0.9), "diverged"),
        ([*curve(0.9)[:-1], None], "finished"),  # not finite
        (curve(-0.5), "finished"),  # worse than no move
    ],
)
def test_trainings_that_do_not_converge(tmp_path, values, ending):
    assert studied(tmp_path, {"q": values}, ending).converged("q") == 0


def test_epochs_worse_than_no_move_are_counted_after_the_first(tmp_path):
    values = curve(0.9)
    values[: study.EARLY] = [1.0] * study.EARLY
    values[100:118] = [0.31] * 18
    assert studied(tmp_path, {"q": values}).of("q")[0].worse == pytest.approx(0.1)
    assert studied(tmp_path, {"q": curve(-0.5)}).of("q")[0].settled is None
