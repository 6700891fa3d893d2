"""The one place that says how functions are compiled.

IEEE arithmetic stays as it is written, without fused or reordered operations: validity rests on it, and so does that
results are the same bits however and wherever a function was compiled. (With fast-math the last bits depended on
whether a function was compiled alone or into its caller; leaving it out costs about a twentieth of a sweep.)

Compiled code is kept on disk: in the folder that GMSNET_CACHE names, else beside the source or in the user's cache
folder; where none of them can be written, functions are compiled anew in each process.
"""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable
from functools import cached_property, update_wrapper
from pathlib import Path
from typing import Any

if folder := os.environ.get("GMSNET_CACHE"):
    os.environ.setdefault("NUMBA_CACHE_DIR", folder)  # Numba reads it when it is imported

import numba
from numba.extending import typeof_impl

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
LANES = 64  # stars or triangles that go through the processor abreast

SOURCES = hashlib.sha256(
    b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
).hexdigest()  # of all kernels together


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile for Python to call, releasing the GIL, and keep on disk."""
    try:
        compiled: Callable[..., Any] = numba.njit(cache=True, **OPTIONS)(function)
    except RuntimeError:  # no folder for the cache can be written
        return numba.njit(**OPTIONS)(function)  # type: ignore[no-any-return]
    _outlive_changes(compiled)
    return compiled


class Part:
    """A function that kernels call.

    What Python needs to call a function takes longer to compile than most parts do: it is made where Python calls one.
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        self.py_func = function
        self.inside = numba.njit(**{**OPTIONS, "no_cpython_wrapper": True, **options})(function)

    def __call__(self, *arguments: Any) -> Any:
        """For Python, compiled apart from what kernels call."""
        return self._for_python(*arguments)

    @cached_property
    def _for_python(self) -> Callable[..., Any]:
        return kernel(self.py_func)


@typeof_impl.register(Part)
def _inside(part: Part, _: Any) -> Any:
    return numba.typeof(part.inside)


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile for kernels to call."""
    return update_wrapper(Part(function), function)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile into its callers, however long it is: a loop over lanes that calls something is not vectorised."""
    return update_wrapper(Part(function, forceinline=True), function)


def _outlive_changes(compiled: Any) -> None:
    """Takes what was cached for stale if any kernel is another now, or if it cannot be read.

    Numba looks at the function's own file alone, though what it calls stands in others and is compiled into it. And it
    asks for the age of a cache only once that is unpickled, which fails where an argument's class stood in another
    module when it was written: after an upgrade, that is.
    """
    file = compiled._cache._cache_file
    file._source_stamp = (file._source_stamp, SOURCES)
    load = file._load_index

    def load_or_start_anew() -> Any:
        try:
            return load()
        except (AttributeError, ImportError, EOFError, pickle.UnpicklingError):
            return {}

    file._load_index = load_or_start_anew
