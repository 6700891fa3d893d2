"""Trains a model: Algorithm 2 of the paper for GMSNet; other models go through the same loop.

Each epoch draws nodes of every training mesh and makes one Adam step on all of them. Of each network the weights with
the least validation loss are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from types import MappingProxyType

from gmsnet.errors import InputError
from gmsnet.io.atomic import reason, replace_files
from gmsnet.learn import checkpoint, data
from gmsnet.learn.backend import torch
from gmsnet.learn.checkpoint import NAME, Member, saved_options
from gmsnet.learn.curves import check_plotting, csv_bytes, png_bytes
from gmsnet.learn.export import weights_bytes
from gmsnet.learn.options import GMSNet2Options, ModelOptions, NNOptions, TrainOptions
from gmsnet.learn.train_gmsnet import GMSNetTrainee
from gmsnet.learn.train_gmsnet2 import GMSNet2Trainee
from gmsnet.learn.train_nn import NNTrainee
from gmsnet.learn.trainee import Row, Trainee
from gmsnet.mesh.mesh import Mesh

CHECKPOINT_EVERY = 200  # epochs


class Ending(Enum):
    """How a training ended. Only a finished one has weights; a stopped one can go on from its checkpoint."""

    FINISHED = "finished"
    STOPPED = "stopped"
    DIVERGED = "diverged"


@dataclass(frozen=True)
class EpochDone:
    """How far a training is: after ``epoch`` of ``epochs``, with the losses of this epoch by network."""

    epoch: int
    epochs: int
    rows: Mapping[str, Row]


@dataclass(frozen=True)
class TrainResult:
    """What a training made.

    options: as used. ending: see Ending. history: for each network a row an epoch; that of a diverged training ends
    with the epoch after which a loss or a parameter was no number. losses: of the best weights and what to compare them
    with, by name (trainee.Trainee.marks); empty unless finished. files: all that was written, the weights first if it
    is finished.
    """

    options: ModelOptions
    ending: Ending
    history: Mapping[str, Sequence[Row]]
    losses: Mapping[str, float]
    files: Sequence[Path]

    @property
    def epochs(self) -> int:
        """How many were done."""
        return len(next(iter(self.history.values())))


def train(
    options: ModelOptions,
    folder: Path,
    *,
    resume: bool = False,
    on_epoch: Callable[[EpochDone], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> TrainResult:
    """Train a model and write weights, curves and checkpoint into a folder (made if it is not there).

    resume: go on from the checkpoint in the folder; its options must be the same, but for the number of epochs.
    on_epoch: called after each epoch. should_stop: asked after each epoch; True ends the training with a checkpoint.

    A training that diverges ends there, with its curves and without weights. The result depends on the options alone,
    bit for bit on the same machine, whether interrupted or not.
    Raises InputError where the folder holds a checkpoint and ``resume`` is not set, or the other way round.
    """
    check_plotting()
    check_folder(options, folder, resume=resume)
    with _reproducible():
        torch.manual_seed(options.seed)
        trainee = _trainee(options, data.meshes(options.mesh_seed))
        members = {name: Member.of(net, options) for name, net in trainee.nets.items()}
        if resume:
            with checkpoint.understood(folder):
                trainee.restore(checkpoint.restore(folder, members))
        history = {name: member.history for name, member in members.items()}
        done = len(next(iter(history.values())))
        for epoch in range(done, options.epochs):
            _epoch(trainee, members, epoch)
            if on_epoch is not None:
                on_epoch(EpochDone(epoch + 1, options.epochs, {name: rows[-1] for name, rows in history.items()}))
            if any(member.diverged for member in members.values()):
                return TrainResult(options, Ending.DIVERGED, history, {}, _write(folder, _curves(options, history)))
            stop = should_stop is not None and should_stop()
            last = epoch + 1 == options.epochs
            if stop or last or (epoch + 1) % CHECKPOINT_EVERY == 0:
                checkpoint.save(folder, options, members, trainee.state())
            if stop and not last:
                return TrainResult(options, Ending.STOPPED, history, {}, [folder / NAME])
        for member in members.values():
            member.net.load_state_dict(member.best)
        marks = trainee.marks()
        contents = {options.file_name: weights_bytes(trainee.tensors(), options, history, marks)}
        written = _write(folder, contents | _curves(options, history, marks))
        return TrainResult(options, Ending.FINISHED, history, marks, [*written, folder / NAME])


def _trainee(options: ModelOptions, meshes: Sequence[Mesh]) -> Trainee:
    if isinstance(options, NNOptions):
        return NNTrainee(options, meshes)
    if isinstance(options, GMSNet2Options):
        return GMSNet2Trainee(options, meshes)
    assert isinstance(options, TrainOptions)
    return GMSNetTrainee(options, meshes)


def _epoch(trainee: Trainee, members: Mapping[str, Member], epoch: int) -> None:
    losses = trainee.training_losses(epoch)
    rates = {name: float(member.schedule.get_last_lr()[0]) for name, member in members.items()}
    for member in members.values():
        member.optimizer.zero_grad()
    torch.stack(list(losses.values())).sum().backward()  # type: ignore[no-untyped-call]
    for member in members.values():
        member.optimizer.step()
    for name, (validation, metric) in trainee.validation_losses().items():
        members[name].judge(Row(float(losses[name].detach()), validation, metric, rates[name]))


def _curves(
    options: ModelOptions, history: Mapping[str, Sequence[Row]], marks: Mapping[str, float] = MappingProxyType({})
) -> dict[str, bytes]:
    names = {"before": "validation_loss_before", "optimum of each star": "validation_loss_optimum"}
    lines = {title: marks[name] for title, name in names.items() if name in marks}
    return {"history.csv": csv_bytes(history), "curves.png": png_bytes(history, options.loss_title, lines)}


def _write(folder: Path, contents: Mapping[str, bytes]) -> list[Path]:
    replace_files({str(folder / name): content for name, content in contents.items()})
    return [folder / name for name in contents]


def check_folder(options: ModelOptions, folder: Path, *, resume: bool) -> None:
    """Raises InputError where a training with these options cannot start in, or go on in, this folder."""
    saved = saved_options(folder)
    if resume and saved is None:
        raise InputError(f"{folder}: holds no {NAME}, so there is nothing to resume")
    if saved is not None and not resume:
        raise InputError(f"{folder}: holds a training already; go on with it (--resume) or take another --out")
    if saved is not None and replace(saved, epochs=options.epochs) != options:
        raise InputError(f"{folder}: the training there was started with other options: {saved.command}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: this folder cannot be made: {reason(error)}") from error


@contextmanager
def _reproducible() -> Iterator[None]:
    """One thread, deterministic algorithms, its own random numbers; afterwards all is as it was."""
    threads, deterministic = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    try:
        with torch.random.fork_rng(devices=[]):
            yield
    finally:
        torch.set_num_threads(threads)
        torch.use_deterministic_algorithms(deterministic)
