"""What a figure was measured on."""

from __future__ import annotations

import os
import platform
import sys
from importlib.metadata import version
from pathlib import Path


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
