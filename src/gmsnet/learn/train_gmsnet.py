"""GMSNet in training: drawn stars, shifts that are truncated (Algorithm 1), a loss of the star after the move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.learn import data, dense
from gmsnet.learn.backend import torch
from gmsnet.learn.losses import LOSSES, Loss, metric_loss, truncation
from gmsnet.learn.model import GMSNet
from gmsnet.learn.optimum import least_mean
from gmsnet.learn.options import TrainOptions
from gmsnet.learn.trainee import Trainee
from gmsnet.mesh.mesh import Mesh


@dataclass(frozen=True)
class Batch:
    """Stars ready for the network. ring: (B × M × 2) float32, scaled and relative to the free node; degree: (B,)."""

    ring: torch.Tensor
    degree: torch.Tensor

    @classmethod
    def of_stars(cls, stars: data.Stars) -> Batch:
        """All of these stars."""
        return cls(torch.as_tensor(stars.ring, dtype=torch.float32), torch.as_tensor(stars.degree))

    def part(self, chosen: torch.Tensor) -> Batch:
        """Some of the stars, by their numbers."""
        degree = self.degree[chosen]
        return Batch(self.ring[chosen, : int(degree.max())], degree)

    def moved(self, net: GMSNet) -> torch.Tensor:
        """(B × 2) where the network puts the free nodes, their shifts truncated."""
        shift = dense.shifts(net, self.ring, self.degree)
        return truncation(self.ring, self.degree, shift.detach())[:, None] * shift

    def mean(self, loss: Loss, position: torch.Tensor) -> torch.Tensor:
        """The mean of a loss over the stars with their free nodes at these positions."""
        return loss(self.ring, self.degree, position).mean()


class GMSNetTrainee(Trainee):
    """See trainee.Trainee; one network, "gmsnet"."""

    net: GMSNet
    sizes: list[int]
    training: Batch
    validation: Batch
    testing: Batch

    def __init__(self, options: TrainOptions, meshes: Sequence[Mesh]) -> None:
        parts = [data.Stars.of_mesh(mesh) for mesh in meshes]
        self.options = options
        self.net = GMSNet(options.hidden)
        self.nets: Mapping[str, torch.nn.Module] = {"gmsnet": self.net}
        self.loss: Loss = LOSSES[options.loss]
        first, second, _ = data.SPLIT
        self.sizes = [len(part) for part in parts[:first]]
        self.training = Batch.of_stars(data.joined(parts[:first]))
        self.validation = Batch.of_stars(data.joined(parts[first : first + second]))
        self.testing = Batch.of_stars(data.joined(parts[first + second :]))

    def training_losses(self, epoch: int) -> Mapping[str, torch.Tensor]:
        """See trainee.Trainee. The same number of stars of each mesh (all of a mesh that has fewer)."""
        rng = np.random.default_rng([self.options.seed, epoch])
        before = np.cumsum([0, *self.sizes[:-1]]).tolist()
        drawn = [
            start + rng.choice(size, size=min(size, self.options.nodes_per_mesh), replace=False)
            for start, size in zip(before, self.sizes, strict=True)
        ]
        batch = self.training.part(torch.as_tensor(np.concatenate(drawn)))
        return {"gmsnet": batch.mean(self.loss, batch.moved(self.net))}

    def validation_losses(self) -> Mapping[str, tuple[float, float]]:
        """See trainee.Trainee."""
        with torch.no_grad():
            moved = self.validation.moved(self.net)
            own = float(self.validation.mean(self.loss, moved))
            same = self.loss is metric_loss
            return {"gmsnet": (own, own if same else float(self.validation.mean(metric_loss, moved)))}

    def marks(self) -> dict[str, float]:
        """See trainee.Trainee: before any move, after the network's, and the optimum of each validation star."""
        marks = {}
        with torch.no_grad():
            for name, batch in (("validation", self.validation), ("test", self.testing)):
                still, moved = torch.zeros(len(batch.ring), 2), batch.moved(self.net)
                marks[f"{name}_loss_before"] = float(batch.mean(self.loss, still))
                marks[f"{name}_loss"] = float(batch.mean(self.loss, moved))
                marks[f"{name}_metric_loss_before"] = float(batch.mean(metric_loss, still))
                marks[f"{name}_metric_loss"] = float(batch.mean(metric_loss, moved))
            marks["validation_loss_optimum"] = least_mean(self.validation.ring, self.validation.degree, self.loss)
        return marks

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """See trainee.Trainee."""
        return self.net.tensors()
