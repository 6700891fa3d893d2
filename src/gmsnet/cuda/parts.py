"""What kernels are made of on a GPU instead: memory, comparisons, tables.

A thread of the GPU has arrays of a length that is known when a kernel is compiled. So a kernel is made for stars of up
to so many nodes, and its arrays are as long as the longest of them needs.
"""

from __future__ import annotations

import math
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from llvmlite import ir

from gmsnet.cuda.library import cuda, inside
from gmsnet.kernels.jit.load import address
from gmsnet.kernels.jit.retarget import Retarget
from gmsnet.kernels.simplex.jacobian3 import SIZE, solid_workspace
from gmsnet.kernels.simplex.slack3 import ALONE, FOR_ONE
from gmsnet.kernels.star.block import CORNERS, FLOORS, Blocks, ask_ahead, ring_row, workspace_for
from gmsnet.kernels.star.space import KEPT
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.star.stars import centre_of
from gmsnet.kernels.star.stars3 import aligned, aligned_of_star, workspace3_for

FEWEST = 32  # numbers in an array: as many as the counters of a workspace
OF_ARRAYS: tuple[Any, ...] = (ring_row, centre_of, workspace_for, workspace3_for)  # parts that return some
SAME = ("bool_", "float32", "float64", "int32", "int64", "uint16", "uint32", "uint64", "inf", "nan")  # of NumPy


def larger(one, other, third=None):
    """As Python's max is compiled for the processor: the first of what is not larger, nor a number."""
    found = other if other > one else one
    if third is None:
        return found
    return third if third > found else found


def smaller(one, other, third=None):
    """The same of min."""
    found = other if other < one else one
    if third is None:
        return found
    return third if third < found else found


def floor(x):
    """As NumPy's, a float."""
    return np.float64(math.floor(x))


def nothing(points, blocks, block):
    """Nobody asks ahead: other stars are visited meanwhile."""


def same(table):
    """A table itself stands for its address."""
    return table


def entry_of(kind, table, index):
    """As kernels.jit.load.load, of the table itself."""
    return table[index]


def room_for(blocks: Blocks | SpaceBlocks, besides: int) -> int:
    """How long arrays are for the stars of some blocks, of a kernel that needs ``besides`` for itself.

    A power of two, so that few kernels are compiled.
    """
    most, sizes = blocks.most, [besides, FEWEST]
    if isinstance(blocks, SpaceBlocks):
        sizes += [4 * most, KEPT * blocks.most_simplices, 0 if blocks.mixture is None else ALONE + FOR_ONE]
    else:
        sizes += [2 * (1 + most), FLOORS + most + CORNERS]
    return 1 << (max(sizes) - 1).bit_length()


@cache
def parts_for(room: int) -> Retarget:
    """What compiles kernels whose longest array has so many numbers."""
    names = {
        "LANES": 1, "LANES3": 1, "CELLS": 1, "np": _numpy(room), "max": compiled(larger), "min": compiled(smaller),
        "load": compiled(entry_of),
    }  # fmt: skip
    parts = {
        ask_ahead: compiled(nothing), address: compiled(same), aligned: _empty(FEWEST), aligned_of_star: _empty(room),
        solid_workspace: _solid_workspace(),
    }  # fmt: skip
    return Retarget(compiled, names, parts, inside("extending").intrinsic, inside("types"))


@cache
def compiled(function: Any) -> Any:
    """A function for kernels to call. What returns arrays of its own is written out where it is called."""
    codes = [each.py_func.__code__ for each in OF_ARRAYS]
    how = {"inline": "always"} if function.__code__ in codes else {"forceinline": True}
    return cuda().jit(function, device=True, **how)


def _numpy(room: int) -> ModuleType:
    """What kernels use of NumPy."""
    module = ModuleType("numpy")
    vars(module).update({name: getattr(np, name) for name in SAME})
    vars(module).update(empty=_empty(room), zeros=_empty(room, zero=True), floor=compiled(floor))
    vars(module).update(isfinite=math.isfinite, sqrt=math.sqrt, copysign=math.copysign)
    return module


@cache
def _solid_workspace() -> Any:
    """See kernels.simplex.jacobian3: far larger than what all other kernels need."""
    zeros = _empty(SIZE, zero=True)

    def workspace():
        return zeros(SIZE)

    return cuda().jit(workspace, device=True, inline="always")


def _empty(room: int, zero: bool = False) -> Any:
    """np.empty(size, dtype=np.float64), with room for so many numbers whatever the size. zero: of zeros."""
    types, cgutils = inside("types"), inside("cgutils")

    @inside("extending").intrinsic
    def empty(_context: Any, size: Any, dtype: Any = None) -> Any:
        number = types.float64 if dtype is None else dtype.dtype
        kind = types.Array(number, 1, "C")

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            length = context.cast(builder, arguments[0], signature.args[0], types.intp)
            row = ir.ArrayType(context.get_data_type(number), room)
            data = cgutils.alloca_once(builder, row)
            if zero:
                with cgutils.for_range(builder, context.get_constant(types.intp, room)) as loop:
                    place = cgutils.gep_inbounds(builder, data, 0, loop.index)
                    builder.store(ir.Constant(place.type.pointee, None), place)
            array = context.make_array(kind)(context, builder)
            bytes_each = context.get_constant(types.intp, 1 if number == types.boolean else number.bitwidth // 8)
            context.populate_array(
                array, data=builder.bitcast(data, array.data.type), shape=[length], strides=[bytes_each],
                itemsize=bytes_each, meminfo=None,
            )  # fmt: skip
            return array._getvalue()

        return kind(size, types.Omitted(None) if dtype is None else dtype), generate

    return empty
