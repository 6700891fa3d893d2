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
from gmsnet.weights.shapes import ACTIVATIONS

LOSS_TITLES = MappingProxyType(
    {
        "metric": "MetricLoss",
        "q": "aspect ratio loss",
        "cosine": "cosine loss",
        "min-max-angle": "min-max angle loss (radians)",
    }
)
LAST_RATE = 0.01
MESHES = ("uniform", "mixed")  # random squares; a third of them each as they are, graded, and stretched
LABELS = ("mesh", "star")  # where NN-Smoothing's labels come from, see ``labels``


@dataclass(frozen=True, kw_only=True)
class ModelOptions(ABC):
    """What all models have in common. Raises InputError for values out of range.

    epochs: Adam steps, one an epoch. nodes_per_mesh: how many free nodes of each training mesh an epoch draws for each
    network. learning_rate: at the start. seed: of the first weights and of the draws. mesh_seed: of the 20 meshes.
    """

    model: ClassVar[str]

    epochs: int = 4000
    nodes_per_mesh: int = 32
    learning_rate: float = 1e-2
    seed: int = 0
    mesh_seed: int = 0

    def __post_init__(self) -> None:
        self._check_least(epochs=1, nodes_per_mesh=1, seed=0, mesh_seed=0)
        self._check_rates("learning_rate")

    def _check_least(self, **least: int) -> None:
        for name, value in least.items():
            if getattr(self, name) < value:
                raise InputError(f"{flag(name)} must be at least {value}, got {getattr(self, name)}")

    def _check_rates(self, *names: str) -> None:
        for name in names:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"{flag(name)} must be a positive number, got {value}")

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

    @property
    def traits(self) -> dict[str, str]:
        """What the network is, beside its parameters; goes into the metadata of the weights."""
        return {}

    def as_dict(self) -> dict[str, Any]:
        """The model and the options by name."""
        return {"model": self.model, **asdict(self)}


@dataclass(frozen=True, kw_only=True)
class PlateauOptions(ModelOptions):
    """Of models whose learning rate is multiplied by ``decay`` whenever the validation loss has not become better for
    ``patience`` epochs."""

    decay: float = 0.5
    patience: int = 150

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_least(patience=1)
        if not 0 < self.decay < 1:
            raise InputError(f"--decay must lie between 0 and 1, got {self.decay}")


@dataclass(frozen=True, kw_only=True)
class TrainOptions(PlateauOptions):
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
        """See ModelOptions."""
        return LOSS_TITLES[self.loss]


@dataclass(frozen=True, kw_only=True)
class NNOptions(PlateauOptions):
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
        """See ModelOptions."""
        return "mean squared distance to the label"


@dataclass(frozen=True, kw_only=True)
class GMSNet2Options(ModelOptions):
    """For GMSNet 2 (train_gmsnet2). nodes_per_mesh: inside each mesh of the second stage, all of which are moved.

    hidden: features H. activation: one of weights.shapes.ACTIVATIONS. meshes: what is learned from, one of ``MESHES``.
    warm_up: so many of the epochs are the first stage. sweep_rate: the learning rate at the start of the second stage;
    in both it falls to LAST_RATE of its start along half a cosine. power: of q in the loss of the second stage.
    """

    model = "gmsnet2"

    epochs: int = 4500
    nodes_per_mesh: int = 250
    hidden: int = 8
    activation: str = "silu"
    meshes: str = "uniform"
    warm_up: int = 2000
    sweep_rate: float = 1e-2
    power: int = 4

    def __post_init__(self) -> None:
        super().__post_init__()
        if not LEAST_HIDDEN <= self.hidden <= MOST_HIDDEN:
            raise InputError(f"--hidden must lie between {LEAST_HIDDEN} and {MOST_HIDDEN}, got {self.hidden}")
        for name, names in (("activation", ACTIVATIONS), ("meshes", MESHES)):
            if getattr(self, name) not in names:
                raise InputError(f"{flag(name)} must be one of {', '.join(names)}; got {getattr(self, name)!r}")
        self._check_least(warm_up=0, power=1)
        self._check_rates("sweep_rate")

    def rate(self, epoch: int) -> float:
        """The learning rate of an epoch."""
        second = epoch >= self.warm_up
        first, end = (self.warm_up, self.epochs) if second else (0, self.warm_up)
        share = 0.5 + 0.5 * math.cos(math.pi * min(1.0, (epoch - first) / max(end - first, 1)))
        return (self.sweep_rate if second else self.learning_rate) * (LAST_RATE + (1.0 - LAST_RATE) * share)

    @property
    def file_name(self) -> str:
        """Of the weights."""
        return "gmsnet2.safetensors"

    @property
    def loss_title(self) -> str:
        """See ModelOptions."""
        return "¼ log mean q⁴, mean of ten sweeps"

    @property
    def traits(self) -> dict[str, str]:
        """See ModelOptions."""
        return {"activation": self.activation}


MODELS: Mapping[str, type[ModelOptions]] = MappingProxyType(
    {kind.model: kind for kind in (TrainOptions, GMSNet2Options, NNOptions)}
)


def options_for(model: str, values: Mapping[str, Any]) -> ModelOptions:
    """The options of a model, by default but for these values. Raises InputError for those that it does not have."""
    if model not in MODELS:
        raise InputError(f"--model must be one of {', '.join(MODELS)}; got {model!r}")
    return changed(MODELS[model](), values)


def changed(options: ModelOptions, values: Mapping[str, Any]) -> ModelOptions:
    """These options with other values. Raises InputError for options that the model does not have."""
    known = {f.name for f in fields(options)}
    for name in values:
        if name not in known:
            raise InputError(f"{flag(name)} does not apply to --model {options.model}; leave it out")
    return replace(options, **values)


def flag(name: str) -> str:
    """The option of the command line."""
    return "--" + name.replace("_", "-")
