"""Whether a file still is the one that was read: a mesh may be written over its own file, but over no other's work."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import NamedTuple

from gmsnet.errors import InputError


class Stamp(NamedTuple):
    """What tells a file from any other one, and from itself with other contents. modified: in nanoseconds."""

    device: int
    inode: int
    size: int
    modified: int

    @classmethod
    def of(cls, status: os.stat_result) -> Stamp:
        """The stamp of a file, of what ``os.stat`` or ``os.fstat`` says."""
        return cls(status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns)


class Stamps:
    """The files that a mesh was read from, each as it was then, or as this mesh was last written to it.

    known: path → stamp, each file by its name when it was read and by the name without links.
    """

    known: dict[str, Stamp]

    def __init__(self, known: Iterable[tuple[str, Stamp]] = ()) -> None:
        self.known = dict(known)

    @classmethod
    def of(cls, files: Iterable[tuple[str, object, Stamp | None]]) -> Stamps:
        """Of (path, …, stamp) of each file; what has no stamp is no file."""
        return cls((key, stamp) for path, _, stamp in files if stamp is not None for key in _names(path))

    def check(self, path: str) -> None:
        """InputError where a file that was read has been changed or replaced since; a file that is gone is no loss."""
        expected = next((self.known[key] for key in _names(path) if key in self.known), None)
        if expected is None:
            return
        try:
            found = Stamp.of(os.stat(path))
        except FileNotFoundError:
            return
        if found != expected:
            raise InputError(
                f"{path}: others have changed this file since it was read, so nothing is written over it: "
                "to keep the result, name another output; or read the file again"
            )

    def update(self, path: str, stamp: Stamp) -> None:
        """This mesh was written to a file; only those that were read are remembered."""
        self.known |= {key: stamp for key in _names(path) if key in self.known}


def _names(path: str) -> tuple[str, str]:
    return os.path.abspath(path), os.path.realpath(path)
