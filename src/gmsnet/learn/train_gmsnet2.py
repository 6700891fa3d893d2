"""GMSNet 2 in training: first on stars of meshes that it has smoothed itself, then through whole sweeps.

First stage: GROUPS groups of the training meshes are smoothed by the network as it is. Each epoch one colour of one
group is visited, and the loss is the mean over its stars of ½ log mean q² after the move; a group starts anew after
CYCLE sweeps. Second stage: GROUPS groups of small meshes; each epoch sweeps one group SWEEPS times, and the loss is the
mean over the sweeps and the meshes of ¼ log mean q⁴ after the sweep, differentiated through all of them; the next visit
of the group goes on from there, ROUNDS times. So the network learns from what it will meet.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.generate import random_mesh
from gmsnet.generate.graded import graded_mesh
from gmsnet.learn import data
from gmsnet.learn.backend import torch
from gmsnet.learn.model_gmsnet2 import GMSNet2
from gmsnet.learn.options import GMSNet2Options
from gmsnet.learn.sweeps import Meshes, proposal, star_loss, sweep
from gmsnet.learn.trainee import Trainee
from gmsnet.mesh.mesh import Mesh

GROUPS = 4  # of the first stage
SMALL_GROUPS, SMALL_MESHES = 24, 6  # of the second stage, and meshes in each
CYCLE = 14  # sweeps until a group of the first stage starts anew
SWEEPS, ROUNDS = 3, 3
JUDGED = 10  # sweeps over the validation meshes
JUDGE_EVERY = 50  # epochs; in between the last loss stands
MOST_GRADIENT = 0.25  # of each parameter: one sliver shall not undo what was learned
STRETCH = 4.0  # at most, of mixed training meshes


def _clipped(gradient: torch.Tensor) -> torch.Tensor:
    return gradient.clamp(-MOST_GRADIENT, MOST_GRADIENT)


class GMSNet2Trainee(Trainee):
    """See trainee.Trainee; one network, "gmsnet2"."""

    net: GMSNet2
    groups: list[Meshes]
    small: list[Meshes]
    points: list[Any]
    judged: dict[str, Meshes]
    epoch: int
    judgement: tuple[float, float]

    def __init__(self, options: GMSNet2Options, meshes: Sequence[Mesh]) -> None:
        self.options = options
        self.net = GMSNet2(options.hidden, options.activation)
        self.nets: Mapping[str, torch.nn.Module] = {"gmsnet2": self.net}
        for parameter in self.net.parameters():
            parameter.register_hook(_clipped)  # type: ignore[no-untyped-call]
        first, second, _ = data.SPLIT
        self.groups = [Meshes.joined(self._mixed(meshes[k:first:GROUPS])) for k in range(GROUPS)]
        seeds = np.random.SeedSequence(options.mesh_seed).generate_state(SMALL_GROUPS * SMALL_MESHES).tolist()
        small = [
            self._mixed([random_mesh(options.nodes_per_mesh, seed=seed) for seed in seeds[k::SMALL_GROUPS]])
            for k in range(SMALL_GROUPS)
        ]
        self.small = [Meshes.joined(group) for group in small]
        self.points = [group.start.clone() for group in (*self.groups, *self.small)]
        self.judged = {
            "validation": Meshes.joined(self._mixed(meshes[first : first + second])),
            "test": Meshes.joined(self._mixed(meshes[first + second :])),
        }
        self.epoch, self.judgement = 0, (math.inf, math.inf)

    def _mixed(self, meshes: Sequence[Mesh]) -> Sequence[Mesh]:
        """The meshes, or two of three of them made graded (of as many nodes) and stretched."""
        if self.options.meshes == "uniform":
            return meshes
        made = []
        for k, mesh in enumerate(meshes):
            nodes = len(mesh.points)
            rng = np.random.default_rng([self.options.mesh_seed, nodes, k])
            if k % 3 == 1:
                mesh = graded_mesh(nodes, 10.0 ** rng.uniform(0.5, 2.5), seed=int(rng.integers(2**31)))
            if k % 3 == 2:
                mesh = mesh.with_points(mesh.points * [1.0, rng.uniform(1.0, STRETCH)])
            made.append(mesh)
        return made

    def training_losses(self, epoch: int) -> Mapping[str, torch.Tensor]:
        """See trainee.Trainee."""
        self.epoch = epoch
        if epoch < self.options.warm_up:
            return {"gmsnet2": self._star_loss(epoch)}
        return {"gmsnet2": self._sweep_loss(epoch - self.options.warm_up)}

    def _star_loss(self, epoch: int) -> torch.Tensor:
        index = epoch % GROUPS
        group = self.groups[index]
        done, at = divmod(epoch // GROUPS, len(group.colours))
        if at == 0 and (done + index * CYCLE // GROUPS) % CYCLE == 0:  # not all groups in the same sweep
            self.points[index] = group.start.clone()
        colour = group.colours[at]
        ring, shift = proposal(self.net, self.points[index], colour)
        self.points[index] = self.points[index].index_add(0, colour.centre, shift.detach())
        return star_loss(ring, colour.degree, shift, 2).mean()

    def _sweep_loss(self, epoch: int) -> torch.Tensor:
        cycle, at = divmod(epoch, SMALL_GROUPS)
        index = int(np.random.default_rng([self.options.seed, cycle]).permutation(SMALL_GROUPS)[at])
        group = self.small[index]
        points = self.points[GROUPS + index] if (cycle + index) % ROUNDS else group.start
        losses = []
        for _ in range(SWEEPS):
            points = sweep(self.net, points, group.colours)
            losses.append(group.log_power(points, self.options.power).mean())
        self.points[GROUPS + index] = points.detach()
        return torch.stack(losses).mean()

    def validation_losses(self) -> Mapping[str, tuple[float, float]]:
        """See trainee.Trainee; looked at every JUDGE_EVERY epochs, and at the last one."""
        if (self.epoch + 1) % JUDGE_EVERY == 0 or self.epoch + 1 == self.options.epochs:
            self.judgement = self._judge(self.judged["validation"])
        return {"gmsnet2": self.judgement}

    def marks(self) -> dict[str, float]:
        """See trainee.Trainee."""
        marks = {}
        for name, meshes in self.judged.items():
            marks[f"{name}_loss_before"] = float(meshes.log_power(meshes.start, 4).mean())
            marks[f"{name}_metric_loss_before"] = meshes.metric(meshes.start)
            marks[f"{name}_loss"], marks[f"{name}_metric_loss"] = self._judge(meshes)
        return marks

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """See trainee.Trainee."""
        return self.net.tensors()

    def state(self) -> dict[str, NDArray[Any]]:
        """See trainee.Trainee: the points of all groups, and the last judgement."""
        points = {f"points/{k}": points.numpy() for k, points in enumerate(self.points)}
        return {**points, "judgement": np.array(self.judgement)}

    def restore(self, state: Mapping[str, torch.Tensor]) -> None:
        """See trainee.Trainee."""
        self.points = [state[f"points/{k}"] for k in range(len(self.points))]
        loss, metric = state["judgement"].tolist()
        self.judgement = loss, metric

    def _judge(self, meshes: Meshes) -> tuple[float, float]:
        """¼ log mean q⁴ after 1 to JUDGED sweeps, on the average; MetricLoss after the last one."""
        with torch.no_grad():
            points, losses = meshes.start, []
            for _ in range(JUDGED):
                points = sweep(self.net, points, meshes.colours)
                losses.append(meshes.log_power(points, 4).mean())
            return float(torch.stack(losses).mean()), meshes.metric(points)
