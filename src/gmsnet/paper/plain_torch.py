"""OptimSmoothing, NN-Smoothing and GMSNet for one node at a time in PyTorch: the framework of the paper's timings.

Each is a ``Move`` as in ``plain``. They are written alike: tensors of one star, no batches of stars, all that does not
depend on the star made once. The free node and its ring are brought into the star's frame in float64; the methods
compute in float32.
"""

from __future__ import annotations

import os
from functools import cache

from gmsnet import weights
from gmsnet.kernels.methods.adam import BETA_1, BETA_2, EPSILON
from gmsnet.learn.backend import torch
from gmsnet.methods.optimize import step_sizes
from gmsnet.paper.plain import Move, Point, laplacian


def in_frame(x: Point, ring: list[Point], dtype: torch.dtype) -> tuple[torch.Tensor, float]:
    """The star's nodes (n + 1, 2) from x on, over d, the longer side of its bounding box; and d. x comes first."""
    nodes = torch.tensor([x, *ring], dtype=torch.float64)
    nodes = nodes - nodes[0]
    low, high = torch.aminmax(nodes, dim=0)
    d = float((high - low).max())
    return (nodes / d).to(dtype), d


def shifted(x: Point, shift: torch.Tensor, d: float) -> Point:
    """x + d·shift."""
    dx, dy = shift.tolist()
    return x[0] + d * dx, x[1] + d * dy


def gmsnet(path: str | os.PathLike[str] | None = None, dtype: torch.dtype = torch.float32) -> Move:
    """GMSNet (equations 4 to 8), dense: the features of all nodes of a star are one matrix, (n + 1) × H.

    path: of weights, by default the shipped ones. Of the graph convolution only the free node's row is computed, which
    is all that is used.
    """
    t = {name: torch.tensor(tensor, dtype=dtype) for name, tensor in weights.load(path).tensors.items()}
    linear = t["linear.weight"].T.contiguous()
    gcn, first, last = (t[f"{name}.weight"] for name in ("gcn", "mlp.0", "mlp.1"))
    linear_bias, gcn_bias, first_bias, last_bias = (t[f"{name}.bias"] for name in ("linear", "gcn", "mlp.0", "mlp.1"))
    gamma, beta, alpha = t["norm.weight"], t["norm.bias"], t["norm.mean_scale"]

    @cache
    def adjacency(nodes: int) -> torch.Tensor:
        """The free node's row of Ã, (n + 1)."""
        row = torch.full((nodes,), 0.5 * nodes**-0.5, dtype=dtype)
        row[0] = 1.0 / nodes
        return row

    @torch.inference_mode()
    def move(x: Point, ring: list[Point]) -> Point:
        nodes, d = in_frame(x, ring, dtype)
        features = torch.addmm(linear_bias, nodes, linear)
        features = torch.addcmul(features, features.mean(dim=0), alpha, value=-1.0)
        scale = gamma * torch.rsqrt(features.square().mean(dim=0) + 1e-5)
        normed = torch.addcmul(beta, features, scale)
        hidden = torch.addmv(gcn_bias, gcn, adjacency(len(nodes)) @ torch.relu(normed)) + normed[0]
        inner = torch.addmv(first_bias, first, hidden)
        variance, mean = torch.var_mean(inner, correction=0)
        inner = torch.relu((inner - mean) * torch.rsqrt(variance + 1e-5))
        return shifted(x, torch.addmv(last_bias, last, inner), d)

    return move


