"""The one place that says how functions are compiled.

IEEE arithmetic stays as it is written, without fused or reordered operations: validity rests on it, and so does that
results are the same bits however and wherever a function was compiled. (With fast-math the last bits depended on
whether a function was compiled alone or into its caller; leaving it out costs about a twentieth of a sweep.)

Compiled code is kept on disk: in the folder that GMSNET_CACHE names, else beside the source or in the user's cache
folder; where none of them can be written, functions are compiled anew in each process.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any

if os.environ.get("GMSNET_CACHE"):
    os.environ.setdefault("NUMBA_CACHE_DIR", os.environ["GMSNET_CACHE"])  # Numba reads it when it is imported

from gmsnet.kernels.jit.usable import UnusableNumbaError

try:
    import numba
except ValueError as _error:  # it reads its settings as it is imported
    raise UnusableNumbaError(
        f"Numba cannot start: {_error} Look at the variables of the environment that begin with NUMBA_"
    ) from _error
if getattr(numba.config, "DISABLE_JIT", 0):
    raise UnusableNumbaError(
        "Numba is told not to compile, without which kernels would take hours: unset NUMBA_DISABLE_JIT"
    )

from numba.extending import typeof_impl

from gmsnet.kernels.jit.cache import KNOWN, make_trustworthy

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
LANES = 64  # stars or triangles that go through the processor in SIMD lanes


def options(version: tuple[int, ...]) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """What to tell Numba of kernels, of parts and of what is inlined. Our own compilers change nothing but the time."""
    if version > KNOWN:
        unseen = {**OPTIONS, "no_cpython_wrapper": True}
        return OPTIONS, unseen, {**unseen, "forceinline": True}
    from gmsnet.kernels.jit.compilers import InlinedCompiler, KernelCompiler, PartCompiler

    first, second, third = ({**OPTIONS, "pipeline_class": c} for c in (KernelCompiler, PartCompiler, InlinedCompiler))
    return first, second, third


KERNEL, PART, INLINED = options(numba.version_info.short)


class Kernel:
    """A function that Python calls, and kernels may. Numba is told of it when it is first called: most are not."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function

    @cached_property
    def inside(self) -> Callable[..., Any]:
        """What Numba makes of it."""
        try:
            compiled: Callable[..., Any] = numba.njit(cache=True, **KERNEL)(self.py_func)
        except RuntimeError:  # no folder for the cache can be written
            return numba.njit(**KERNEL)(self.py_func)  # type: ignore[no-any-return]
        make_trustworthy(compiled._cache)  # type: ignore[attr-defined]
        return compiled

    def __call__(self, *arguments: Any) -> Any:
        """Compiled, or taken from the disk, once for each set of types."""
        return self.inside(*arguments)


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile for Python to call, releasing the GIL, and keep on disk."""
    return update_wrapper(Kernel(function), function)


class Part:
    """A function that kernels call.

    What Python needs to call a function takes longer to compile than most parts do: it is made where Python calls one.
    A part must not print, nor raise an error with computed values in it: that needs Python. Where kernels are on disk,
    no part is needed: so Numba is told of one when it compiles a kernel that calls it.
    """

    py_func: Callable[..., Any]
    options: dict[str, Any]

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self.py_func, self.options = function, options

    @cached_property
    def inside(self) -> Callable[..., Any]:
        """What kernels call."""
        compiled: Callable[..., Any] = numba.njit(**self.options)(self.py_func)
        return compiled

    def __call__(self, *arguments: Any) -> Any:
        """For Python, compiled apart from what kernels call."""
        return self._for_python(*arguments)

    @cached_property
    def _for_python(self) -> Callable[..., Any]:
        return kernel(self.py_func)


@typeof_impl.register(Kernel)
@typeof_impl.register(Part)
def _inside(of: Kernel | Part, _: Any) -> Any:
    return numba.typeof(of.inside)


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile for kernels to call."""
    return update_wrapper(Part(function, PART), function)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile into its callers, however long it is: a loop over lanes that calls something is not vectorised."""
    return update_wrapper(Part(function, INLINED), function)
