"""Asking for memory ahead of time: the processor fetches it while it computes something else."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

READ, NEAREST, DATA = 0, 3, 1  # what LLVM calls them: to be read; into all caches; no instructions


@intrinsic
def prefetch(_context: Any, array: Any, row: Any) -> Any:
    """Has the beginning of a row (unsigned) of an array fetched into the cache; nothing else changes."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        held = context.make_array(signature.args[0])(context, builder, arguments[0])
        to_row = builder.mul(builder.zext(arguments[1], ir.IntType(64)), builder.extract_value(held.strides, 0))
        address = builder.gep(builder.bitcast(held.data, cgutils.voidptr_t), [to_row])
        number = ir.IntType(32)
        form = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, number, number, number])
        function = builder.module.declare_intrinsic("llvm.prefetch", [cgutils.voidptr_t], form)
        builder.call(function, [address, *(ir.Constant(number, value) for value in (READ, NEAREST, DATA))])
        return context.get_dummy_value()

    return types.void(array, row), generate
