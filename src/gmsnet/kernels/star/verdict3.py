"""What follows from the sums of a block of stars in space: which steps are proven, and with which F falls.

Written as loops over lanes, that takes a fifth of a sweep, for LLVM does not vectorise them.
"""

from __future__ import annotations

from typing import Any

from gmsnet.kernels.jit import vectors
from gmsnet.kernels.jit.vectors import Lanes, as_written, index, lanewise, larger
from gmsnet.kernels.star.guard3 import WIDER, error_bound3
from gmsnet.kernels.star.space import AFTER, LEAST, MARGIN, VALUE


def _certified(lanes: Lanes, context: Any, builder: Any, kinds: Any, arguments: Any) -> Any:
    """A mask. The arguments are the first eight of ``certify``."""
    sums, step, width, reach, size = (
        vectors.data_of(context, builder, kind, argument)
        for kind, argument in zip(kinds[:5], arguments[:5], strict=True)
    )
    unit, grain, doubt = (lanes.broadcast(builder, argument) for argument in arguments[5:8])
    x, y, z = (lanes.load(builder, step, k).size() for k in range(3))
    m = larger(lanes.load(builder, width, 0), larger(x, larger(y, z))).widened()
    sizes = lanes.load_double(builder, size)
    around = lanes.load_double(builder, reach) + sizes * m
    delta = (unit * around + grain) / sizes * WIDER
    bound = doubt * as_written(error_bound3)(m, delta)
    return bound.below(lanes.load(builder, sums, MARGIN).widened())


@lanewise
def certify(
    lanes: Lanes, sums: Any, step: Any, width: Any, reach: Any, size: Any, unit: Any, grain: Any, doubt: Any,
    allowed: Any,
) -> Any:  # fmt: skip
    """Which lanes are certified above the floor that their row MARGIN was made with, after their step.

    width, reach, size: see Workspace3. doubt: by how much the bound of tetrahedra is multiplied.
    """
    types = lanes.types
    signature = types.void(sums, step, width, reach, size, types.float64, types.float64, types.float64, allowed)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        proven = _certified(lanes, context, builder, signature.args, arguments)
        lanes.store_flags(builder, vectors.data_of(context, builder, signature.args[8], arguments[8]), proven)
        return context.get_dummy_value()

    return signature, generate


@lanewise
def settle(
    lanes: Lanes, sums: Any, step: Any, width: Any, reach: Any, size: Any, unit: Any, grain: Any, doubt: Any,
    allowed: Any, last: Any,
) -> Any:  # fmt: skip
    """The same of steps with which F falls. Those with which it does not are halved, or become zero; counts them.

    last: there is no further trial.
    """
    types = lanes.types
    signature = types.int64(
        sums, step, width, reach, size, types.float64, types.float64, types.float64, allowed, types.boolean
    )

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        proven = _certified(lanes, context, builder, signature.args, arguments)
        base, way = (vectors.data_of(context, builder, signature.args[k], arguments[k]) for k in range(2))
        zero, half, one = (vectors.constant(value, lanes.reals) for value in (0.0, 0.5, 1.0))
        # Beyond the rim, where D < 0, powers of q are small: that is no gain.
        falls = lanes.load(builder, base, AFTER).below(lanes.load(builder, base, VALUE))
        for row in (LEAST, MARGIN):
            falls = builder.and_(falls, builder.fcmp_ordered(">", lanes.load(builder, base, row).value, zero))
        factor = builder.select(falls, one, builder.select(arguments[9], zero, half))
        settled = None
        for k in range(3):
            own = lanes.load(builder, way, k).value
            still = builder.fcmp_ordered("==", own, zero)
            settled = still if settled is None else builder.and_(settled, still)
            vectors.store(builder, way, index(k * lanes.width), builder.fmul(own, factor))
        to = vectors.data_of(context, builder, signature.args[8], arguments[8])
        lanes.store_flags(builder, to, builder.and_(proven, falls))
        return lanes.count(builder, builder.not_(builder.or_(falls, settled)))

    return signature, generate
