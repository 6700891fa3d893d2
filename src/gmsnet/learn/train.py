"""Trains GMSNet: Algorithm 2 of the paper, without labels.

Each epoch draws nodes of every training mesh and makes one Adam step on all of them. A shift that would invert a
triangle is truncated first (Algorithm 1). The weights with the least validation loss are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gmsnet.errors import InputError
from gmsnet.io.atomic import reason, replace_files
from gmsnet.learn import data
from gmsnet.learn.backend import Data, torch
from gmsnet.learn.checkpoint import NAME, Schedule, State, saved_options
from gmsnet.learn.curves import check_plotting, csv_bytes, png_bytes
from gmsnet.learn.export import weights_bytes
from gmsnet.learn.losses import metric_loss, truncation
from gmsnet.learn.model import GMSNet, wheels
from gmsnet.learn.optimum import optimal_position
from gmsnet.learn.options import TrainOptions

CHECKPOINT_EVERY = 200  # epochs


@dataclass(frozen=True)
class Progress:
    """How far a training is: after ``epoch`` of ``epochs``, with the losses of this epoch."""

    epoch: int
    epochs: int
    train_loss: float
    validation_loss: float
    learning_rate: float


@dataclass(frozen=True)
class TrainResult:
    """What a training made.

    options: as used. epochs: done so far. finished: all of them; otherwise only the checkpoint was written.
    losses: MetricLoss by name ("validation_loss" of the best weights, and the marks that it is compared with).
    files: all that was written, the weights first if it is finished.
    """

    options: TrainOptions
    epochs: int
    finished: bool
    losses: dict[str, float]
    files: list[Path]


@dataclass(frozen=True)
class Batch:
    """Stars ready for the network. ring: (B × M × 2); degree: (B,); wheels: their graph."""

    ring: torch.Tensor
    degree: torch.Tensor
    wheels: Data

    @classmethod
    def of(cls, ring: torch.Tensor, degree: torch.Tensor) -> Batch:
        """The batch of padded rings in the frame of the network."""
        return cls(ring, degree, wheels(ring, degree))

    @classmethod
    def of_stars(cls, stars: data.Stars) -> Batch:
        """All of these stars, in float32."""
        return cls.of(torch.as_tensor(stars.ring, dtype=torch.float32), torch.as_tensor(stars.degree))

    def loss(self, net: torch.nn.Module) -> torch.Tensor:
        """The mean MetricLoss after the network's shift, truncated."""
        shift = net(self.wheels)
        moved = truncation(self.ring, self.degree, shift.detach())[:, None] * shift
        return metric_loss(self.ring, self.degree, moved).mean()


