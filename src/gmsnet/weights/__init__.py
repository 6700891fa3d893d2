"""Trained weights: safetensors files that carry in their metadata how they were made. Read without torch."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open

from gmsnet.errors import InputError
from gmsnet.weights import shapes
from gmsnet.weights.shapes import LEAST_HIDDEN, MOST_HIDDEN

FORMAT_VERSION = "1"
MOST_BYTES = 1 << 24  # of a file; the largest network takes a hundredth of it, the rest is room for what is said of it
SHIPPED: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "gmsnet": MappingProxyType(
            {
                "metric": "gmsnet-h8.safetensors",
                "cosine": "gmsnet-h8-cosine.safetensors",
                "min-max-angle": "gmsnet-h8-min-max-angle.safetensors",
            }
        ),
        "gmsnet2": MappingProxyType({"sweeps": "gmsnet2.safetensors"}),
        "nn": MappingProxyType({"mesh": "nn.safetensors", "star": "nn-star.safetensors"}),
    }
)  # model → variant, the default first → file beside this module
FIRST_BIAS = MappingProxyType({"gmsnet": "linear.bias", "gmsnet2": "encode.bias"})  # as long as the model is wide


@dataclass(frozen=True, eq=False)
class Weights:
    """The parameters of a model.

    model: "gmsnet", "gmsnet2" or "nn". tensors: name → float32 array, read-only, see ``shapes``. metadata: the recipe,
    the versions of the packages, the validation curve, …, all as text.
    """

    model: str
    tensors: Mapping[str, NDArray[np.float32]]
    metadata: Mapping[str, str]

    @property
    def parameters(self) -> int:
        """How many numbers they are."""
        return sum(tensor.size for tensor in self.tensors.values())

    @property
    def hidden(self) -> int:
        """GMSNet's H."""
        return len(self.tensors[FIRST_BIAS[self.model]])

    @property
    def activation(self) -> str:
        """GMSNet 2's, one of ``shapes.ACTIVATIONS``."""
        return self.metadata["activation"]


def load(path: str | os.PathLike[str] | None = None, *, model: str = "gmsnet", variant: str = "") -> Weights:
    """The weights in a file, by default those of a variant that come with the package ("": its first one).

    Raises InputError, with the file first, where it is missing or cut off, is no safetensors file, belongs to another
    model or format version, has a hidden width outside 4 to 64, or its tensors have the wrong names, shapes, type or
    values that are not finite.
    """
    if model not in SHIPPED:
        raise InputError(f"there are no weights for a model {model!r}; there are some for {', '.join(SHIPPED)}")
    if path is not None:
        if not os.fspath(path):
            raise InputError("the path of the weights is empty: name a safetensors file, or leave it out")
        return _load(Path(path), model)
    variants = SHIPPED[model]
    variant = variant or next(iter(variants))
    if variant not in variants:
        raise InputError(f"there are no weights of {model} for {variant!r}; there are some for {', '.join(variants)}")
    with as_file(files(__name__) / variants[variant]) as shipped:
        return _load(shipped, model)


def _load(path: Path, model: str) -> Weights:
    if not os.path.isfile(path):
        raise InputError(f"{path}: {'is no file' if os.path.exists(path) else 'there is no such file of weights'}")
    if os.path.getsize(path) > MOST_BYTES:
        raise InputError(f"{path}: too large for weights, which take at most {MOST_BYTES >> 20} MiB")
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = dict(file.metadata() or {})
            tensors = {name: np.asarray(file.get_tensor(name)) for name in file.keys()}  # noqa: SIM118 (not a dict)
    except (SafetensorError, OSError, TypeError, AttributeError, KeyError) as error:
        raise InputError(f"{path}: cannot be read as safetensors weights ({error}); is it whole?") from error
    if metadata.get("model") != model:
        found = f"of the model {metadata['model']!r}" if "model" in metadata else "without the name of a model"
        raise InputError(f"{path}: weights {found}, where those of {model!r} are needed (gmsnet train makes them)")
    if metadata.get("format_version") != FORMAT_VERSION:
        raise InputError(
            f"{path}: weights of format version {metadata.get('format_version')!r}, "
            f"but this gmsnet reads version {FORMAT_VERSION!r}"
        )
    first = FIRST_BIAS.get(model)
    hidden = tensors[first].size if first in tensors else 0
    if first is not None and not LEAST_HIDDEN <= hidden <= MOST_HIDDEN:
        raise InputError(
            f"{path}: the hidden width must lie between {LEAST_HIDDEN} and {MOST_HIDDEN}, here it is {hidden}"
        )
    if model == "gmsnet2" and metadata.get("activation") not in shapes.ACTIVATIONS:
        raise InputError(
            f"{path}: the activation must be one of {', '.join(shapes.ACTIVATIONS)}, "
            f"here it is {metadata.get('activation')!r}"
        )
    expected = {"nn": shapes.nn(), "gmsnet2": shapes.gmsnet2(hidden), "gmsnet": shapes.gmsnet(hidden)}[model]
    if tensors.keys() != expected.keys():
        names = ", ".join(sorted(tensors.keys() ^ expected.keys()))
        raise InputError(f"{path}: not the tensors of {model!r}; missing or unknown: {names}")
    for name, tensor in tensors.items():
        if tensor.shape != expected[name]:
            raise InputError(f"{path}: {name} must have the shape {expected[name]}, here it is {tensor.shape}")
        if tensor.dtype != np.float32:
            raise InputError(f"{path}: {name} must be of type float32, here it is {tensor.dtype}")
        if not np.isfinite(tensor).all():
            raise InputError(f"{path}: {name} holds values that are not finite")
        tensor.flags.writeable = False
    return Weights(model, MappingProxyType(tensors), MappingProxyType(metadata))


__all__ = ["FORMAT_VERSION", "LEAST_HIDDEN", "MOST_HIDDEN", "SHIPPED", "Weights", "load", "shapes"]
