"""gmsnet train: trains a network on random squares and writes its weights."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gmsnet.cli.signals import Deferral, Interrupted
from gmsnet.errors import InputError

if TYPE_CHECKING:
    from gmsnet.learn.options import ModelOptions
    from gmsnet.learn.train import EpochDone, TrainResult

_NO_OPTIONS = ("out", "model", "resume")  # of a training itself
STOPPED = 130  # exit code after Ctrl-C, as shells count it


def train(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for weights, curves and checkpoint.")] = Path("gmsnet-training"),
    model: Annotated[
        str, typer.Option(help="What is trained: gmsnet, gmsnet2 (its successor), or nn (NN-Smoothing).")
    ] = "gmsnet",
    loss: Annotated[
        str, typer.Option(help="What GMSNet minimises: metric (MetricLoss), q (aspect ratio), cosine, min-max-angle.")
    ] = "metric",
    hidden: Annotated[
        int, typer.Option(help="Hidden features H of GMSNet (2H² + 10H + 2 parameters) and GMSNet 2 (4H² + 11H + 3).")
    ] = 8,
    labels: Annotated[
        str,
        typer.Option(
            help="What NN-Smoothing is taught: mesh (where nodes lie when whole meshes were optimised, as in the "
            "paper), or star (where optimisation puts the node of each star as it stands)."
        ),
    ] = "mesh",
    activation: Annotated[str, typer.Option(help="Of GMSNet 2: silu, or relu.")] = "silu",
    meshes: Annotated[
        str, typer.Option(help="What GMSNet 2 learns from: uniform (random squares), or mixed (graded, stretched too).")
    ] = "uniform",
    warm_up: Annotated[int, typer.Option(help="Epochs of GMSNet 2 on single stars, before whole sweeps.")] = 2000,
    sweep_rate: Annotated[
        float, typer.Option(help="Learning rate of GMSNet 2 at the start of the epochs of whole sweeps.")
    ] = 1e-2,
    power: Annotated[int, typer.Option(help="p of the mean of q^p that whole sweeps of GMSNet 2 minimise.")] = 4,
    epochs: Annotated[int, typer.Option(help="Adam steps, one an epoch; 4500 for GMSNet 2.")] = 4000,
    nodes_per_mesh: Annotated[
        int,
        typer.Option(
            help="Nodes that an epoch draws from each training mesh, for each network; for GMSNet 2 those inside each "
            "mesh of whole sweeps (250)."
        ),
    ] = 32,
    learning_rate: Annotated[float, typer.Option(help="Learning rate at the start.")] = 1e-2,
    decay: Annotated[float, typer.Option(help="Factor of the learning rate when validation stalls.")] = 0.5,
    patience: Annotated[int, typer.Option(help="Epochs without a better validation loss until then.")] = 150,
    seed: Annotated[int, typer.Option(help="Of the first weights and of the nodes that are drawn.")] = 0,
    mesh_seed: Annotated[int, typer.Option(help="Of the 20 random squares.")] = 0,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on from the checkpoint in --out, with its options.")
    ] = False,
) -> None:
    """Train a model on 20 random Delaunay squares (12 to train, 4 to validate, 4 to test).

    GMSNet learns without labels, NN-Smoothing from labels that optimisation makes. Writes MODEL.safetensors (for gmsnet
    smooth --weights), history.csv, curves.png and checkpoint.safetensors.
    """
    from gmsnet.learn.train import Ending, check_folder
    from gmsnet.learn.train import train as run

    options = _options(context, out, model, resume=resume)
    check_folder(options, out, resume=resume)
    typer.echo(f"{options.command}: {options.epochs:,} epochs, into {out}", err=True)
    try:
        with _stop_on_signal() as should_stop, _bar(options.epochs) as on_epoch:
            result = run(options, out, resume=resume, on_epoch=on_epoch, should_stop=should_stop)
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; what {out} holds is that of the last checkpoint, if there was one") from None
    if result.ending is Ending.DIVERGED:
        raise InputError(
            f"the training diverged in epoch {result.epochs:,}; its curves so far are {result.files[-1]}; "
            f"take a lower --learning-rate, another --loss or another --seed"
        )
    if result.ending is Ending.STOPPED:
        typer.echo(
            f"stopped after {result.epochs:,} of {options.epochs:,} epochs; "
            f"go on with: gmsnet train --resume --out {out}",
            err=True,
        )
        raise SystemExit(STOPPED)  # Typer itself gives this code to an interruption that nothing was said about
    _report(result)


def _options(context: typer.Context, out: Path, model: str, *, resume: bool) -> ModelOptions:
    """The options as given; when resuming, those of the checkpoint with what was given on top."""
    from gmsnet.learn.checkpoint import saved_options
    from gmsnet.learn.options import changed, options_for

    values = {name: value for name, value in context.params.items() if name not in _NO_OPTIONS}
    given = {name: value for name, value in values.items() if _is_given(context, name)}
    saved = saved_options(out) if resume else None
    if saved is None:
        return options_for(model, given)
    if _is_given(context, "model") and model != saved.model:
        raise InputError(f"{out}: the training there is of --model {saved.model}, not {model}")
    return changed(saved, given)


def _is_given(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name != "DEFAULT"


@contextmanager
def _stop_on_signal() -> Iterator[Callable[[], bool]]:
    """Ctrl-C and SIGTERM end the training after the current epoch; a second one ends it at once."""
    with Deferral() as deferral:
        deferral.begin()
        yield lambda: deferral.caught


@contextmanager
def _bar(epochs: int) -> Iterator[Callable[[EpochDone], None]]:
    """A progress bar on standard error, if that is a terminal."""
    from rich import progress as parts
    from rich.console import Console

    console = Console(stderr=True)
    columns = (
        parts.TextColumn("training"),
        parts.BarColumn(),
        parts.MofNCompleteColumn(),
        parts.TextColumn("{task.fields[losses]}"),
        parts.TimeRemainingColumn(),
    )
    with parts.Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("training", total=epochs, losses="")

        def on_epoch(at: EpochDone) -> None:
            train, validation, _, rate = (sum(values) / len(at.rows) for values in zip(*at.rows.values(), strict=True))
            losses = f"loss {train:.4g}, validation {validation:.4g}, rate {rate:.1g}"
            bar.update(task, completed=at.epoch, losses=losses)

        yield on_epoch


def _report(result: TrainResult) -> None:
    losses, title = result.losses, result.options.loss_title
    best = losses["validation_loss"]
    if "validation_loss_optimum" in losses:
        before, optimum = losses["validation_loss_before"], losses["validation_loss_optimum"]
        share = (before - best) / (before - optimum)
        typer.echo(
            f"{title}: validation {best:.4f}, {share:.0%} of the way from {before:.4f} before "
            f"to {optimum:.4f}, the optimum of each star by itself; test {losses['test_loss']:.4f}"
        )
    else:
        typer.echo(f"{title}: validation {best:.4g}, test {losses['test_loss']:.4g}")
    for name in ("validation", "test"):
        before, after = losses[f"{name}_metric_loss_before"], losses[f"{name}_metric_loss"]
        typer.echo(f"MetricLoss of the {name} meshes: {before:.4f} before, {after:.4f} after")
    for path in result.files:
        typer.echo(f"wrote {path}")