def train(
    options: TrainOptions,
    folder: Path,
    *,
    resume: bool = False,
    on_epoch: Callable[[Progress], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> TrainResult:
    """Train a network and write weights, curves and checkpoint into a folder (made if it is not there).

    resume: go on from the checkpoint in the folder; its options must be the same, but for the number of epochs.
    on_epoch: called after each epoch. should_stop: asked after each epoch; True ends the training with a checkpoint.

    The result depends on the options alone, bit for bit on the same machine, whether interrupted or not.
    Raises InputError where the folder holds a checkpoint and ``resume`` is not set, or the other way round.
    """
    check_plotting()
    check_folder(options, folder, resume=resume)
    with _reproducible():
        parts = [data.Stars.of_mesh(mesh) for mesh in data.meshes(options.mesh_seed)]
        first, second, _ = data.SPLIT
        training = _TrainingSet(parts[:first])
        validation = Batch.of_stars(data.joined(parts[first : first + second]))
        state = _start(options)
        if resume:
            state.restore(folder)
        while len(state.history) < options.epochs:
            progress = _epoch(state, options, training, validation)
            if on_epoch is not None:
                on_epoch(progress)
            stop = should_stop is not None and should_stop()
            if stop or len(state.history) % CHECKPOINT_EVERY == 0 or len(state.history) == options.epochs:
                state.save(folder, options)
            if stop and len(state.history) < options.epochs:
                best = min(row[1] for row in state.history)
                return TrainResult(options, len(state.history), False, {"validation_loss": best}, [folder / NAME])
        testing = Batch.of_stars(data.joined(parts[first + second :]))
        return _finish(state, options, folder, validation, testing)


class _TrainingSet:
    """The stars of the training meshes, from which each epoch draws."""

    def __init__(self, parts: list[data.Stars]) -> None:
        whole = data.joined(parts)
        self.ring = torch.as_tensor(whole.ring, dtype=torch.float32)
        self.degree = torch.as_tensor(whole.degree)
        self.sizes = [len(part) for part in parts]

    def draw(self, seed: int, epoch: int, nodes_per_mesh: int) -> Batch:
        """The same number of stars of each mesh (all of a mesh that has fewer)."""
        rng = np.random.default_rng([seed, epoch])
        before = np.cumsum([0, *self.sizes[:-1]]).tolist()
        drawn = [
            start + rng.choice(size, size=min(size, nodes_per_mesh), replace=False)
            for start, size in zip(before, self.sizes, strict=True)
        ]
        chosen = torch.as_tensor(np.concatenate(drawn))
        degree = self.degree[chosen]
        return Batch.of(self.ring[chosen, : int(degree.max())], degree)


def _start(options: TrainOptions) -> State:
    torch.manual_seed(options.seed)
    net = GMSNet(options.hidden)
    optimizer = torch.optim.Adam(net.parameters(), lr=options.learning_rate)
    schedule = Schedule(optimizer, factor=options.decay, patience=options.patience)
    return State(net, optimizer, schedule, {}, [])


def _epoch(state: State, options: TrainOptions, training: _TrainingSet, validation: Batch) -> Progress:
    epoch = len(state.history)
    rate = state.schedule.get_last_lr()[0]
    loss = training.draw(options.seed, epoch, options.nodes_per_mesh).loss(state.net)
    state.optimizer.zero_grad()
    loss.backward()  # type: ignore[no-untyped-call]
    state.optimizer.step()
    with torch.no_grad():
        validation_loss = float(validation.loss(state.net))
    if not np.isfinite(validation_loss):
        raise InputError(f"the training diverged in epoch {epoch + 1}; take a lower --learning-rate")
    state.schedule.step(validation_loss)
    if validation_loss < min((row[1] for row in state.history), default=np.inf):
        state.best = {name: value.clone() for name, value in state.net.state_dict().items()}
    state.history.append((float(loss.detach()), validation_loss, float(rate)))
    return Progress(epoch + 1, options.epochs, *state.history[-1])


def _finish(state: State, options: TrainOptions, folder: Path, validation: Batch, testing: Batch) -> TrainResult:
    net = GMSNet(options.hidden)
    net.load_state_dict(state.best)
    with torch.no_grad():
        marks = {
            "validation_loss_before": _mean_loss(validation, torch.zeros(len(validation.ring), 2)),
            "validation_loss_optimum": _mean_loss(validation, optimal_position(validation.ring, validation.degree)),
            "test_loss": float(testing.loss(net)),
            "test_loss_before": _mean_loss(testing, torch.zeros(len(testing.ring), 2)),
        }
    curve = [row[1] for row in state.history]
    shown = {"before": marks["validation_loss_before"], "optimum of each star": marks["validation_loss_optimum"]}
    contents = {
        f"gmsnet-h{options.hidden}.safetensors": weights_bytes(net.tensors(), options, curve, marks),
        "history.csv": csv_bytes(state.history),
        "curves.png": png_bytes(state.history, shown),
    }
    replace_files({str(folder / name): content for name, content in contents.items()})
    written = [folder / name for name in (*contents, NAME)]
    return TrainResult(options, len(curve), True, {"validation_loss": min(curve), **marks}, written)


def _mean_loss(batch: Batch, position: torch.Tensor) -> float:
    return float(metric_loss(batch.ring, batch.degree, position).mean())


def check_folder(options: TrainOptions, folder: Path, *, resume: bool) -> None:
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
