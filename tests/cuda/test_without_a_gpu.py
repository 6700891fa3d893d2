"""What is said where there is no GPU, or no library for it."""

from __future__ import annotations

import sys

import pytest

import gmsnet
from gmsnet.cli import main
from gmsnet.cuda import library
from gmsnet.errors import InputError, MissingExtraError
from gmsnet.generate import random_mesh
from gmsnet.run.options import SmoothOptions


@pytest.fixture(autouse=True)
def forgotten():
    """What was found out before does not count."""
    library.cuda.cache_clear()
    library.checked.cache_clear()
    yield
    library.cuda.cache_clear()
    library.checked.cache_clear()


def test_a_missing_library_names_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba_cuda", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'gmsnet\[cuda\]'"):
        gmsnet.smooth(random_mesh(50, seed=1), device="cuda")


def test_the_command_line_says_so_before_it_reads_a_file(monkeypatch, capsys, tmp_path):
    monkeypatch.setitem(sys.modules, "numba_cuda", None)
    assert main(["smooth", str(tmp_path / "missing.su2"), str(tmp_path / "out.su2"), "--device", "cuda"]) == 2
    assert "numba-cuda, which is not installed" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_library_that_is_broken_raises(monkeypatch):
    def load(name, *rest, **more):
        if name == "numba_cuda":
            raise ModuleNotFoundError("No module named 'cuda.bindings'", name="cuda.bindings")
        return loaded(name, *rest, **more)

    loaded = __import__
    monkeypatch.setattr("builtins.__import__", load)
    with pytest.raises(ModuleNotFoundError, match=r"cuda\.bindings"):
        library.cuda()


@pytest.mark.parametrize("device", ["gpu", "", None, 0])
def test_other_devices_are_refused(device):
    with pytest.raises(InputError, match="device must be one of 'cpu', 'cuda'"):
        SmoothOptions(device=device)


def test_ranks_refuse_it(monkeypatch):
    pytest.importorskip("mpi4py", reason="mpi4py is not installed")
    from support.comm import together
    from support.ranks import pieces_of, smoothed

    monkeypatch.setattr("gmsnet.run.options.gpu_library", lambda: None)
    mesh, options = random_mesh(100, seed=1), SmoothOptions(device="cuda")
    fixed = mesh.points[:, 0] < -1.0
    pieces = pieces_of(mesh, fixed, [block.regions * 0 for block in mesh.cells], 2)
    with pytest.raises(InputError, match="with several ranks, leave device out"):
        together(2, lambda comm: smoothed(pieces[comm.rank], options, comm))
