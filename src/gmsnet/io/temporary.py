"""Temporary files beside the files that they become, and what is left of them where a process was killed.

Whoever writes one holds a lock on it, which the system lets go of with the process, however that ends. So a file of
such a name without a lock belongs to nobody any more. Where the system has no such locks, leftovers stay.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import sys
from types import TracebackType

if sys.platform != "win32":
    import fcntl

_NAME = re.compile(r"\.gmsnet-[0-9a-f]{12}\.tmp")


class Temporary:
    """A context manager: a file in a folder that is gone at the end, unless it has become another by then."""

    name: str

    def __init__(self, folder: str) -> None:
        self._folder = folder
        self.name = ""  # once it is created
        self._lock: int | None = None

    def __enter__(self) -> Temporary:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        with contextlib.suppress(FileNotFoundError):  # it has become another, or was never made
            os.unlink(self.name)
        self._let_go()

    def create(self, mode: int = 0o600) -> int:
        """Makes the file and returns a descriptor to write to, which the caller closes. Raises OSError."""
        while True:
            self.name = os.path.join(self._folder, f".gmsnet-{secrets.token_hex(6)}.tmp")
            descriptor = os.open(self.name, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
            try:
                self._lock = _locked(descriptor)
                if self._lock is None or os.fstat(descriptor).st_nlink:
                    return descriptor
                self._let_go()  # before it was locked, another process took it for a leftover
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)

    def become(self, target: str) -> None:
        """Takes the place of a file, in one step. Raises OSError."""
        os.replace(self.name, target)

    def _let_go(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def remove_leftovers(folder: str) -> None:
    """Removes the temporary files in a folder that nobody writes any more."""
    if sys.platform == "win32":
        return
    with contextlib.suppress(OSError), os.scandir(folder) as entries:  # a folder need not show what is in it
        found = [
            entry.path for entry in entries if _NAME.fullmatch(entry.name) and entry.is_file(follow_symlinks=False)
        ]
        for path in found:
            with contextlib.suppress(OSError):  # it is locked, gone by now, or belongs to somebody else
                _remove_unless_locked(path)


def _locked(descriptor: int) -> int | None:
    """A second descriptor of a file that holds a lock on it until it is closed; None where there are no locks."""
    if sys.platform == "win32":
        return None
    lock = os.dup(descriptor)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
    except OSError:
        os.close(lock)
        return None
    except BaseException:
        os.close(lock)
        raise
    return lock


def _remove_unless_locked(path: str) -> None:
    descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.unlink(path)
    finally:
        os.close(descriptor)
