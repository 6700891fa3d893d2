"""The state of a training in one file, so that it goes on after a kill as if nothing had happened.

The draws of an epoch depend on the seed and the epoch's number alone, so there is no state of a generator to keep;
what a trainee has made of its meshes by then is kept.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open

from gmsnet.errors import InputError
from gmsnet.io.atomic import replace_files
from gmsnet.learn.backend import LambdaLR, ReduceLROnPlateau, torch
from gmsnet.learn.encoding import safetensors_bytes
from gmsnet.learn.options import GMSNet2Options, ModelOptions, PlateauOptions, options_for
from gmsnet.learn.trainee import Row

NAME = "checkpoint.safetensors"
STATE = "trainee/"  # before the names of its tensors


@dataclass
class Member:
    """One network in training, and what changes from epoch to epoch.

    best: the parameters with the least validation loss so far, by name. least: that loss. history: a row an epoch.
    """

    net: torch.nn.Module
    optimizer: torch.optim.Adam
    schedule: ReduceLROnPlateau | LambdaLR
    best: dict[str, torch.Tensor] = field(default_factory=dict)
    least: float = np.inf
    history: list[Row] = field(default_factory=list)

    @classmethod
    def of(cls, net: torch.nn.Module, options: ModelOptions) -> Member:
        """The network at the start."""
        optimizer = torch.optim.Adam(net.parameters(), lr=options.learning_rate)
        if isinstance(options, PlateauOptions):
            return cls(net, optimizer, ReduceLROnPlateau(optimizer, factor=options.decay, patience=options.patience))
        assert isinstance(options, GMSNet2Options)
        return cls(net, optimizer, LambdaLR(optimizer, lambda epoch: options.rate(epoch) / options.learning_rate))

    def judge(self, row: Row) -> None:
        """Take down an epoch; keep the parameters if they are the best so far."""
        if isinstance(self.schedule, ReduceLROnPlateau):
            self.schedule.step(row.validation_loss)
        else:
            self.schedule.step()
        if row.validation_loss < self.least or not self.best:
            self.least = row.validation_loss
            self.best = {name: value.clone() for name, value in self.net.state_dict().items()}
        self.history.append(row)

    @property
    def diverged(self) -> bool:
        """A loss may be infinite for a while, as long as it and the parameters are numbers."""
        finite = all(bool(torch.isfinite(value).all()) for value in self.net.state_dict().values())
        return not finite or bool(np.isnan(self.history[-1].validation_loss))

    def tensors(self) -> dict[str, NDArray[Any]]:
        """The state but for that of the schedule."""
        tensors: dict[str, NDArray[Any]] = {"history": np.array(self.history, dtype=np.float64)}
        tensors |= {f"net/{name}": value.numpy() for name, value in self.net.state_dict().items()}
        tensors |= {f"best/{name}": value.numpy() for name, value in self.best.items()}
        for index, moments in self.optimizer.state_dict()["state"].items():
            tensors |= {f"adam/{index}/{name}": value.numpy() for name, value in moments.items()}
        return tensors

    def restore(self, tensors: Mapping[str, torch.Tensor], schedule: dict[str, Any]) -> None:
        """Take over the state that ``tensors`` gave, and the schedule's."""
        self.net.load_state_dict(_below(tensors, "net/"))
        self.best = _below(tensors, "best/")
        self.history = [Row(*row) for row in tensors["history"].tolist()]
        self.least = min(row.validation_loss for row in self.history)
        self.schedule.load_state_dict(schedule)
        state: dict[int, dict[str, torch.Tensor]] = {}
        for name, value in _below(tensors, "adam/").items():
            index, moment = name.split("/")
            state.setdefault(int(index), {})[moment] = value
        groups = self.optimizer.state_dict()["param_groups"]
        for group, rate in zip(groups, self.schedule.get_last_lr(), strict=True):
            group["lr"] = rate
        self.optimizer.load_state_dict({"state": state, "param_groups": groups})


def save(folder: Path, options: ModelOptions, members: Mapping[str, Member], state: Mapping[str, NDArray[Any]]) -> None:
    """Write the checkpoint into a folder, with the trainee's state. Raises InputError where it cannot be written."""
    tensors = {f"{name}/{key}": value for name, member in members.items() for key, value in member.tensors().items()}
    tensors |= {f"{STATE}{name}": value for name, value in state.items()}
    schedules = {name: member.schedule.state_dict() for name, member in members.items()}
    metadata = {"options": json.dumps(options.as_dict()), "schedules": json.dumps(schedules)}
    replace_files({str(folder / NAME): safetensors_bytes(tensors, metadata)})


def restore(folder: Path, members: Mapping[str, Member]) -> dict[str, torch.Tensor]:
    """Take over the state in a folder; returns that of the trainee. Raises InputError where it cannot be read."""
    tensors, metadata = _read(folder)
    schedules = json.loads(metadata["schedules"])
    for name, member in members.items():
        member.restore(_below(tensors, f"{name}/"), schedules[name])
    return _below(tensors, STATE)


@contextmanager
def understood(folder: Path) -> Iterator[None]:
    """While the state in a folder is taken over: InputError where it is none of this training."""
    try:
        yield
    except InputError:
        raise
    except (KeyError, IndexError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        raise InputError(f"{folder / NAME}: not the state of this training; delete it to start anew") from error


def saved_options(folder: Path) -> ModelOptions | None:
    """The options of the training whose checkpoint lies in a folder; None if there is none. Raises InputError."""
    if not (folder / NAME).exists():
        return None
    metadata = _read(folder)[1]
    try:
        values = json.loads(metadata["options"])
        return options_for(values.pop("model"), values)
    except (InputError, KeyError, TypeError, AttributeError, json.JSONDecodeError) as error:
        raise InputError(f"{folder / NAME}: no checkpoint of this version of gmsnet; take another --out") from error


def _below(tensors: Mapping[str, torch.Tensor], prefix: str) -> dict[str, torch.Tensor]:
    return {name.removeprefix(prefix): value for name, value in tensors.items() if name.startswith(prefix)}


def _read(folder: Path) -> tuple[dict[str, torch.Tensor], dict[str, str]]:
    path = folder / NAME
    try:
        with safe_open(path, framework="pt") as file:
            return {name: file.get_tensor(name) for name in file.keys()}, file.metadata() or {}  # noqa: SIM118 (not a dict)
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: this checkpoint cannot be read ({error}); delete it to start anew") from error
