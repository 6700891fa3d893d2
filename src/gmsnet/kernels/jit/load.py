"""Reading a table by its address.

Numba counts references to an array wherever it takes one out of a tuple. Where it does so between loops over lanes,
LLVM no longer vectorises them, and a sweep takes three times as long. An address is a number, which nobody counts.
"""

from __future__ import annotations

from typing import Any

from numba.core import types
from numba.extending import intrinsic

from gmsnet.kernels.jit.compile import inlined


@intrinsic
def load(_context: Any, kind: Any, address: Any, index: Any) -> Any:
    """The number of type ``kind``, as np.int32, that stands at an index (int64) of the flat array at this address.

    The caller keeps the array alive; nothing is checked.
    """
    number = kind.instance_type

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        of_number = context.get_value_type(number)
        pointer = builder.inttoptr(arguments[1], of_number.as_pointer())
        return builder.load(builder.gep(pointer, [arguments[2]]))

    return number(kind, types.int64, types.int64), generate


@inlined
def address(table):
    """Where the numbers of an array begin."""
    return table.ctypes.data
