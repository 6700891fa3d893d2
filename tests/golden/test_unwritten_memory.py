"""Results do not depend on what lay in memory before it was written: the C library fills what it hands out."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest


def rows_with(byte: int) -> dict[str, str]:
    """What runs make where new memory is full of a byte."""
    found = os.pathsep.join(filter(None, [str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "PYTHONPATH": found, "MALLOC_PERTURB_": str(255 - byte)}
    command = [sys.executable, "-m", "support.many_runs"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc fills memory on request")
def test_runs_do_not_read_what_they_have_not_written():
    zeros, large, negative = (rows_with(byte) for byte in (0x00, 0x7F, 0xFE))  # of floats: 0, 1e306 and -1e303
    assert large == zeros
    assert negative == zeros
    assert len(zeros) > 90
