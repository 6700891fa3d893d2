"""Trained networks as files of weights, with how they were made in the metadata.

No time stamps and no paths: the same training on the same machine gives the same bytes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from gmsnet.learn.data import DESCRIPTION
from gmsnet.learn.encoding import safetensors_bytes
from gmsnet.learn.options import TrainOptions
from gmsnet.weights import FORMAT_VERSION

PACKAGES = ("gmsnet", "torch", "torch_geometric", "numpy", "scipy")
CURVE_POINTS = 200  # of the validation curve that go into the metadata


def weights_bytes(
    tensors: Mapping[str, NDArray[np.float32]],
    options: TrainOptions,
    validation: Sequence[float],
    marks: Mapping[str, float],
) -> bytes:
    """The file of weights. validation: the loss after each epoch; marks: further losses to be noted, by name."""
    best = int(np.argmin(validation))
    stride = max(1, len(validation) // CURVE_POINTS)
    curve = [[epoch + 1, round(validation[epoch], 5)] for epoch in range(stride - 1, len(validation), stride)]
    metadata = {
        "format_version": FORMAT_VERSION,
        "model": "gmsnet",
        "hidden": str(options.hidden),
        "parameters": str(sum(tensor.size for tensor in tensors.values())),
        "loss": "MetricLoss",
        "command": options.command,
        "recipe": json.dumps(options.as_dict()),
        "seed": str(options.seed),
        "data": DESCRIPTION,
        "versions": json.dumps({name: version(name) for name in PACKAGES}),
        "validation_loss": f"{validation[best]:.6f}",
        "validation_best_epoch": str(best + 1),
        "validation_curve": json.dumps(curve, separators=(",", ":")),
        **{name: f"{value:.6f}" for name, value in marks.items()},
    }
    return safetensors_bytes(tensors, metadata)
