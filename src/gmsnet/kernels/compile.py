"""The one place that says how functions are compiled.

``kernel`` keeps IEEE arithmetic as written: everything that decides about validity rests on it.
``fast_kernel`` may fuse and reorder arithmetic, so that loops over lanes become vector instructions; it is for
proposals and measures, never for decisions.

Compiled code is kept on disk: in the folder that GMSNET_CACHE names, else beside the source or in the user's cache
folder; where none of them can be written, functions are compiled anew in each process.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

if folder := os.environ.get("GMSNET_CACHE"):
    os.environ.setdefault("NUMBA_CACHE_DIR", folder)  # Numba reads it when it is imported

import numba

LANES = 64  # stars or triangles that go through the processor abreast
FAST = {"contract", "reassoc", "nsz", "arcp"}  # but NaN and infinity stay what they are: the guard refuses them


def _compile(function: Callable[..., Any], fastmath: set[str] | bool) -> Callable[..., Any]:
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": fastmath}
    try:
        compiled: Callable[..., Any] = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no folder for the cache can be written
        compiled = numba.njit(**options)(function)
    return compiled


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with exact IEEE semantics, releasing the GIL."""
    return _compile(function, fastmath=False)


def fast_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with fused and reordered arithmetic, releasing the GIL."""
    return _compile(function, fastmath=FAST)
