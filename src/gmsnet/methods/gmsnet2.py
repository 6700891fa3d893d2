"""GMSNet 2, the learned smoother that is trained against a barrier, compiled. The formulas stand in
kernels/methods/gmsnet2.py, the model in learn/model_gmsnet2.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet import weights
from gmsnet.kernels.methods import gmsnet2 as kernels
from gmsnet.kernels.star.block import Visit
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother

ACTIVATIONS = {"silu": kernels.SILU, "relu": kernels.RELU}


class GmsNet2(StarSmoother):
    """The network with one set of weights."""

    network: kernels.Network

    def __init__(self, trained: weights.Weights) -> None:
        self.network = fold(trained)

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(kernels.sweep, (self.network,), None)


def fold(trained: weights.Weights) -> kernels.Network:
    """The layers as the kernel reads them."""
    t, hidden = trained.tensors, trained.hidden
    zero = -hidden % 4

    def padded(matrix: NDArray[np.float32], bias: NDArray[np.float32] | None) -> NDArray[np.float32]:
        column = np.zeros(len(matrix), dtype=np.float32) if bias is None else bias
        return np.ascontiguousarray(np.column_stack([np.pad(matrix, ((0, 0), (0, zero))), column]))

    pool = t["pool.weight"]
    return kernels.Network(
        encode=np.column_stack([t["encode.weight"], t["encode.bias"]]),
        pool=padded(np.hstack([np.pad(pool[:, :hidden], ((0, 0), (0, zero))), pool[:, hidden:]]), t["pool.bias"]),
        triangle=padded(t["triangle.weight"], t["triangle.bias"]),
        context=padded(t["context.weight"], None),
        decode=padded(t["decode.weight"], t["decode.bias"]),
        activation=ACTIVATIONS[trained.activation],
    )


METHOD = Method(
    name="gmsnet2",
    summary="a graph neural network trained against a barrier: messages per triangle, one shift",
    source="this package; after the network of Wang, Chen, Yan, Liu (2023), see docs/learned.md",
    create=lambda options: GmsNet2(weights.load(options.weights, model="gmsnet2", variant=options.variant)),
    variants=tuple(weights.SHIPPED["gmsnet2"]),
    weighted=True,
    cells=TRIANGLES,
)
