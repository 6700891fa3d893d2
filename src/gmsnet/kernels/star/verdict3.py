"""What follows from the sums of a block of stars in space: which steps are proven, and with which F falls.

Written as loops over lanes, that takes a fifth of a sweep, for LLVM does not vectorise them.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

from gmsnet.kernels.jit import vectors
from gmsnet.kernels.jit.vectors import BYTE, DOUBLES, INDEX, WIDTH, Vector, as_written, broadcast, index, larger
from gmsnet.kernels.star.guard3 import WIDER, error_bound3
from gmsnet.kernels.star.space import AFTER, LEAST, MARGIN, VALUE

BITS: Any
BYTES: Any
BITS, BYTES = ir.IntType(WIDTH), ir.VectorType(BYTE, WIDTH)


def _row(builder: Any, base: Any, row: int, kind: Any = vectors.REALS) -> Vector:
    return Vector(builder, vectors.load(builder, base, index(row * WIDTH), kind, 8 if kind == DOUBLES else 4))


def _certified(context: Any, builder: Any, kinds: Any, arguments: Any) -> Any:
    """A mask. The arguments are the first eight of ``certify``."""
    sums, step, width, reach, size = (
        vectors.data_of(context, builder, kind, argument)
        for kind, argument in zip(kinds[:5], arguments[:5], strict=True)
    )
    unit, grain, doubt = (broadcast(builder, argument) for argument in arguments[5:8])
    far = larger(_row(builder, step, 0).size(), larger(_row(builder, step, 1).size(), _row(builder, step, 2).size()))
    m = larger(_row(builder, width, 0), far).widened()
    sizes = _row(builder, size, 0, DOUBLES)
    around = _row(builder, reach, 0, DOUBLES) + sizes * m
    delta = (unit * around + grain) / sizes * WIDER
    bound = doubt * as_written(error_bound3)(m, delta)
    return bound.below(_row(builder, sums, MARGIN).widened())


@intrinsic
def certify(
    _context: Any, sums: Any, step: Any, width: Any, reach: Any, size: Any, unit: Any, grain: Any, doubt: Any,
    allowed: Any,
) -> Any:  # fmt: skip
    """Which lanes are certified above the floor that their row MARGIN was made with, after their step.

    width, reach, size: see Workspace3. doubt: by how much the bound of tetrahedra is multiplied.
    """
    signature = types.void(sums, step, width, reach, size, types.float64, types.float64, types.float64, allowed)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        proven = _certified(context, builder, signature.args, arguments)
        to = vectors.data_of(context, builder, signature.args[8], arguments[8])
        vectors.store(builder, to, index(0), builder.zext(proven, BYTES), 1)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def settle(
    _context: Any, sums: Any, step: Any, width: Any, reach: Any, size: Any, unit: Any, grain: Any, doubt: Any,
    allowed: Any, last: Any,
) -> Any:  # fmt: skip
    """The same of steps with which F falls. Those with which it does not are halved, or become zero; counts them.

    last: there is no further trial.
    """
    signature = types.int64(
        sums, step, width, reach, size, types.float64, types.float64, types.float64, allowed, types.boolean
    )

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        proven = _certified(context, builder, signature.args, arguments)
        base, way = (vectors.data_of(context, builder, signature.args[k], arguments[k]) for k in range(2))
        zero = vectors.constant(0.0)
        # Beyond the rim, where D < 0, powers of q are small: that is no gain.
        falls = _row(builder, base, AFTER).below(_row(builder, base, VALUE))
        for row in (LEAST, MARGIN):
            falls = builder.and_(falls, builder.fcmp_ordered(">", _row(builder, base, row).value, zero))
        factor = builder.select(arguments[9], zero, vectors.constant(0.5))
        factor = builder.select(falls, vectors.constant(1.0), factor)
        settled = None
        for k in range(3):
            own = _row(builder, way, k)
            still = builder.fcmp_ordered("==", own.value, zero)
            settled = still if settled is None else builder.and_(settled, still)
            vectors.store(builder, way, index(k * WIDTH), builder.fmul(own.value, factor))
        to = vectors.data_of(context, builder, signature.args[8], arguments[8])
        vectors.store(builder, to, index(0), builder.zext(builder.and_(proven, falls), BYTES), 1)
        refused = builder.not_(builder.bitcast(builder.or_(falls, settled), BITS))
        return builder.zext(builder.ctpop(refused), INDEX)

    return signature, generate
