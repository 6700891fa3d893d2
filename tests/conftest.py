"""What all tests share."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import settings

# Before NumPy is imported: where processes share the cores, threads of linear algebra wait for each other, and small
# matrices take fifty times as long.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# The first example may compile kernels: no deadline. Plain runs draw the same examples each time, so that a change
# is judged by what it changes; GMSNET_RANDOM_EXAMPLES=1 draws new ones.
settings.register_profile("gmsnet", deadline=None, derandomize=not os.environ.get("GMSNET_RANDOM_EXAMPLES"))
settings.load_profile("gmsnet")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Without looking for garbage, over and over, among a million objects that stay."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_runtest_teardown() -> None:
    """Gives Ctrl-C back to Python: a script that initialises Gmsh leaves it with the system, beyond gmsh.finalize()."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def real_meshes() -> Path:
    """The folder of real meshes that GMSNET_MESHES names."""
    folder = os.environ.get("GMSNET_MESHES")
    if not folder:
        pytest.skip("GMSNET_MESHES does not name the folder of real meshes")
    return Path(folder)
