"""What the loop of ``train`` needs to know of a model that it trains."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.learn.backend import torch


class Row(NamedTuple):
    """One epoch of one network: the losses before and after its step, and the learning rate of the step.

    train_loss: of the drawn nodes. validation_loss: the same loss, of all validation nodes. validation_metric_loss:
    their MetricLoss, whatever is minimised, so that trainings can be compared.
    """

    train_loss: float
    validation_loss: float
    validation_metric_loss: float
    learning_rate: float


class Trainee(ABC):
    """A model in training: one or more networks that share no parameters, each with an optimiser of its own.

    nets: by name. Losses are means over stars, those of the validation without a gradient.
    """

    nets: Mapping[str, torch.nn.Module]

    @abstractmethod
    def training_losses(self, epoch: int) -> Mapping[str, torch.Tensor]:
        """For each network the loss of the nodes that this epoch draws; their sum has gradients."""

    @abstractmethod
    def validation_losses(self) -> Mapping[str, tuple[float, float]]:
        """For each network its loss and the MetricLoss of the validation meshes."""

    @abstractmethod
    def marks(self) -> dict[str, float]:
        """Further losses of the networks as they are now, by name, and what to compare them with; takes seconds."""

    @abstractmethod
    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """The parameters under the names of the weights file."""

    def state(self) -> dict[str, NDArray[Any]]:
        """What else a later epoch depends on, by name, so that a training can go on; restored by ``restore``."""
        return {}

    def restore(self, state: Mapping[str, torch.Tensor]) -> None:
        """Take over what ``state`` gave."""
        assert not state
