"""The short trainings of the loss study: GMSNet with each loss, from several seeds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gmsnet.errors import InputError
from gmsnet.learn.checkpoint import saved_options
from gmsnet.learn.losses import LOSSES
from gmsnet.learn.options import TrainOptions
from gmsnet.learn.train import Ending, train
from gmsnet.learn.trainee import Row
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result, Store
from gmsnet.paper.units import Context, Stopped, Unit

TITLES = {"metric": "MetricLoss", "q": "aspect ratio", "cosine": "cosine", "min-max-angle": "min-max angle"}


def units(plan: Plan, losses: Sequence[str] = tuple(LOSSES)) -> list[Unit]:
    """One for each loss and seed."""
    return [
        Unit(name(loss, seed), train_once, {"loss": loss, "seed": seed})
        for seed in seeds(plan)
        for loss in losses
    ]  # fmt: skip


def seeds(plan: Plan) -> range:
    """Of the trainings."""
    return range(plan.seed, plan.seed + plan.training_seeds)


def name(loss: str, seed: int) -> str:
    """Of a unit."""
    return f"training/{loss}/{seed}"


def folder(store: Store, loss: str, seed: int) -> Path:
    """Where a training keeps its checkpoint and its weights."""
    return store.folder / "trainings" / f"{loss}-{seed}"


def weights(store: Store, loss: str, seed: int) -> Path | None:
    """The weights of a finished training; None for one that diverged."""
    file = store.load(name(loss, seed))["weights"]
    if file is None:
        return None
    path = folder(store, loss, seed) / str(file)
    if not path.exists():
        raise InputError(f"{path}: is gone; delete {store.path(name(loss, seed))} too, and it is trained anew")
    return path


def train_once(context: Context, loss: str, seed: int) -> Result:
    """A training from the start, or on from its checkpoint."""
    options = TrainOptions(loss=loss, seed=seed, epochs=context.plan.epochs)
    place = folder(context.store, loss, seed)
    resume = saved_options(place) is not None
    result = train(options, place, resume=resume, should_stop=lambda: context.stopping)
    if result.ending is Ending.STOPPED:
        raise Stopped
    return Result(
        {
            "command": options.command,
            "ending": result.ending.value,
            "history": {field: [getattr(row, field) for row in result.history["gmsnet"]] for field in Row._fields},
            "losses": dict(result.losses),
            "weights": options.file_name if result.ending is Ending.FINISHED else None,
        }
    )


def loaded(store: Store, loss: str, plan: Plan) -> list[dict[str, Any]]:
    """The results of a loss, a training each."""
    return [store.load(name(loss, seed)) for seed in seeds(plan)]
