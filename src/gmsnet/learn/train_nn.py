"""NN-Smoothing in training: for each degree a network that is to answer with the labels of its stars.

Each network draws its own nodes: as many of its degree from each mesh (all of a mesh that has fewer), each ring from
another beginning in every epoch, as the answer should not depend on where a ring begins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.learn import data
from gmsnet.learn.backend import torch
from gmsnet.learn.labels import Labelled, labelled
from gmsnet.learn.losses import metric_loss, truncation
from gmsnet.learn.model_nn import NNSmoothing, frame
from gmsnet.learn.options import NNOptions
from gmsnet.learn.trainee import Trainee
from gmsnet.mesh.mesh import Mesh
from gmsnet.weights.shapes import NN_HIDDEN


@dataclass(frozen=True)
class Rings:
    """Stars of one degree n in the frames of their rings, float32.

    ring: (B × n × 2). centre: (B × 2) where the free nodes are. label: (B × 2) where they should be. sizes: how many of
    each mesh, one mesh after another.
    """

    ring: torch.Tensor
    centre: torch.Tensor
    label: torch.Tensor
    sizes: Sequence[int]

    @classmethod
    def of(cls, degree: int, parts: Sequence[Labelled], *, raw: bool = False) -> Rings:
        """Those of a degree in some meshes; raw: only of the meshes as they are."""
        chosen = [(p.stars.degree == degree) & (np.arange(len(p.stars)) < (p.raw if raw else np.inf)) for p in parts]
        ring = np.concatenate([p.stars.ring[c, :degree] for p, c in zip(parts, chosen, strict=True) if c.any()])
        label = np.concatenate([p.place[c] for p, c in zip(parts, chosen, strict=True)])
        corners = torch.as_tensor(ring)
        low, size = frame(corners)
        return cls(
            ((corners - low[:, None]) / size[:, None]).float(),
            (-low / size).float(),
            ((torch.as_tensor(label) - low) / size).float(),
            [int(c.sum()) for c in chosen],
        )

    def loss(self, answer: torch.Tensor) -> torch.Tensor:
        """The mean squared distance to the labels."""
        return (answer - self.label).square().sum(dim=1).mean()

    def metric(self, place: torch.Tensor) -> torch.Tensor:
        """The mean MetricLoss with the free nodes moved to these places, their shifts truncated."""
        ring, degree = self.ring - self.centre[:, None], torch.full((len(self.ring),), self.ring.shape[1])
        shift = place - self.centre
        return metric_loss(ring, degree, truncation(ring, degree, shift)[:, None] * shift).mean()

    def drawn(self, rng: np.random.Generator, nodes_per_mesh: int) -> Rings:
        """A few of each mesh, each ring from a beginning drawn for it."""
        before = np.cumsum([0, *self.sizes[:-1]]).tolist()
        parts = [
            start + rng.choice(size, size=min(size, nodes_per_mesh), replace=False)
            for start, size in zip(before, self.sizes, strict=True)
        ]
        chosen = torch.as_tensor(np.concatenate(parts))
        degree = self.ring.shape[1]
        begin = torch.as_tensor(rng.integers(degree, size=len(chosen)))
        turned = (begin[:, None] + torch.arange(degree)) % degree
        return Rings(
            self.ring[chosen[:, None], turned], self.centre[chosen], self.label[chosen], [len(part) for part in parts]
        )


class NNTrainee(Trainee):
    """See trainee.Trainee; the networks are "degree3" … "degree9"."""

    model: NNSmoothing
    rings: dict[str, dict[int, Rings]]
    raw: dict[str, dict[int, Rings]]

    def __init__(self, options: NNOptions, meshes: Sequence[Mesh]) -> None:
        self.options = options
        self.model = NNSmoothing()
        self.nets: Mapping[str, torch.nn.Module] = dict(self.model.items())
        parts = [labelled(mesh, options.labels) for mesh in meshes]
        first, second, _ = data.SPLIT
        ends = {"training": (0, first), "validation": (first, first + second), "test": (first + second, len(parts))}
        kinds = {kind: parts[begin:end] for kind, (begin, end) in ends.items()}
        for kind, those in kinds.items():
            there = set(np.concatenate([part.stars.degree[: part.raw] for part in those]).tolist())
            if missing := [degree for degree in NN_HIDDEN if degree not in there]:
                raise InputError(
                    f"the {kind} meshes of --mesh-seed {options.mesh_seed} have no node of degree {missing[0]}; "
                    f"take another --mesh-seed"
                )
        self.rings = {kind: {n: Rings.of(n, those) for n in NN_HIDDEN} for kind, those in kinds.items()}
        self.raw = {kind: {n: Rings.of(n, those, raw=True) for n in NN_HIDDEN} for kind, those in kinds.items()}

    def training_losses(self, epoch: int) -> Mapping[str, torch.Tensor]:
        """See trainee.Trainee."""
        losses = {}
        for degree, rings in self.rings["training"].items():
            rng = np.random.default_rng([self.options.seed, epoch, degree])
            drawn = rings.drawn(rng, self.options.nodes_per_mesh)
            losses[f"degree{degree}"] = drawn.loss(self.model.of_degree(degree)(drawn.ring))
        return losses

    def validation_losses(self) -> Mapping[str, tuple[float, float]]:
        """See trainee.Trainee. Rings begin where they do in smoothing; MetricLoss is that of the meshes as they are."""
        losses = {}
        with torch.no_grad():
            for degree in NN_HIDDEN:
                net = self.model.of_degree(degree)
                rings, raw = self.rings["validation"][degree], self.raw["validation"][degree]
                losses[f"degree{degree}"] = (float(rings.loss(net(rings.ring))), float(raw.metric(net(raw.ring))))
        return losses

    def marks(self) -> dict[str, float]:
        """See trainee.Trainee: means over the stars of all degrees that have a network."""
        marks: dict[str, float] = {}
        nets = {degree: self.model.of_degree(degree) for degree in NN_HIDDEN}
        with torch.no_grad():
            for kind in ("validation", "test"):
                whole, raw = self.rings[kind], self.raw[kind]
                marks[f"{kind}_loss"] = _mean(whole, {n: rings.loss(nets[n](rings.ring)) for n, rings in whole.items()})
                places = {
                    "": {n: nets[n](rings.ring) for n, rings in raw.items()},
                    "_before": {n: rings.centre for n, rings in raw.items()},
                    "_of_labels": {n: rings.label for n, rings in raw.items()},
                }
                for name, place in places.items():
                    losses = {n: rings.metric(place[n]) for n, rings in raw.items()}
                    marks[f"{kind}_metric_loss{name}"] = _mean(raw, losses)
        return marks

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """See trainee.Trainee."""
        return self.model.tensors()


def _mean(rings: Mapping[int, Rings], losses: Mapping[int, torch.Tensor]) -> float:
    """The mean over the stars of all degrees."""
    counts = {degree: len(part.ring) for degree, part in rings.items()}
    return sum(float(losses[degree]) * count for degree, count in counts.items()) / sum(counts.values())
