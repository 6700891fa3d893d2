"""NN-Smoothing, compiled: for each degree from 3 to 9 a small network that has learnt where optimisation puts a node.

The formulas stand in kernels/methods/nn.py, the model in learn/model_nn.py. Other degrees go to the mean of the ring,
as in the paper of GMSNet. A ring begins at its smallest node id: the networks see their input in order.

The variants are weights that were taught differently (learn/labels.py): "mesh" by where nodes lie when whole meshes
were optimised, as the paper has it; "star" by where optimisation puts the node of a star as it stands, which follows
from the ring and can be learnt better.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet import weights
from gmsnet.kernels.methods import nn as kernels
from gmsnet.kernels.star.block import Visit
from gmsnet.methods.base import TRIANGLES, Method, StarSmoother
from gmsnet.weights.shapes import NN_HIDDEN


class NNSmoothing(StarSmoother):
    """The networks with one set of weights."""

    table: NDArray[np.int64]
    flat: NDArray[np.float32]

    def __init__(self, trained: weights.Weights) -> None:
        self.table, self.flat = fold(trained)

    @property
    def in_plane(self) -> Visit:
        """See StarSmoother."""
        return Visit(kernels.sweep, (self.table, self.flat), None)


def fold(trained: weights.Weights) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """The weights as the kernel reads them: the table by degree (10 × 3) and all numbers, flat float32.

    Of each layer row by row: the bias, then the weights of the row, padded with zeros (kernels.methods.nn.padded).
    """
    table = np.full((max(NN_HIDDEN) + 1, 3), -1, dtype=np.int64)
    parts: list[NDArray[np.float32]] = []
    for degree, hidden in NN_HIDDEN.items():
        table[degree] = (sum(part.size for part in parts), *hidden)
        for layer in range(3):
            matrix = trained.tensors[f"degree{degree}.{layer}.weight"]
            bias = trained.tensors[f"degree{degree}.{layer}.bias"]
            wide = np.pad(matrix, ((0, 0), (0, kernels.padded(matrix.shape[1]) - matrix.shape[1])))
            parts.append(np.column_stack([bias, wide]).ravel())
    return table, np.concatenate(parts)


METHOD = Method(
    name="nn",
    summary="for each degree a small network that was taught by optimisation",
    source="Guo, Wang, Ma et al.: A new mesh smoothing method based on a neural network (2021)",
    create=lambda options: NNSmoothing(weights.load(options.weights, model="nn", variant=options.variant)),
    variants=tuple(weights.SHIPPED["nn"]),
    weighted=True,
    cells=TRIANGLES,
)
