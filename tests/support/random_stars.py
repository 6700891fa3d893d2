"""Random stars and weights for the tests."""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import gmsnet as kernels_gmsnet
from gmsnet.kernels.methods import gmsnet2 as kernels_gmsnet2
from gmsnet.kernels.methods import nn as kernels_nn
from gmsnet.kernels.star import block
from gmsnet.kernels.star import stars as kernels_stars
from gmsnet.methods.gmsnet import fold
from gmsnet.methods.gmsnet2 import fold as fold_gmsnet2
from gmsnet.methods.nn import fold as fold_nn
from gmsnet.weights import Weights, shapes


def star(rng, degree, size=1.0, offset=0.0):
    """A star-shaped polygon around a node that is not quite its centre: (centre, ring counter-clockwise)."""
    angles = np.sort(rng.random(degree) + np.arange(degree)) * 2 * np.pi / degree
    radius = 0.2 + rng.random(degree)
    ring = size * np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])
    centre = size * 0.1 * (rng.random(2) - 0.5)
    direction = rng.normal(size=2)
    away = offset * size * direction / np.linalg.norm(direction)
    return centre + away, ring + away


def random_weights(rng, hidden=8, scale=0.3):
    """Weights of an untrained network, with every parameter away from its neutral value."""
    tensors = {
        name: (scale * rng.normal(size=shape)).astype(np.float32) for name, shape in shapes.gmsnet(hidden).items()
    }
    tensors["norm.weight"] += np.float32(1)
    tensors["norm.mean_scale"] += np.float32(0.8)
    return Weights(model="gmsnet", tensors=tensors, metadata={})


def random_nn_weights(rng, scale=0.5):
    """Weights of untrained networks of NN-Smoothing that answer with places all over the ring."""
    tensors = {name: (scale * rng.normal(size=shape)).astype(np.float32) for name, shape in shapes.nn().items()}
    return Weights(model="nn", tensors=tensors, metadata={})


def random_gmsnet2_weights(rng, hidden=8, activation="silu", scale=0.5):
    """Weights of an untrained network of GMSNet 2 whose last layer is not zero."""
    tensors = {
        name: (scale * rng.normal(size=shape) / shape[-1] ** 0.5).astype(np.float32)
        for name, shape in shapes.gmsnet2(hidden).items()
    }
    return Weights(model="gmsnet2", tensors=tensors, metadata={"activation": activation})


def proposed(stars, propose, dtype=np.float64):
    """What a kernel proposes for (centre, ring) pairs, as shifts in the coordinates of each star.

    propose(local, n, shift) writes the shifts of a block, both arrays of the dtype that the kernel computes in.
    """
    out = np.empty((len(stars), 2))
    work = np.empty(block.FLOORS * LANES)
    shift = np.empty(2 * LANES, dtype=dtype)
    for k, (centre, ring) in enumerate(stars):
        n, lane = len(ring), k % LANES  # every lane takes its orientation; all hold the same star
        pairs = np.vstack([centre, ring]).astype(float).repeat(LANES, axis=0).ravel()
        local = np.empty(2 * n * LANES, dtype=dtype)
        kernels_stars.localise(pairs, n, work, local)
        propose(local, n, shift)
        out[k] = work[lane] * shift[[lane, LANES + lane]].astype(np.float64)
    return out


def compiled_shifts(stars, weights):
    """The shifts that the compiled GMSNet proposes for (centre, ring) pairs, in the coordinates of each star."""
    folded, hidden = fold(weights), weights.hidden
    row, m = np.empty(4 * LANES, dtype=np.float32), np.empty(5 * LANES, dtype=np.float32)
    decoded = np.empty(hidden * LANES, dtype=np.float32)
    features = np.zeros(8 * ((hidden + 3) // 4) * LANES, dtype=np.float32)

    def propose(local, n, shift):
        kernels_gmsnet.propose(local, n, folded, hidden, m, row, features, decoded, shift)

    return proposed(stars, propose, np.float32)


def compiled_gmsnet2_shifts(stars, weights):
    """As ``compiled_shifts``, by GMSNet 2."""
    network = fold_gmsnet2(weights)
    work = kernels_gmsnet2.workspace(network, max(len(ring) for _, ring in stars))

    def propose(local, n, shift):
        kernels_gmsnet2.propose(local, n, network, work, shift)

    return proposed(stars, propose, np.float32)


def compiled_nn_shifts(stars, weights):
    """As ``compiled_shifts``, by NN-Smoothing."""
    table, flat = fold_nn(weights)
    box, inputs, first, second, _ = kernels_nn.workspace(table)

    def propose(local, n, shift):
        kernels_nn.propose(local, n, table, flat, box, inputs, first, second, shift)

    return proposed(stars, propose, np.float32)


def size(centre, ring):
    """The larger side of the bounding box of a star."""
    return float(np.ptp(np.vstack([centre, ring]), axis=0).max())
