"""Names and shapes of the tensors of each model (float32; matrices as output × input), and what else a file may say."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

LEAST_HIDDEN, MOST_HIDDEN = 4, 64
ACTIVATIONS = ("silu", "relu")  # of GMSNet 2
NN_HIDDEN: Mapping[int, tuple[int, int]] = MappingProxyType(
    {3: (20, 6), 4: (20, 8), 5: (20, 10), 6: (24, 12), 7: (28, 14), 8: (32, 16), 9: (30, 18)}
)  # degree → neurons of the two hidden layers (Guo et al. 2021)


def gmsnet(hidden: int) -> dict[str, tuple[int, ...]]:
    """GMSNet with H hidden features.

    linear: W_l, b_l of equation (4). norm: γ, β, α of GraphNorm, (5). gcn: W_g, b_g, (7). mlp: (8).
    """
    h = hidden
    return {
        "linear.weight": (h, 2),
        "linear.bias": (h,),
        "norm.weight": (h,),
        "norm.bias": (h,),
        "norm.mean_scale": (h,),
        "gcn.weight": (h, h),
        "gcn.bias": (h,),
        "mlp.0.weight": (h, h),
        "mlp.0.bias": (h,),
        "mlp.1.weight": (2, h),
        "mlp.1.bias": (2,),
    }


def gmsnet2(hidden: int) -> dict[str, tuple[int, ...]]:
    """GMSNet 2 with H hidden features: W₁ to W₅ of kernels/methods/gmsnet2.py, in that order."""
    h = hidden
    return {
        "encode.weight": (h, 5),
        "encode.bias": (h,),
        "pool.weight": (h, 2 * h),
        "pool.bias": (h,),
        "triangle.weight": (h, h),
        "triangle.bias": (h,),
        "context.weight": (h, h),
        "decode.weight": (3, h),
        "decode.bias": (3,),
    }


def nn() -> dict[str, tuple[int, ...]]:
    """NN-Smoothing: for each degree n three layers, 2n → h₁ → h₂ → 2."""
    shapes: dict[str, tuple[int, ...]] = {}
    for degree, hidden in NN_HIDDEN.items():
        widths = (2 * degree, *hidden, 2)
        for layer in range(3):
            shapes[f"degree{degree}.{layer}.weight"] = (widths[layer + 1], widths[layer])
            shapes[f"degree{degree}.{layer}.bias"] = (widths[layer + 1],)
    return shapes
