"""The same bits however and for whatever processor the kernels were compiled."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys

import pytest

import gmsnet

PROGRAM = """
import hashlib, gmsnet
mesh = gmsnet.random_mesh(500, seed=1)
for name in gmsnet.METHODS:
    print(name, hashlib.sha256(gmsnet.smooth(mesh, name, max_sweeps=5).points.tobytes()).hexdigest())
"""


@pytest.mark.long
def test_code_for_the_plainest_processor_gives_the_same_bits(tmp_path):
    """Compiled anew without AVX and fused operations, against what this process has compiled or found in its cache."""
    if platform.machine() not in ("x86_64", "AMD64"):
        pytest.skip("the name of the plainest processor is that of x86-64")
    plain = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": "+sse2", "GMSNET_CACHE": str(tmp_path)}
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"} | plain
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, env=environment, check=True)
    mesh = gmsnet.random_mesh(500, seed=1)
    for line, name in zip(done.stdout.splitlines(), gmsnet.METHODS, strict=True):
        here = gmsnet.smooth(mesh, name, max_sweeps=5)
        assert line == f"{name} {hashlib.sha256(here.points.tobytes()).hexdigest()}"
