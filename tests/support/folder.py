"""What tests share that look at the files in a folder."""

from __future__ import annotations

import sys
from pathlib import Path

SMOOTH = [sys.executable, "-m", "gmsnet", "smooth"]


def names(folder: Path) -> list[str]:
    """Of all that is in it, in order."""
    return sorted(path.name for path in folder.iterdir())
