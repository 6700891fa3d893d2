"""Whether the options of ``smooth`` can be used at all. What a mesh must be like is checked where meshes are made."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from gmsnet.errors import InputError
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.measure.report import ASPECT, SHAPE
from gmsnet.preserve.protection import PRESERVE


def check_arguments(
    *, max_sweeps: Any, threads: Any, target_quality: Any, target_angle: Any, seed: Any, callback: Any, weights: Any,
    best_by: Any, guard: Any, preserve: Any, fix_layers: Any, untangle: Any,
) -> None:  # fmt: skip
    """Raises InputError, naming the option and what it must be, for the first one that cannot be used.

    max_sweeps: a whole number of 0 or more. threads: None, or one of 1 or more. target_quality: None, or a number in
    (0, 1]. target_angle: None, or a number in (0, 60]. seed: a whole number of 0 or more. callback: None or a function.
    weights: None or the path of a file. best_by: SHAPE or ASPECT. guard: one of LEVELS. preserve: one of PRESERVE.
    fix_layers, untangle: True or False. Whole numbers may be NumPy's; True and False are no numbers here.
    """
    if not _is_whole(max_sweeps, 0):
        raise InputError(f"max_sweeps must be a whole number of 0 or more, got {max_sweeps!r}")
    if threads is not None and not _is_whole(threads, 1):
        raise InputError(f"threads must be a whole number of 1 or more, got {threads!r}")
    if target_quality is not None and not _is_number(target_quality, 1.0):
        raise InputError(f"target_quality is the minimum 1/q of a cell and must lie in (0, 1], got {target_quality!r}")
    if target_angle is not None and not _is_number(target_angle, 60.0):
        raise InputError(
            f"target_angle is the minimum angle of a cell in degrees and must lie in (0, 60], got {target_angle!r}"
        )
    if not _is_whole(seed, 0):
        raise InputError(f"seed must be a whole number of 0 or more, got {seed!r}")
    if callback is not None and not callable(callback):
        raise InputError(f"callback must be a function that takes a Sweep, got {callback!r}")
    if weights is not None and not isinstance(weights, (str, os.PathLike)):
        raise InputError(f"weights must be the path of a safetensors file, got {weights!r}")
    for name, value, names in (
        ("best_by", best_by, (SHAPE, ASPECT)), ("guard", guard, LEVELS), ("preserve", preserve, PRESERVE),
    ):  # fmt: skip
        if not isinstance(value, str) or value not in names:
            raise InputError(f"{name} must be one of {', '.join(map(repr, names))}; got {value!r}")
    for name, value in (("fix_layers", fix_layers), ("untangle", untangle)):
        if not isinstance(value, (bool, np.bool_)):
            raise InputError(f"{name} must be True or False, got {value!r}")


def _is_whole(value: Any, least: int) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool) and bool(value >= least)


def _is_number(value: Any, most: float) -> bool:
    numbers = (int, float, np.integer, np.floating)
    return isinstance(value, numbers) and not isinstance(value, bool) and bool(0.0 < value <= most)
