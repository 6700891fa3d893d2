"""What a figure was measured on."""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any


def describe() -> str:
    """Processor, cores, and the versions that matter, one a line."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = info.read_text().splitlines()
        cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), cpu)
        flags = next((line.split(":")[1].split() for line in lines if line.startswith("flags")), [])
        cpu += " with " + ("AVX-512" if "avx512f" in flags else "AVX2" if "avx2" in flags else "no AVX2")
    packages = " ".join(f"{name} {version(name)}" for name in ("gmsnet", "numpy", "scipy", "numba"))
    return f"{cpu}, {os.cpu_count()} cores\nPython {sys.version.split()[0]}, {packages}"


def others_use(job: Callable[[], Any]) -> tuple[float, float]:
    """Seconds that a job takes, and the share of the machine's processors that other processes use meanwhile.

    The share is 0 where the system does not tell, and coarse for jobs of a few hundredths of a second.
    """
    began, own, all_of = time.perf_counter(), time.process_time(), _busy()
    job()
    seconds, own, all_of = time.perf_counter() - began, time.process_time() - own, _busy() - all_of
    return seconds, max(all_of - own, 0.0) / (seconds * (os.cpu_count() or 1))


def _busy() -> float:
    """Seconds that all processors have worked so far."""
    file = Path("/proc/stat")
    if not file.exists():
        return 0.0
    user, nice, system, _, _, *interrupts = map(int, file.read_text().split(maxsplit=9)[1:9])
    return (user + nice + system + sum(interrupts)) / os.sysconf("SC_CLK_TCK")
