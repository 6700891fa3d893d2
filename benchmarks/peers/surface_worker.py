"""Runs one tool of ``surface_tools`` in a process of its own: its name, the surface's file, that of the result."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np


def main() -> None:
    sys.path.insert(0, str(Path(__file__).parent.parent))
    from peers.surface_tools import TOOLS

    tool, source, target = sys.argv[1:]
    with np.load(source) as given:
        points, seconds = TOOLS[tool](given["points"], given["rows"])
    np.savez(target, points=points, seconds=seconds)


if __name__ == "__main__":
    main()
