"""The state of a training in one file, so that it goes on after a kill as if nothing had happened.

The draws of an epoch depend on the seed and the epoch's number alone, so there is no state of a generator to keep.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open

from gmsnet.errors import InputError
from gmsnet.io.atomic import replace_files
from gmsnet.learn.backend import torch
from gmsnet.learn.encoding import safetensors_bytes
from gmsnet.learn.options import TrainOptions

NAME = "checkpoint.safetensors"
Schedule = torch.optim.lr_scheduler.ReduceLROnPlateau


@dataclass
class State:
    """What changes from epoch to epoch.

    best: the parameters with the least validation loss so far, by name. history: for each epoch the training loss, the
    validation loss and the learning rate of its step.
    """

    net: torch.nn.Module
    optimizer: torch.optim.Adam
    schedule: Schedule
    best: dict[str, torch.Tensor]
    history: list[tuple[float, float, float]]

    def save(self, folder: Path, options: TrainOptions) -> None:
        """Write the checkpoint into a folder. Raises InputError where it cannot be written."""
        tensors: dict[str, NDArray[Any]] = {"history": np.array(self.history, dtype=np.float64).reshape(-1, 3)}
        tensors |= {f"net/{name}": value.numpy() for name, value in self.net.state_dict().items()}
        tensors |= {f"best/{name}": value.numpy() for name, value in self.best.items()}
        for index, moments in self.optimizer.state_dict()["state"].items():
            tensors |= {f"adam/{index}/{name}": value.numpy() for name, value in moments.items()}
        metadata = {"options": json.dumps(options.as_dict()), "schedule": json.dumps(self.schedule.state_dict())}
        replace_files({str(folder / NAME): safetensors_bytes(tensors, metadata)})

    def restore(self, folder: Path) -> None:
        """Take over the state in a folder. Raises InputError where it cannot be read."""
        tensors, metadata = _read(folder)
        self.net.load_state_dict(_below(tensors, "net/"))
        self.best = _below(tensors, "best/")
        self.history = [(train, val, rate) for train, val, rate in tensors["history"].tolist()]
        self.schedule.load_state_dict(json.loads(metadata["schedule"]))
        state: dict[int, dict[str, torch.Tensor]] = {}
        for name, value in _below(tensors, "adam/").items():
            index, moment = name.split("/")
            state.setdefault(int(index), {})[moment] = value
        groups = self.optimizer.state_dict()["param_groups"]
        for group, rate in zip(groups, self.schedule.get_last_lr(), strict=True):
            group["lr"] = rate
        self.optimizer.load_state_dict({"state": state, "param_groups": groups})


def saved_options(folder: Path) -> TrainOptions | None:
    """The options of the training whose checkpoint lies in a folder; None if there is none. Raises InputError."""
    if not (folder / NAME).exists():
        return None
    try:
        return TrainOptions(**json.loads(_read(folder)[1]["options"]))
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise InputError(f"{folder / NAME}: no checkpoint of this version of gmsnet; take another --out") from error


def _below(tensors: dict[str, torch.Tensor], prefix: str) -> dict[str, torch.Tensor]:
    return {name.removeprefix(prefix): value for name, value in tensors.items() if name.startswith(prefix)}


def _read(folder: Path) -> tuple[dict[str, torch.Tensor], dict[str, str]]:
    path = folder / NAME
    try:
        with safe_open(path, framework="pt") as file:
            return {name: file.get_tensor(name) for name in file.keys()}, file.metadata() or {}  # noqa: SIM118 (not a dict)
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: this checkpoint cannot be read ({error}); delete it to start anew") from error
