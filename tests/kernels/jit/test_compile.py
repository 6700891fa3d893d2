"""How kernels and their parts are compiled."""

import numba
import numpy as np
import pytest
from numba.core import event

from gmsnet.kernels.jit.compile import KERNEL, KNOWN, Part, inlined, options, part


@part
def larger(x, y):
    return max(x, y)


@inlined
def twice(x):
    return 2.0 * max(x, 0.0)


@numba.njit(**KERNEL)  # a kernel that is not kept on disk
def summed(values):
    total = 0.0
    for k in range(len(values)):
        total += larger(values[k], 1.0) + twice(values[k]) + max(values[k], 3.0)
    return total


class Names(event.Listener):
    """The functions that are compiled."""

    def __init__(self):
        self.names = []

    def on_start(self, event):
        self.names.append(event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event):
        pass


@pytest.mark.skipif(numba.version_info.short > KNOWN, reason="Numba's own compiler is taken")
def test_machine_code_is_made_of_kernels_alone_and_what_numba_compiles_of_its_own_serves_parts_too():
    values, found = np.array([-1.0, 2.0, 5.0]), Names()
    with event.install_listener("numba:compile", found):
        assert summed(values) == sum(max(x, 1.0) + 2.0 * max(x, 0.0) + max(x, 3.0) for x in values)
    assert [name for name in found.names if "." not in name] == ["summed", "larger", "twice"]
    assert len(found.names) <= 4  # max, if no other kernel has asked for it
    engine = next(iter(summed.overloads.values())).library.codegen._engine
    for each, machine_code in ((summed, True), (larger.inside, False), (twice.inside, False)):
        (result,) = each.overloads.values()
        assert engine.is_symbol_defined(result.fndesc.llvm_func_name) == machine_code


def test_with_a_later_numba_its_own_compiler_does_the_same():
    kernel, *others = options((KNOWN[0], KNOWN[1] + 1))
    first, second = (Part(each.py_func, chosen) for each, chosen in zip((larger, twice), others, strict=True))

    @numba.njit(**kernel)
    def total(values):
        return first(values[0], 1.0) + second(values[1])

    values = np.array([-1.0, 2.5])
    assert total(values) == 6.0
    assert all("pipeline_class" not in each for each in (kernel, *others))
