"""How Numba compiles kernels and their parts, less what neither needs: a tenth of the time.

This rests on how Numba works inside, the same from 0.60 to 0.68; see ``KNOWN`` in kernels.jit.cache.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core import ir, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.typed_passes import NativeLowering, NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes

# What gives an array that is there already, or a part of one.
VIEWS = ("getattr", "getitem", "static_getitem", "typed_getitem", "build_tuple", "exhaust_iter", "cast", "getiter",
         "iternext", "pair_first", "phi")  # fmt: skip


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


@register_pass(mutates_CFG=False, analysis_only=True)
class NoCounting(AnalysisPass):
    """Lets parts that only look at arrays of their caller not count who uses them.

    Numba counts each array of each tuple that a function is given, at each call: a fifth of a sweep over hexahedra. Its
    caller holds them meanwhile. A part that makes arrays, or returns some, counts, and so do kernels.
    """

    _name = "no_counting"

    def __init__(self) -> None:
        AnalysisPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """See AnalysisPass."""
        if makes_arrays(state):
            return False
        state.targetctx = state.targetctx.subtarget(enable_nrt=False)
        vars(state.targetctx).pop("nrt", None)  # what the context with counting has made of it
        return True


def makes_arrays(state: Any) -> bool:
    """May there be arrays in a function that are not its caller's?"""

    def holds(kind: Any) -> bool:
        return bool(state.targetctx.data_model_manager[kind].contains_nrt_meminfo())

    if holds(state.return_type):
        return True
    return any(
        _makes_array(each, state.typemap, holds) for block in state.func_ir.blocks.values() for each in block.body
    )


def _makes_array(statement: Any, kinds: Any, holds: Callable[[Any], bool]) -> bool:
    if isinstance(statement, ir.SetItem | ir.StaticSetItem):  # of slices, which may lie over each other
        return holds(kinds[statement.value.name])
    if not isinstance(statement, ir.Assign) or not isinstance(statement.value, ir.Expr):
        return False
    return holds(kinds[statement.target.name]) and not _is_view(statement.value, kinds, holds)


def _is_view(value: Any, kinds: Any, holds: Callable[[Any], bool]) -> bool:
    if value.op == "call":
        return isinstance(kinds[value.func.name], types.NamedTupleClass)
    if value.op == "getitem" and holds(kinds[value.index.name]):  # the rows of an array of numbers
        return False
    return value.op in VIEWS


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
        (passes,) = super().define_pipelines()
        passes.passes.insert(
            [each for each, _ in passes.passes].index(NativeLowering), (NoCounting, "arrays of callers")
        )
        return [passes]


class InlinedCompiler(PartCompiler):
    """Compiles a part into its callers."""

    into_callers = True
