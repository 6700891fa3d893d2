"""How a network is trained: the options of a training and the command that repeats it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from types import MappingProxyType
from typing import Any, ClassVar

from gmsnet.errors import InputError
from gmsnet.weights import LEAST_HIDDEN, MOST_HIDDEN

LOSS_TITLES = MappingProxyType(
    {
        "metric": "MetricLoss",
        "q": "aspect ratio loss",
        "cosine": "cosine loss",
        "min-max-angle": "min-max angle loss (radians)",
    }
)
LABELS = ("mesh", "star")  # where NN-Smoothing's labels come from, see ``labels``


@dataclass(frozen=True, kw_only=True)
class Options(ABC):
    """What all models have in common. Raises InputError for values out of range.

    epochs: Adam steps, one an epoch. nodes_per_mesh: how many free nodes of each training mesh an epoch draws for each
    network. learning_rate: at the start; it is multiplied by ``decay`` whenever the validation loss has not become
    better for ``patience`` epochs. seed: of the first weights and of the draws. mesh_seed: of the 20 meshes.
    """

    model: ClassVar[str]

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
                raise InputError(f"{flag(name)} must be at least {least}, got {value}")
        if not (math.isfinite(self.learning_rate) and self.learning_rate > 0):
            raise InputError(f"--learning-rate must be a positive number, got {self.learning_rate}")
        if not 0 < self.decay < 1:
            raise InputError(f"--decay must lie between 0 and 1, got {self.decay}")

    @property
    def command(self) -> str:
        """The command that trains with these options."""
        model = "" if self.model == "gmsnet" else f" --model {self.model}"
        given = [f" {flag(f.name)} {getattr(self, f.name)}" for f in fields(self) if getattr(self, f.name) != f.default]
        return f"gmsnet train{model}" + "".join(given)

    @property
    @abstractmethod
    def file_name(self) -> str:
        """Of the weights."""

    @property
    @abstractmethod
    def loss_title(self) -> str:
        """What is minimised, for the axis of a picture."""

    def as_dict(self) -> dict[str, Any]:
        """The model and the options by name."""
        return {"model": self.model, **asdict(self)}


@dataclass(frozen=True, kw_only=True)
class TrainOptions(Options):
    """For GMSNet. hidden: features H. loss: what is minimised, a name of ``losses.LOSSES``."""

    model = "gmsnet"

    hidden: int = 8
    loss: str = "metric"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not LEAST_HIDDEN <= self.hidden <= MOST_HIDDEN:
            raise InputError(f"--hidden must lie between {LEAST_HIDDEN} and {MOST_HIDDEN}, got {self.hidden}")
        if self.loss not in LOSS_TITLES:
            raise InputError(f"--loss must be one of {', '.join(LOSS_TITLES)}; got {self.loss!r}")

    @property
    def file_name(self) -> str:
        """Of the weights."""
        loss = "" if self.loss == "metric" else f"-{self.loss}"
        return f"gmsnet-h{self.hidden}{loss}.safetensors"

    @property
    def loss_title(self) -> str:
        """See Options."""
        return LOSS_TITLES[self.loss]


@dataclass(frozen=True, kw_only=True)
class NNOptions(Options):
    """For NN-Smoothing. labels: what it is taught, one of ``LABELS``."""

    model = "nn"

    labels: str = "mesh"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.labels not in LABELS:
            raise InputError(f"--labels must be one of {', '.join(LABELS)}; got {self.labels!r}")

    @property
    def file_name(self) -> str:
        """Of the weights."""
        return "nn.safetensors" if self.labels == "mesh" else f"nn-{self.labels}.safetensors"

    @property
    def loss_title(self) -> str:
        """See Options."""
        return "mean squared distance to the label"


MODELS: Mapping[str, type[Options]] = MappingProxyType({kind.model: kind for kind in (TrainOptions, NNOptions)})


def options_for(model: str, values: Mapping[str, Any]) -> Options:
    """The options of a model, by default but for these values. Raises InputError for those that it does not have."""
    if model not in MODELS:
        raise InputError(f"--model must be one of {', '.join(MODELS)}; got {model!r}")
    return changed(MODELS[model](), values)


def changed(options: Options, values: Mapping[str, Any]) -> Options:
    """These options with other values. Raises InputError for options that the model does not have."""
    known = {f.name for f in fields(options)}
    for name in values:
        if name not in known:
            raise InputError(f"{flag(name)} does not apply to --model {options.model}; leave it out")
    return replace(options, **values)


def flag(name: str) -> str:
    """The option of the command line."""
    return "--" + name.replace("_", "-")
