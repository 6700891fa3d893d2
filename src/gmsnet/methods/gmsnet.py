"""GMSNet, the paper's graph neural network, compiled. The formulas stand in kernels/methods/gmsnet.py, the model as
the paper prints it in learn/model.py. The variants are weights that were trained with different losses
(learn/losses.py)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet import weights
from gmsnet.kernels.methods import gmsnet as kernels
from gmsnet.kernels.star.block import Visit
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother


class GmsNet(StarSmoother):
    """The network with one set of weights."""

    hidden: int
    folded: NDArray[np.float32]

    def __init__(self, trained: weights.Weights) -> None:
        self.hidden = trained.hidden
        self.folded = fold(trained)

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(kernels.sweep, (self.folded, self.hidden), kernels.room_of(self.hidden))


def fold(trained: weights.Weights) -> NDArray[np.float32]:
    """The weights as the kernel reads them, flat float32.

    Per channel (W_l's two, b_l, γ, β, α); then, row by row, W₁·W_g and W₁ column by column in turns, with columns of
    zeros up to a multiple of four; then W₁·b_g + b₁ (H), W₂ (2 × H), b₂ (2).
    """
    t = {name: tensor.astype(np.float64) for name, tensor in trained.tensors.items()}
    first, last = t["mlp.0.weight"], t["mlp.1.weight"]
    columns = (t["linear.weight"], t["linear.bias"], t["norm.weight"], t["norm.bias"], t["norm.mean_scale"])
    with np.errstate(over="ignore", invalid="ignore"):  # what no float32 can hold: the guard drops its shifts
        mix = np.stack([first @ t["gcn.weight"], first], axis=2)  # (H, H, 2)
        parts = (
            np.column_stack(columns),
            np.pad(mix, ((0, 0), (0, -trained.hidden % 4), (0, 0))),
            first @ t["gcn.bias"] + t["mlp.0.bias"],
            last,
            t["mlp.1.bias"],
        )
        return np.concatenate([part.ravel() for part in parts]).astype(np.float32)


METHOD = Method(
    name="gmsnet",
    summary="the paper's graph neural network: one look at a node's one-ring, one shift",
    source="Wang, Chen, Yan, Liu: Proposing an intelligent mesh smoothing method with graph neural networks (2023)",
    create=lambda options: GmsNet(weights.load(options.weights, variant=options.variant)),
    variants=tuple(weights.SHIPPED["gmsnet"]),
    weighted=True,
    cells=TRIANGLES,
)
