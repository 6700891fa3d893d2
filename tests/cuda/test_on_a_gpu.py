"""The same bits on a GPU, where there is one; and without one: what is compiled for it rounds as it is written."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from support.blocks import block
from support.optional import library
from support.other_machine import Processor

import gmsnet
from gmsnet.cuda import executor, launch
from gmsnet.cuda.library import FUSED, as_written, at_work, checked
from gmsnet.errors import GmsnetError, InputError, MissingExtraError
from gmsnet.generate import random_mesh, random_quad_mesh, random_volume
from gmsnet.kernels.star.guard import LEVELS
from gmsnet.run import api

SOLIDS = block(6, 6, 6, wedges=np.ndindex(2, 5), pyramids=np.ndindex(2, 3, 5), jitter=0.15, seed=2)
MESHES = {
    "triangle": random_mesh(1500, seed=1), "quad": random_quad_mesh(800, seed=2),
    "tetra": random_volume(300, seed=1), "solids": SOLIDS,
}  # fmt: skip
WAYS = [*itertools.product(MESHES, ("auto", "barrier", "laplacian")), ("triangle", "gmsnet"), ("triangle", "cvt")]


@pytest.mark.parametrize(("kind", "name"), WAYS)
def test_the_bits_are_the_same(monkeypatch, kind, name):
    try:
        checked()
    except GmsnetError as error:
        pytest.skip(str(error))
    monkeypatch.setattr(executor, "FEWEST", 0)
    for level in LEVELS:
        one, other = (
            gmsnet.smooth(MESHES[kind], name, guard=level, device=device, max_sweeps=4) for device in ("cpu", "cuda")
        )
        assert "sweep" in other.notes[-1]
        assert one.points.tobytes() == other.points.tobytes()
        assert repr(one.history) == repr(other.history)


class Compiling(Processor):
    """Compiles for a GPU what it does itself. texts: what came of it, in the assembly language of the GPU."""

    def __init__(self, compiled):
        super().__init__()
        self.compiled, self.texts = compiled, {}

    def start(self, kernel, room, stars, arguments):
        self.compile(launch.entry(kernel, room), arguments)
        super().start(kernel, room, stars, arguments)

    def summarise(self, summary, rows, arguments):
        points, cells, rest = arguments
        self.compile(launch.summary_entry(summary), (points, cells, rows, rest, np.zeros((1, summary.figures))))
        return super().summarise(summary, rows, arguments)

    def compile(self, entry, arguments):
        self.texts[entry] = self.compiled(entry.function, arguments)


@pytest.fixture
def machine(monkeypatch):
    """A machine that compiles for a GPU that is not there."""
    library("numba_cuda")
    cuda = library("numba.cuda")
    kind_of = library("numba.cuda.typing.typeof").typeof
    supposed = type("Supposed", (), {"compute_capability": (9, 0)})
    monkeypatch.setattr("numba.cuda.dispatcher.get_current_device", supposed)

    def compiled(function, arguments):
        types = tuple(map(kind_of, arguments))
        with as_written():
            text, _ = cuda.compile(function, types, cc=(9, 0), device=False, abi="numba", output="ptx")
        return text

    made = Compiling(compiled)
    monkeypatch.setattr("gmsnet.run.options.gpu_library", lambda: None)
    monkeypatch.setattr(executor, "FEWEST", 0)
    monkeypatch.setattr(api, "gpu", lambda threads: executor.on(made, threads))
    return made


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("triangle", {"method": "barrier"}),
        ("quad", {"method": "barrier", "guard": "star", "slide": "all"}),
        ("triangle", {"method": "laplacian", "variant": "plain"}),
        ("quad", {"method": "laplacian", "guard": "valid"}),
        ("triangle", {"method": "gmsnet"}),
        ("triangle", {"method": "angle"}),
        ("triangle", {"method": "cvt"}),
        ("tetra", {"method": "barrier"}),
        ("tetra", {"method": "laplacian", "guard": "star", "slide": "all"}),
        ("solids", {"method": "barrier", "slide": "all"}),
    ],
)
def test_what_is_compiled_rounds_as_it_is_written(machine, kind, options):
    gmsnet.smooth(MESHES[kind], device="cuda", max_sweeps=1, **options)
    assert len(machine.texts) == 1 + (not MESHES[kind].has_volumes)  # a sweep and, in a plane, a look
    for text in machine.texts.values():
        assert "mul.rn.f" in text
        assert FUSED not in text


def test_what_a_gpu_cannot_do_is_an_error_of_the_input():
    library("numba_cuda")
    fault = library("numba.cuda.cudadrv.driver").CudaAPIError
    with pytest.raises(InputError, match=r"the GPU has failed .*out of memory.*leave device out"), at_work():
        raise fault(2, "out of memory")


def test_without_the_compiler_of_nvidia_the_command_is_named():
    library("numba_cuda")
    fault = library("numba.cuda.cudadrv.error").NvvmSupportError
    with pytest.raises(MissingExtraError, match=r"libnvvm.*pip install 'gmsnet\[cuda\]'"), as_written():
        raise fault("libNVVM cannot be found: libnvvm.so")
