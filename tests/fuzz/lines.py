"""Which ways through the readers a file takes: pairs of lines of gmsnet.io that follow each other in one function."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import gmsnet.io

Way = tuple[str, int, int]  # module, line, next line

_FOLDER = str(Path(gmsnet.io.__file__).parent)


def ways(run: Callable[[], object]) -> set[Way]:
    """The ways that are taken while ``run`` runs; what it raises is not heard."""
    found: set[Way] = set()

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        name = frame.f_code.co_filename
        if not name.startswith(_FOLDER):
            return None
        module, last = Path(name).stem, frame.f_lineno

        def line(frame: FrameType, event: str, _: Any) -> Any:
            nonlocal last
            if event == "line":
                found.add((module, last, frame.f_lineno))
                last = frame.f_lineno
            return line

        return line

    old = sys.gettrace()
    sys.settrace(trace)
    try:
        run()
    except Exception:  # the hunt reports it; here only the way there counts
        pass
    finally:
        sys.settrace(old)
    return found


def lines(found: set[Way]) -> set[tuple[str, int]]:
    """The lines on these ways."""
    return {(module, line) for module, _, line in found}


def smallest(files: dict[bytes, set[Way]]) -> list[bytes]:
    """Of files and their ways a few that together take them all: the shortest that still adds one, then the next."""
    seen: set[Way] = set()
    kept = []
    for data in sorted(files, key=lambda data: (len(data), data)):
        if files[data] - seen:
            seen |= files[data]
            kept.append(data)
    return kept
