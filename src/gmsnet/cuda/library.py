"""The one place that imports numba-cuda."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import Any

from gmsnet.errors import InputError, MissingExtraError

NEEDED = "pip install 'gmsnet[cuda]', and a driver of NVIDIA"
FUSED = "fma.rn"  # how PTX, the assembly language of these GPUs, calls a product and a sum that are rounded only once
_compiling = threading.local()


@cache
def cuda() -> Any:
    """The module numba.cuda, as numba-cuda has it.

    Raises MissingExtraError where it is not installed, InputError where no GPU can be used.
    """
    try:
        import numba_cuda  # noqa: F401 (without it, numba.cuda is another module)
        from numba import cuda
    except ModuleNotFoundError as error:
        if error.name != "numba_cuda":
            raise  # it is there, but something that it needs is not
        raise MissingExtraError(f"a GPU needs numba-cuda, which is not installed: {NEEDED}") from error
    return cuda


def inside(name: str) -> Any:
    """A module of numba.cuda."""
    return import_module(f"numba.cuda.{name}")


def version() -> str:
    """That of numba-cuda."""
    import numba_cuda

    return str(numba_cuda.__version__)


@cache
def checked() -> Any:
    """The same, where there is a GPU. Raises InputError where there is none."""
    found = cuda()
    try:
        found.current_context()
    except inside("cudadrv.error").CudaSupportError as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"no GPU of NVIDIA can be used here ({reason}): leave device out, or set it to 'cpu'"
        ) from error
    return found


@contextmanager
def at_work() -> Iterator[None]:
    """What the GPU cannot do raises InputError, with its words."""
    try:
        yield
    except inside("cudadrv.driver").CudaAPIError as error:
        raise InputError(f"the GPU has failed ({' '.join(str(error).split())}): leave device out") from error


@contextmanager
def as_written() -> Iterator[None]:
    """What this thread compiles meanwhile rounds each product and each sum, as it is written.

    Raises MissingExtraError where numba-cuda is installed without NVIDIA's compiler.
    """
    _tell_nvvm()
    _compiling.ours = True
    errors, missing = inside("cudadrv.error"), import_module("cuda.pathfinder").DynamicLibNotFoundError
    try:
        yield
    except (missing, errors.NvvmSupportError, errors.NvrtcSupportError) as error:
        reason = " ".join(str(error).split())
        raise MissingExtraError(f"a GPU needs NVIDIA's compiler, which is not found ({reason}): {NEEDED}") from error
    finally:
        _compiling.ours = False


@cache
def _tell_nvvm() -> None:
    """numba-cuda has no option for it: NVVM, which compiles for it, is told where numba-cuda calls it."""
    nvvm = inside("cudadrv.nvvm")
    compile_ir = nvvm.compile_ir

    def told(modules: Any, **options: Any) -> Any:
        if getattr(_compiling, "ours", False):
            options["fma"] = False
        return compile_ir(modules, **options)

    nvvm.compile_ir = told
