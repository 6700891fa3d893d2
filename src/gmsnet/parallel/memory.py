"""Is there room for so many bytes? Asked before they are allocated, for a system out of memory kills without a word."""

from __future__ import annotations

import os
from pathlib import Path

from gmsnet.errors import InputError

UNLIMITED = 2**60  # a control group without a limit of its own names a huge number
ALWAYS_FREE = 2**28  # so many bytes or fewer are not asked for, which takes a fraction of a millisecond


def refuse_unless_free(needed: int, what: str) -> None:
    """InputError, starting with ``what``, if more bytes are needed than this process can still get."""
    free = available() if needed > ALWAYS_FREE else None
    if free is not None and needed > free:
        raise InputError(f"{what} needs about {_gigabytes(needed)} of memory, but only {_gigabytes(free)} are free")


def available(root: Path = Path("/")) -> int | None:
    """The bytes that this process can still get, with swap; None where the system does not tell.

    The minimum of what the system has (/proc/meminfo, else ``os.sysconf``) and what is left of the limits of the
    control groups that the process is in, of both versions; pages of files count as free. root: where /proc and /sys
    are.
    """
    known = [_of_system(root), *_of_groups(root)]
    return min((amount for amount in known if amount is not None), default=None)


def _gigabytes(amount: int) -> str:
    gigabytes = amount / 1e9
    return f"{gigabytes:,.0f} GB" if gigabytes >= 100 else f"{gigabytes:.3g} GB"


def _of_system(root: Path) -> int | None:
    lines = dict(line.split(":", 1) for line in _text(root / "proc/meminfo").splitlines() if ":" in line)
    if "MemAvailable" in lines:
        return sum(int(lines[name].split()[0]) * 1024 for name in ("MemAvailable", "SwapFree") if name in lines)
    names = getattr(os, "sysconf_names", {})
    if root == Path("/") and "SC_AVPHYS_PAGES" in names and "SC_PAGE_SIZE" in names:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


def _of_groups(root: Path) -> list[int]:
    """What is left of the limit of each control group that the process is in, up to the root of each hierarchy."""
    left = []
    for line in _text(root / "proc/self/cgroup").splitlines():
        _, controllers, path = line.split(":", 2)
        if not controllers:
            top, limit, usage, stat = root / "sys/fs/cgroup", "memory.max", "memory.current", "inactive_file"
        elif "memory" in controllers.split(","):
            top = root / "sys/fs/cgroup/memory"
            limit, usage, stat = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
        else:
            continue
        group = top / path.lstrip("/")
        for folder in (group, *group.parents):  # in a container the path may be that outside: its root is the group
            most, used = _number(folder / limit), _number(folder / usage)
            if most is not None and used is not None and most < UNLIMITED:
                files = dict(line.split() for line in _text(folder / "memory.stat").splitlines()).get(stat, "0")
                left.append(max(most - used + int(files), 0))
            if folder == top:
                break
    return left


def _number(path: Path) -> int | None:
    text = _text(path).strip()
    return int(text) if text.isdigit() else None


def _text(path: Path) -> str:
    """What a file says; nothing where there is none to be read."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""
