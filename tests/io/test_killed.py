"""kill -9 while a mesh is written: the old file or the new one, and nothing of it left after the next run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "support" / "killing.py"


@pytest.mark.skipif(os.name != "posix", reason="only POSIX systems fork and kill")
def test_nothing_is_damaged_missing_or_left() -> None:
    """``python tests/support/killing.py`` alone kills more often; so few kills at random rarely hit each moment."""
    command = [sys.executable, str(SCRIPT), "--kills", "48", "--whole", "2", "--nodes", "1000"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 6 * 3 + 2
    assert all(line.endswith("damaged=0, left=0)") for line in lines)
    assert all("while_writing=0" not in line for line in lines if "each step" in line), "no step was hit"
