"""A short run of ``benchmarks/soak.py``: nothing of smoothing, reading and writing is left behind in a process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "soak.py"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="what a process holds is looked up in /proc")
def test_nothing_is_left_behind():
    """All methods with all formats come up: their counts, 13 and 10, share no divisor."""
    done = subprocess.run([sys.executable, SCRIPT, "--meshes", "520"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith("left behind since the third tenth: nothing\n")
    assert done.stdout.count(" meshes: ") == 10
