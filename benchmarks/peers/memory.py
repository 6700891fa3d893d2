"""The memory of this process, in bytes."""

from __future__ import annotations

import ctypes
import resource
import sys
from pathlib import Path

STATUS, FORGET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def forget_peak() -> int:
    """Lets go of what is free but not given back, and of the peak so far (where Linux can); returns what is held now.

    Memory that is free but still the process's would not be seen when it is used again.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
        FORGET.write_text("5")
    return held_now()


def held_now() -> int:
    """What the process holds; without /proc its peak so far."""
    return _of_status("VmRSS") if STATUS.exists() else _of_getrusage()


def peak() -> int:
    """The most that it has held since the peak was last forgotten, or ever."""
    return _of_status("VmHWM") if STATUS.exists() else _of_getrusage()


def _of_status(key: str) -> int:
    return 1024 * int(STATUS.read_text().split(f"{key}:")[1].split()[0])


def _of_getrusage() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
