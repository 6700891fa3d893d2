"""What is said of an error, in one line, and the exit code that follows."""

from __future__ import annotations

import os
import sys

import typer

from gmsnet.errors import GmsnetError
from gmsnet.kernels.jit.usable import UnusableNumbaError
from gmsnet.mesh.display import visible

DONE, BAD_INPUT, BUG = 0, 2, 70  # the last as sysexits.h has it

# Whichever Click the installed Typer uses, its own or the package: this is the base of all its usage errors.
UsageError: type[Exception] = next(base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException")


def print_failure(error: Exception) -> int:
    """Prints the line on standard error and returns the exit code. With GMSNET_DEBUG a bug of ours is raised again."""
    text, code = told(error)
    if code == BUG and os.environ.get("GMSNET_DEBUG"):
        raise error
    print(f"gmsnet: {'internal ' if code == BUG else ''}error: {text}", file=sys.stderr)
    return code


def told(error: Exception) -> tuple[str, int]:
    """What to say, and the exit code."""
    if isinstance(error, MemoryError):
        said = f"the memory does not suffice: {str(error) or 'what is asked for is too large'}"
    elif isinstance(error, UsageError):
        said = error.format_message()  # type: ignore[attr-defined]
    elif isinstance(error, OSError) and not isinstance(error, GmsnetError) and error.filename is not None:
        said = f"{os.fsdecode(error.filename)}: {error.strerror}"
    elif isinstance(error, (GmsnetError, OSError, UnusableNumbaError)):
        said = str(error)
    else:
        what = visible(" ".join(f"{type(error).__name__}: {error}".split()))
        return f"{what}; please report it; GMSNET_DEBUG=1 shows the traceback", BUG
    return visible(" ".join(said.split())), BAD_INPUT
