"""The standard streams, pipes and devices: what is no file that could be looked at twice or replaced."""

from __future__ import annotations

import os
import sys
from typing import BinaryIO

from gmsnet.errors import InputError

STANDARD_INPUT = ("-", "/dev/stdin", "/dev/fd/0", "/proc/self/fd/0")
STANDARD_OUTPUT = ("-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")


def is_special(path: str) -> bool:
    """Whether a path leads to something that exists and is neither a file nor a folder: a pipe, a device."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


def is_standard_output(path: str) -> bool:
    """Whether what is written to a path mixes with the standard output: its names, and the file or pipe behind it.

    The null device mixes nothing.
    """
    if path in STANDARD_OUTPUT:
        return True
    try:
        found, own, nowhere = os.stat(path), os.fstat(1), os.stat(os.devnull)
    except OSError:
        return False
    return os.path.samestat(found, own) and not os.path.samestat(own, nowhere)


def standard_input() -> BinaryIO:
    """The bytes of the standard input. Raises InputError where the caller closed it."""
    return _bytes_of(sys.stdin, "standard input")


def standard_output() -> BinaryIO:
    """The standard output for bytes. Raises InputError where the caller closed it."""
    return _bytes_of(sys.stdout, "standard output")


def _bytes_of(stream: object, what: str) -> BinaryIO:
    found: BinaryIO | None = getattr(stream, "buffer", None)
    if found is None or found.closed:
        raise InputError(f"{what}: it is closed; give the name of a file instead of -")
    return found
