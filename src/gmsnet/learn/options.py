"""How a network is trained: the options of a training and the command that repeats it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any

from gmsnet.errors import InputError
from gmsnet.weights import LEAST_HIDDEN, MOST_HIDDEN


@dataclass(frozen=True)
class TrainOptions:
    """Raises InputError for values out of range.

    hidden: features H. epochs: Adam steps, one an epoch. nodes_per_mesh: how many free nodes of each training mesh an
    epoch draws. learning_rate: at the start; it is multiplied by ``decay`` whenever the validation loss has not become
    better for ``patience`` epochs. seed: of the first weights and of the draws. mesh_seed: of the 20 meshes.
    """

    hidden: int = 8
    epochs: int = 4000
    nodes_per_mesh: int = 32
    learning_rate: float = 1e-2
    decay: float = 0.5
    patience: int = 150
    seed: int = 0
    mesh_seed: int = 0

    def __post_init__(self) -> None:
        for name, least in (("epochs", 1), ("nodes_per_mesh", 1), ("patience", 1), ("seed", 0), ("mesh_seed", 0)):
            value = getattr(self, name)
            if value < least:
                raise InputError(f"{_flag(name)} must be at least {least}, got {value}")
        if not LEAST_HIDDEN <= self.hidden <= MOST_HIDDEN:
            raise InputError(f"--hidden must lie between {LEAST_HIDDEN} and {MOST_HIDDEN}, got {self.hidden}")
        if not (math.isfinite(self.learning_rate) and self.learning_rate > 0):
            raise InputError(f"--learning-rate must be a positive number, got {self.learning_rate}")
        if not 0 < self.decay < 1:
            raise InputError(f"--decay must lie between 0 and 1, got {self.decay}")

    @property
    def command(self) -> str:
        """The command that trains with these options."""
        given = [
            f" {_flag(f.name)} {getattr(self, f.name)}" for f in fields(self) if getattr(self, f.name) != f.default
        ]
        return "gmsnet train" + "".join(given)

    def as_dict(self) -> dict[str, Any]:
        """The options by name."""
        return asdict(self)


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")
