"""Kernels for other targets than this processor: the same source, compiled anew with other building blocks.

A kernel is a Python function that calls parts (kernels.jit.compile). Both are made again here of their bytecode, with
some of the names that they use replaced: LANES by 1, so that a block is one star, and a thread of an accelerator does
what a lane does; what allocates memory; ``min`` and ``max``, which accelerators have of their own, with other answers
for what is not a number. Intrinsics that are written for any number of lanes (kernels.jit.vectors) are made for one.
What is added or multiplied, and in which order, stays: so do the bits.
"""

from __future__ import annotations

import builtins
from collections.abc import Callable, Mapping
from dis import get_instructions
from types import FunctionType, ModuleType
from typing import Any

from gmsnet.kernels.jit.compile import Kernel, Part
from gmsnet.kernels.jit.vectors import Lanes, typed


class Retarget:
    """Compiles kernels and parts for another target, each once.

    compiled: what compiles a plain function for it. names: what stands there for a global name or for a builtin. parts:
    what stands there for a part. intrinsic: Numba's decorator of intrinsics there, types: the types that go with it.
    """

    def __init__(
        self, compiled: Callable[[Callable[..., Any]], Any], names: Mapping[str, Any], parts: Mapping[Any, Any],
        intrinsic: Callable[[Callable[..., Any]], Any], types: Any,
    ) -> None:  # fmt: skip
        self.compiled, self.names = compiled, names
        self._made, self._intrinsic, self._lanes = dict(parts), intrinsic, Lanes(1, types)

    def of(self, thing: Any) -> Any:
        """What a kernel or a part is on that target."""
        if thing not in self._made:
            self._made[thing] = self.compiled(self._plain(thing))
        return self._made[thing]

    def _in_one_lane(self, function: Callable[..., Any]) -> Any:
        if function not in self._made:
            self._made[function] = self._intrinsic(typed(function, self._lanes))
        return self._made[function]

    def _plain(self, thing: Kernel | Part) -> Callable[..., Any]:
        """Its function with the names replaced."""
        function = thing.py_func
        code, known = function.__code__, function.__globals__
        names = {}
        for name in {each.argval for each in get_instructions(code) if each.opname == "LOAD_GLOBAL"}:
            if name in self.names and (name in known or hasattr(builtins, name)):
                names[name] = self.names[name]
            elif name in known:
                names[name] = self._of(known[name], code.co_names)
        made = FunctionType(code, names, function.__name__, function.__defaults__, function.__closure__)
        made.__module__ = function.__module__
        return made

    def _of(self, value: Any, used: tuple[str, ...]) -> Any:
        """What stands for a global value. used: the names that a function uses, attributes among them."""
        if isinstance(value, (Kernel, Part)):
            return self.of(value)
        if (function := getattr(value, "lanewise", None)) is not None:
            return self._in_one_lane(function)
        if not (isinstance(value, ModuleType) and value.__name__.startswith("gmsnet.")):
            return value
        module = ModuleType(value.__name__)
        for name in used:
            if hasattr(value, name):
                setattr(module, name, self._of(getattr(value, name), ()))
        return module
