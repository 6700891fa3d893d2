"""Training and validation curves of the four losses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet import plot
from gmsnet.learn.losses import LOSSES
from gmsnet.paper import study, trainings
from gmsnet.paper.figures.picture import Drawn
from gmsnet.paper.units import Context

TRAINING, VALIDATION = plot.BEFORE, plot.AFTER


def draw(context: Context) -> Drawn:
    """Above each loss in its own unit, below all of them in MetricLoss."""
    found = study.study(context.plan, context.store)
    figure = plot.new_figure(15.0, 7.2)
    axes = figure.subplots(2, len(LOSSES), sharex=True)
    for column, loss in enumerate(LOSSES):
        own, metric = axes[:, column]
        for k, result in enumerate(trainings.loaded(context.store, loss, context.plan)):
            history = result["history"]
            epochs = range(1, len(history["train_loss"]) + 1)
            names = ("training", "validation") if k == 0 else (None, None)
            own.plot(epochs, _curve(history, "train_loss"), color=TRAINING, lw=0.4, alpha=0.5, label=names[0])
            own.plot(epochs, _curve(history, "validation_loss"), color=VALIDATION, lw=0.9, label=names[1])
            metric.plot(epochs, _curve(history, "validation_metric_loss"), color=VALIDATION, lw=0.9)
        own.set_title(f"{trainings.TITLES[loss]}: {found.converged(loss)} of {context.plan.training_seeds} converge")
        if loss == "q":
            own.set_yscale("log")
        for value, style, text in ((found.before, ":", "no move"), (found.optimum, "--", "optimum of each star")):
            metric.axhline(value, color="black", lw=0.8, ls=style, label=text)
        metric.set_ylim(found.optimum - 0.01, found.before + 0.12)
        metric.set_xscale("log")
        metric.set_xlabel("epoch")
        for each in (own, metric):
            each.spines[["top", "right"]].set_visible(False)
    axes[0, 0].set_ylabel("the loss itself")
    axes[1, 0].set_ylabel("validation, in MetricLoss")
    axes[0, 0].legend(frameon=False)
    axes[1, 0].legend(frameon=False)
    caption = (
        f"{context.plan.training_seeds} trainings with each loss, {context.plan.epochs:,} epochs of one step. Above: "
        "the loss that is minimised, on the drawn nodes and on all validation nodes. Below: MetricLoss on the "
        f"validation nodes, whatever is minimised. {study.RULE} In the paper's figure MetricLoss and cosine loss "
        "converge within a few epochs, while the trainings with min-max angle and aspect ratio fail at the start."
    )
    return Drawn(figure, caption)


def _curve(history: dict[str, Any], name: str) -> NDArray[np.float64]:
    """A column of a history; what was not finite is a gap."""
    return np.array([np.nan if value is None else value for value in history[name]], dtype=np.float64)
