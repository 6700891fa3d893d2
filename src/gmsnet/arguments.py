"""Whether the options of ``smooth`` can be used at all. What a mesh must be like is checked where meshes are made."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from gmsnet.errors import InputError
from gmsnet.kernels.guard import LEVELS

SHAPE, ASPECT = "shape", "aspect"  # with which 1/q meshes on the way are compared: the loss's or Verdict's


def check_arguments(
    max_sweeps: Any,
    threads: Any,
    target_quality: Any,
    seed: Any,
    callback: Any,
    weights: Any,
    best_by: Any,
    guard: Any,
) -> None:
    """Raises InputError, naming the option and what it must be, for the first one that cannot be used.

    max_sweeps: a whole number of 0 or more. threads: None, or one of 1 or more. target_quality: None, or a number in
    (0, 1]. seed: a whole number of 0 or more. callback: None or a function. weights: None or the path of a file.
    best_by: SHAPE or ASPECT. guard: one of LEVELS. Whole numbers may be NumPy's; True and False are no numbers here.
    """
    if not _is_whole(max_sweeps, 0):
        raise InputError(f"max_sweeps must be a whole number of 0 or more, got {max_sweeps!r}")
    if threads is not None and not _is_whole(threads, 1):
        raise InputError(f"threads must be a whole number of 1 or more, got {threads!r}")
    if target_quality is not None and not _is_share(target_quality):
        raise InputError(f"target_quality is the least 1/q of a cell and must lie in (0, 1], got {target_quality!r}")
    if not _is_whole(seed, 0):
        raise InputError(f"seed must be a whole number of 0 or more, got {seed!r}")
    if callback is not None and not callable(callback):
        raise InputError(f"callback must be a function that takes a Sweep, got {callback!r}")
    if weights is not None and not isinstance(weights, (str, os.PathLike)):
        raise InputError(f"weights must be the path of a safetensors file, got {weights!r}")
    if best_by not in (SHAPE, ASPECT):
        raise InputError(f"best_by must be {SHAPE!r} or {ASPECT!r}, got {best_by!r}")
    if guard not in LEVELS:
        raise InputError(f"guard must be one of {', '.join(LEVELS)}; got {guard!r}")


def _is_whole(value: Any, least: int) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool) and bool(value >= least)


def _is_share(value: Any) -> bool:
    numbers = (int, float, np.integer, np.floating)
    return isinstance(value, numbers) and not isinstance(value, bool) and bool(0.0 < value <= 1.0)
