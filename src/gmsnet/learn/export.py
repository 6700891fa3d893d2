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
from gmsnet.learn.options import ModelOptions
from gmsnet.learn.trainee import Row
from gmsnet.weights import FORMAT_VERSION

PACKAGES = ("gmsnet", "torch", "torch_geometric", "numpy", "scipy")
CURVE_POINTS = 200  # of a validation curve that go into the metadata


def weights_bytes(
    tensors: Mapping[str, NDArray[np.float32]],
    options: ModelOptions,
    history: Mapping[str, Sequence[Row]],
    marks: Mapping[str, float],
) -> bytes:
    """The file of weights. history: of each network; marks: losses of the weights and what to compare with, by name."""
    curves = {name: [row.validation_loss for row in rows] for name, rows in history.items()}
    best = {name: int(np.nanargmin(curve)) for name, curve in curves.items()}
    metadata = {
        "format_version": FORMAT_VERSION,
        "model": options.model,
        "parameters": str(sum(tensor.size for tensor in tensors.values())),
        "command": options.command,
        "recipe": json.dumps(options.as_dict()),
        "seed": str(options.seed),
        **options.traits,
        "data": DESCRIPTION,
        "versions": json.dumps({name: version(name) for name in PACKAGES}),
        "validation_best_epoch": json.dumps({name: at + 1 for name, at in best.items()}),
        "validation_best_loss": json.dumps({name: round(curves[name][at], 8) for name, at in best.items()}),
        "validation_curve": json.dumps({name: _thinned(c) for name, c in curves.items()}, separators=(",", ":")),
        **{name: f"{value:.6g}" for name, value in marks.items()},
    }
    return safetensors_bytes(tensors, metadata)


def _thinned(curve: Sequence[float]) -> list[tuple[int, float]]:
    """About CURVE_POINTS of (epoch, loss), the last epoch among them."""
    stride = max(1, len(curve) // CURVE_POINTS)
    return [(k + 1, float(f"{curve[k]:.5g}")) for k in range(len(curve) - 1, -1, -stride)][::-1]
