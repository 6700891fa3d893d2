"""Code from the disk is run, and taken up into new code, though LLVM's form of it is parsed only for the latter."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import nullcontext

from gmsnet.kernels.jit import cache

SOURCE = """
from gmsnet.kernels.jit.compile import kernel

@kernel
def twice(a):
    return a + a

@kernel
def thrice(a):
    return a + twice(a)
"""
USER = """
import user
from gmsnet.kernels.jit.library import Loaded

print(user.twice({argument}))
(made,) = user.twice.inside.overloads.values()
print(isinstance(made.library, Loaded), made.library._shared_module is None)
print(user.thrice({argument}) if {more} else "", made.library._shared_module is None)
print(made.library.get_pointer_to_function("not there"))
"""


def test_only_new_code_that_calls_what_was_loaded_parses_it(tmp_path):
    (tmp_path / "user.py").write_text(SOURCE)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path[1:]])}
    environment["GMSNET_CACHE"], environment["NUMBA_CACHE_DIR"] = str(tmp_path / "cache"), ""

    def said(argument, *, more):
        done = subprocess.run(
            [sys.executable, "-B", "-c", USER.format(argument=argument, more=more)],
            env=environment, text=True, capture_output=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    assert said(3, more=False) == ["6", "False False", " False", "0"]  # compiled
    assert said(3, more=False) == ["6", "True True", " True", "0"]
    assert said(3, more=True) == ["6", "True True", "9 False", "0"]
    assert said(3, more=True) == ["6", "True True", "9 True", "0"]  # both from the disk


def test_a_numba_that_is_not_known_loads_as_it_does(monkeypatch):
    monkeypatch.setattr(cache, "KNOWN", (0, 1))
    assert isinstance(cache.loading(None), nullcontext)