class MetricLoss:
    """1 − equation 10 of one star, as a function of the free node's place p: −(√3/n) Σ D/Q.

    D = a × b and Q = |a|² + |b|² − a·b with the spokes a = r − p and b = r′ − p: D is linear in p and Q is |p|² plus
    something linear, with coefficients that are the ring's alone, so that they are formed once for all steps.
    """

    turn: torch.Tensor
    doubled: torch.Tensor
    both: torch.Tensor
    squares: torch.Tensor
    scaled_turn: torch.Tensor
    scaled_doubled: torch.Tensor

    def __init__(self, ring: torch.Tensor) -> None:
        after, before = ring, ring.roll(1, dims=0)
        self.turn = torch.stack([before[:, 1] - after[:, 1], after[:, 0] - before[:, 0]], dim=1)  # ∇D, (n, 2)
        self.doubled = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]  # D at the origin, (n,)
        self.both = before + after
        self.squares = (before * before + after * after - before * after).sum(dim=1)  # Q at the origin
        factor = -(3.0**0.5) / len(ring)
        self.scaled_turn, self.scaled_doubled = factor * self.turn, factor * self.doubled

    def __call__(self, place: torch.Tensor) -> torch.Tensor:
        """The value at one place (2,)."""
        area = torch.addmv(self.scaled_doubled, self.scaled_turn, place)
        return area.dot((torch.addmv(self.squares, self.both, place, alpha=-1.0) + place.dot(place)).reciprocal())

    def best(self, places: torch.Tensor) -> torch.Tensor:
        """Of the places visited (K, 2), the one of least value, inside of the star if the first one is."""
        doubled = torch.addmm(self.doubled, places, self.turn.T)  # (K, n)
        squares = torch.addmm(self.squares, places, self.both.T, alpha=-1.0) + places.square().sum(dim=1, keepdim=True)
        inside = doubled.amin(dim=1) > 0.0
        values = torch.where(inside | ~inside[0], -(doubled / squares).sum(dim=1), torch.inf)
        return places[values.argmin()]


def optim_smoothing(dtype: torch.dtype = torch.float32) -> Move:
    """Twenty Adam steps on MetricLoss, the gradient by automatic differentiation.

    The step sizes, and what counts as the best place, are those of the compiled method (kernels.methods.adam). Adam is
    written out: with torch.optim.Adam a node takes half as long again, and twice as long with MetricLoss in terms of
    edges.
    """
    sizes = step_sizes().tolist()
    corrections = [(1.0 - BETA_1**t, 1.0 - BETA_2**t) for t in range(1, len(sizes) + 1)]
    schedule = [(-size / first, second**-0.5) for size, (first, second) in zip(sizes, corrections, strict=True)]
    epsilon = torch.tensor(EPSILON, dtype=dtype)

    def move(x: Point, ring: list[Point]) -> Point:
        nodes, d = in_frame(x, ring, dtype)
        loss = MetricLoss(nodes[1:])
        m, v, place = nodes.new_zeros(2), nodes.new_zeros(2), nodes.new_zeros(2)
        places = [place]
        for size, correction in schedule:
            place.requires_grad_()
            (gradient,) = torch.autograd.grad(loss(place), place)
            with torch.no_grad():
                m.lerp_(gradient, 1.0 - BETA_1)
                v.mul_(BETA_2).addcmul_(gradient, gradient, value=1.0 - BETA_2)
                place = torch.addcdiv(place, m, torch.add(epsilon, v.sqrt(), alpha=correction), value=size)
            places.append(place)
        with torch.no_grad():
            return shifted(x, loss.best(torch.stack(places)), d)

    return move


def nn_smoothing(path: str | os.PathLike[str] | None = None, dtype: torch.dtype = torch.float32) -> Move:
    """NN-Smoothing (Guo et al. 2021): the network of the ring's degree; to the mean of the ring in other degrees.

    path: of weights, by default the shipped ones.
    """
    t = {name: torch.tensor(tensor, dtype=dtype) for name, tensor in weights.load(path, model="nn").tensors.items()}
    degrees = {int(name.removeprefix("degree").split(".")[0]) for name in t}
    networks = {n: [(t[f"degree{n}.{k}.bias"], t[f"degree{n}.{k}.weight"]) for k in range(3)] for n in degrees}

    @torch.inference_mode()
    def move(x: Point, ring: list[Point]) -> Point:
        if len(ring) not in networks:
            return laplacian(x, ring)
        nodes, d = in_frame(x, ring, dtype)
        rim = nodes[1:]
        low, high = torch.aminmax(rim, dim=0)
        size = (high - low).max()
        first, second, last = networks[len(ring)]
        inner = torch.sigmoid(torch.addmv(*first, ((rim - low) / size).flatten()))
        inner = torch.sigmoid(torch.addmv(*second, inner))
        return shifted(x, low + size * torch.addmv(*last, inner), d)

    return move
