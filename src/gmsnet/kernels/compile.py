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

if folder := os.environ.get("GMSNET_CACHE"):
    os.environ.setdefault("NUMBA_CACHE_DIR", folder)  # Numba reads it when it is imported

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.typed_passes import NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes
from numba.extending import typeof_impl

from gmsnet.kernels.cache import make_trustworthy

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
LANES = 64  # stars or triangles that go through the processor abreast


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile for Python to call, releasing the GIL, and keep on disk."""
    try:
        compiled: Callable[..., Any] = numba.njit(cache=True, pipeline_class=KernelCompiler, **OPTIONS)(function)
    except RuntimeError:  # no folder for the cache can be written
        return numba.njit(pipeline_class=KernelCompiler, **OPTIONS)(function)  # type: ignore[no-any-return]
    make_trustworthy(compiled._cache)  # type: ignore[attr-defined]
    return compiled


class PartLibrary(JITCodeLibrary):
    """What a part is compiled to: LLVM's form, which kernels take up; machine code is made of the kernels alone."""

    def _finalize_final_module(self) -> None:
        self._finalized = True

    @property
    def codegen(self) -> PartLibrary:
        """Who is told where the machine code finds its constants in Python. There is none."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """See ``codegen``."""


class KernelCompiler(CompilerBase):
    """Compiles without those of Numba's passes that change no function here, but take a thirtieth of the time.

    They fuse arithmetic on whole arrays into one loop, and work comprehensions and inner functions into their places.
    """

    def define_pipelines(self) -> list[Any]:
        """See CompilerBase."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [each for each in passes.passes if each[0] not in (NopythonRewrites, InlineClosureLikes)]
        return [passes]


class PartCompiler(KernelCompiler):
    """Compiles a part.

    That Python cannot call it is set here, as it is not for kernels: so what Numba compiles of its own (``max``,
    ``numpy.empty``), once for each set of options, serves parts and kernels.
    """

    into_callers = False  # compile it into its callers, however long it is

    def define_pipelines(self) -> list[Any]:
        """See CompilerBase."""
        state = self.state
        state.library = PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_cpython_wrapper, state.flags.forceinline = True, self.into_callers
        return super().define_pipelines()


class InlinedCompiler(PartCompiler):
    """Compiles a part into its callers."""

    into_callers = True


class Part:
    """A function that kernels call.

    What Python needs to call a function takes longer to compile than most parts do: it is made where Python calls one.
    """

    def __init__(self, function: Callable[..., Any], compiler: type[PartCompiler]) -> None:
        self.py_func = function
        self.inside = numba.njit(pipeline_class=compiler, **OPTIONS)(function)

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
    return update_wrapper(Part(function, PartCompiler), function)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile into its callers, however long it is: a loop over lanes that calls something is not vectorised."""
    return update_wrapper(Part(function, InlinedCompiler), function)
