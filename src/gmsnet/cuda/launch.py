"""Kernels on a GPU: a thread visits a star as the processor visits a block of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from gmsnet.cuda.library import FUSED, as_written, cuda, inside, version
from gmsnet.cuda.parts import FEWEST, parts_for
from gmsnet.errors import InputError
from gmsnet.kernels.simplex.summary import Summary

THREADS = 128  # in a block of the GPU
COUNTS = 3  # of a tally
NEAR_ONE = 1.0 + 2.0**-30, 1.0 + 2.0**-13  # their squares need one more bit than a float64 and a float32 have


class Nothing:
    """None as an argument of a kernel: numba-cuda has it in tuples, but not a value to pass for it."""

    @staticmethod
    def prepare_args(kind: Any, value: Any, **_: Any) -> tuple[Any, Any]:
        """See numba.cuda.jit: what is passed for a value of some type."""
        return (inside("types").uint64, 0) if value is None else (kind, value)


class Launch:
    """A function that the GPU starts, compiled when it is first called with arguments of some types.

    Its blocks are as many as the GPU works on at a time, so that they can wait for each other.
    """

    def __init__(self, function: Any) -> None:
        self.function = function
        # What is optimized as it is linked is fused again. numba-cuda heeds ``lto`` only where it has the function.
        self._dispatcher = cuda().jit(function, extensions=[Nothing()], lto=False)
        self._compiled: dict[Any, tuple[Any, int]] = {}  # by the kinds of arguments, and how many blocks at a time

    def blocks(self, threads: int, *arguments: Any) -> int:
        """How many blocks are started for so many threads."""
        return min(-(-threads // THREADS), self._for(arguments)[1])

    def __call__(self, threads: int, *arguments: Any) -> None:
        """Starts so many threads, or as many as work at a time."""
        compiled, most = self._for(arguments)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=".*low occupancy")  # of a small mesh
            compiled[min(-(-threads // THREADS), most), THREADS](*arguments)

    def _for(self, arguments: tuple[Any, ...]) -> tuple[Any, int]:
        kinds = tuple(map(kind_of, arguments))
        if kinds not in self._compiled:
            self._compiled[kinds] = self._compile(arguments)
        return self._compiled[kinds]

    def _compile(self, arguments: tuple[Any, ...]) -> tuple[Any, int]:
        with as_written():
            compiled = self._dispatcher.specialize(*arguments)
            (kernel,) = compiled.overloads.values()
            if any(FUSED in text for text in compiled.inspect_asm().values()):
                raise fused()
            return compiled, kernel.max_cooperative_grid_blocks(THREADS)


def kind_of(value: Any) -> Any:
    """What a kernel is compiled for: values of one kind have one type."""
    if isinstance(value, tuple):
        return type(value), *map(kind_of, value)
    if isinstance(value, float):  # NumPy's among them
        return float
    return (value.dtype, value.ndim) if hasattr(value, "dtype") else type(value)


@cache
def entry(kernel: Callable[..., None], room: int) -> Launch:
    """A kernel that visits blocks of stars, as one that the GPU starts. room: see ``parts.room_for``.

    first: (C + 1,) where the stars of each colour begin. A thread visits every so many of them, and waits after each
    colour until all have done so.
    """
    module, visit, zeros = cuda(), parts_for(room).of(kernel), parts_for(room).names["np"].zeros

    def run(points, blocks, first, guard, arguments, tally):
        whole, counts = module.cg.this_grid(), zeros(COUNTS, np.int64)
        for colour in range(len(first) - 1):
            for star in range(first[colour] + module.grid(1), first[colour + 1], module.gridsize(1)):
                visit(points, blocks, star, star + 1, guard, *arguments, counts)
            whole.sync()
        shared, own = module.shared.array(COUNTS, np.int64), module.threadIdx.x
        if own < COUNTS:
            shared[own] = 0
        module.syncthreads()
        for k in range(COUNTS):
            module.atomic.add(shared, k, counts[k])
        module.syncthreads()
        if own < COUNTS:
            module.atomic.add(tally, own, shared[own])

    return Launch(run)


@cache
def summary_entry(summary: Summary) -> Launch:
    """What says of each block of the GPU what the corner simplices that its threads have looked at are like."""
    module, parts, count = cuda(), parts_for(FEWEST), summary.figures
    look, zeros, less, more = parts.of(summary.part), parts.names["np"].zeros, parts.names["min"], parts.names["max"]
    kinds = tuple(-1 if k in summary.least else int(k in summary.most) for k in range(count))

    def run(points, cells, rows, rest, out):
        each = (rows + module.gridsize(1) - 1) // module.gridsize(1)
        first = min(each * module.grid(1), rows)
        figures = zeros(count)
        look(points, *cells, first, min(first + each, rows), *rest, figures)
        shared, own = module.shared.array((THREADS, count), np.float64), module.threadIdx.x
        for k in range(count):
            shared[own, k] = figures[k]
        module.syncthreads()
        if own < count:
            value = shared[0, own]
            for other in range(1, THREADS):
                found = shared[other, own]
                if kinds[own] == 0:
                    value += found
                else:
                    value = less(value, found) if kinds[own] < 0 else more(value, found)
            out[module.blockIdx.x, own] = value

    return Launch(run)


def check_rounding() -> None:
    """Raises InputError if the GPU rounds a product and a sum only once: proofs and bits rest on that it does not."""
    module = cuda()

    def run(double, single):
        if module.grid(1) == 0:
            double[0] = double[1] * double[1] - double[2]
            single[0] = single[1] * single[1] - single[2]

    rows: list[Any] = []
    for number, near in zip((np.float64, np.float32), NEAR_ONE, strict=True):
        row = np.array([1.0, near, near], dtype=number)
        row[2] *= row[1]
        rows.append(module.to_device(row))
    Launch(run)(1, *rows)
    if any(row.copy_to_host()[0] for row in rows):
        raise fused()


def fused() -> InputError:
    """What is said where products and sums are rounded once."""
    return InputError(
        f"device='cuda' cannot be used with numba-cuda {version()}, which rounds a product and a sum only once: leave "
        "device out, or pip install 'gmsnet[cuda]' again"
    )
