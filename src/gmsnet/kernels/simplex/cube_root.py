"""Cube roots that SIMD lanes can take, with the same bits on every processor."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from gmsnet.kernels.jit.compile import inlined

HALF: Any = ir.IntType(32)
WHOLE: Any = ir.IntType(64)
THIRD_OF_BIAS = 715094163  # (1023 − 1023/3 − 0.033)·2²⁰: the exponent's bias after a division by three


@intrinsic
def upper_half(_context: Any, x: Any) -> Any:
    """The upper 32 bits of a float64 as an int32."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], WHOLE)
        return builder.trunc(builder.lshr(bits, ir.Constant(WHOLE, 32)), HALF)

    return types.int32(types.float64), generate


@intrinsic
def from_upper_half(_context: Any, half: Any) -> Any:
    """The float64 with these upper 32 bits and zeros below."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        bits = builder.shl(builder.zext(arguments[0], WHOLE), ir.Constant(WHOLE, 32))
        return builder.bitcast(bits, ir.DoubleType())

    return types.float64(types.int32), generate


@inlined
def cube_root(x):
    """The cube root of 0 ≤ x ≤ 4e307, to two units in the last place; 0 of what is below the normal floats.

    A first guess by thirding the exponent is within a twentieth; each of Halley's steps triples its digits.
    """
    third = np.int32(np.float32(upper_half(x)) * np.float32(1.0 / 3.0))
    y = from_upper_half(np.int32(third + np.int32(THIRD_OF_BIAS)))
    for _ in range(3):
        cube = y * y * y
        y = y * ((cube + x + x) / (cube + cube + x))
    return y if x > 2.3e-308 else 0.0
