"""How kernels and their parts are compiled."""

import gc
import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core import event
from numba.core.runtime import _nrt_python, rtsys

from gmsnet.kernels.jit.cache import KNOWN
from gmsnet.kernels.jit.compile import KERNEL, Part, inlined, options, part


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


class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray


@part
def looks(pair, rows, k):
    """Views alone: of a tuple, of slices, of what is iterated over."""
    both, total = Pair(pair.second, pair.first), 0.0
    for each in both.first[k : k + 2]:
        total += each
    for row in rows:
        total += row[k]
    return total + both.second[k]


@part
def last_row(rows):
    """A view that goes to the caller."""
    return rows[len(rows) - 1]


@part
def with_row(rows, k):
    return last_row(rows)[k]


@part
def chosen(values, which):
    return values[which][0]


@part
def copied(values, at):
    at[:2] = values[1:3]
    return at[0]


@part
def made(values, k):
    found = np.zeros(3)
    found[k] = values[k]
    return found[k]


@numba.njit(**KERNEL)
def looked(pair, rows, which):
    total = 0.0
    for k in range(2):
        total += looks(pair, rows, k) + with_row(rows, k) + chosen(pair.first, which) + made(pair.second, k)
        total += last_row(rows)[k] + copied(pair.first, pair.second)
    return total


@pytest.fixture
def allocations():
    _nrt_python.memsys_enable_stats()
    yield rtsys.get_allocation_stats
    _nrt_python.memsys_disable_stats()


@pytest.mark.skipif(numba.version_info.short > KNOWN, reason="Numba's own compiler is taken")
def test_parts_that_look_at_arrays_of_their_caller_do_not_count_who_uses_them(allocations):
    def pair():
        return Pair(np.arange(4.0), np.arange(4.0) + 10.0)

    rows, which = np.arange(6.0).reshape(2, 3), np.array([1, 2])
    wanted = looked.py_func(pair(), rows, which)
    gc.collect()  # frames of Numba hold the arguments that it compiles for first
    given, before = pair(), allocations()
    references = [sys.getrefcount(each) for each in (*given, rows, which)]
    assert looked(given, rows, which) == wanted
    gc.collect()
    assert [sys.getrefcount(each) for each in (*given, rows, which)] == references
    after = allocations()
    assert after.alloc - before.alloc == after.free - before.free > 0
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free > 0
    counts = {}
    for each in (looks, last_row, with_row, chosen, copied, made):
        ((signature, _),) = each.inside.overloads.items()
        code = each.inside.inspect_llvm(signature)
        counts[each.__name__] = "NRT_incref" in code or "NRT_decref" in code
    assert [name for name, counted in counts.items() if not counted] == ["looks"]
