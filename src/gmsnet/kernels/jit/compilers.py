"""How Numba compiles kernels and their parts, less what neither needs: a tenth of the time.

This rests on how Numba works inside, the same from 0.60 to 0.68; see ``KNOWN`` in kernels.jit.compile.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.typed_passes import NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes


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
