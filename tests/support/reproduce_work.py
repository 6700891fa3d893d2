"""Units of work for the tests: processes of their own find them by the name of this module.

As a program: a batch that is done, and one whose process dies; its argument is the folder of results.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from gmsnet.errors import InputError
from gmsnet.paper.plan import Plan
from gmsnet.paper.store import Result, Store
from gmsnet.paper.units import Batch, Context, Unit, carry_out


def note(context: Context, text: str) -> Result:
    """Says which process did it."""
    return Result({"text": text, "process": os.getpid()}, {f"notes/{text}.txt": text.encode()})


def add(context: Context, names: list[str]) -> Result:
    """Reads the results of others."""
    return Result({"text": "".join(context.store.load(name)["text"] for name in names)})


def fail(context: Context) -> Result:
    """As work on what a user gave may."""
    raise InputError("this mesh has no triangles")


def endless(context: Context) -> Result:
    """Until it is stopped."""
    while True:
        time.sleep(0.01)
        context.go_on()


def threads(context: Context) -> Result:
    """What libraries will read when they are loaded."""
    return Result({name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")})


def die(context: Context) -> Result:
    """As a process does that the system kills."""
    os._exit(9)


if __name__ == "__main__":
    from support import reproduce_work as work  # under this name processes of their own find it

    done = Batch("first", [Unit("note/a", work.note, {"text": "a"})])
    plan = Plan(runs=1, sweeps=1, seed=0, quick=True)
    carry_out([done, Batch("second", [Unit("dies", work.die)])], plan, Store(Path(sys.argv[1])), print, lambda: False)
