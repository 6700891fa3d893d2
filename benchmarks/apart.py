"""A tool in a process of its own, which may fail or take too long."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np


def made_by(script: Path, tool: str, path: Path, limit: float) -> tuple[np.ndarray, float] | str:
    """The points that ``script --work tool path out`` leaves, and its seconds; or why there is nothing."""
    target = path.with_suffix(".out.npz")
    command = [sys.executable, str(script), "--work", tool, str(path), str(target)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return f"more than {limit:g} s"
    if done.returncode:
        return (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1][:90]
    with np.load(target) as found:
        return found["points"], float(found["seconds"])
