"""The bytes of a file: large files are mapped into memory, so that they take no memory of their own."""

from __future__ import annotations

import mmap
import os
import stat

from gmsnet.errors import InputError

LEAST = 1 << 24  # bytes; smaller files are simply read, and may then change without harm

Data = bytes | mmap.mmap  # a file, read or mapped into memory


class Mapped(mmap.mmap):
    """A file mapped into memory, to be read."""

    path: str
    stamp: tuple[int, ...]

    def changed(self) -> bool:
        """Whether other contents were written into the file since. A file that was replaced or removed lives on."""
        try:
            now = os.stat(self.path)
        except OSError:
            return False
        return (now.st_dev, now.st_ino) == self.stamp[:2] and (now.st_size, now.st_mtime_ns) != self.stamp[2:]


def load(path: str) -> Data:
    """The contents of a file. Raises OSError as ``open`` does."""
    with open(path, "rb") as stream:
        status = os.fstat(stream.fileno())
        # Elsewhere a file that is mapped cannot be replaced.
        if os.name != "posix" or status.st_size < LEAST or not stat.S_ISREG(status.st_mode):
            return stream.read()
        try:
            mapped = Mapped(stream.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError:  # not every file system can do that
            return stream.read()
    mapped.path, mapped.stamp = (
        os.path.abspath(path),
        (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns),
    )
    return mapped


def changed(data: Data) -> bool:
    """Whether the file behind these bytes is not what it was, so that they cannot be relied on."""
    return isinstance(data, Mapped) and data.changed()


def held(data: Data) -> bytes:
    """The bytes of a file in memory. Raises InputError where others have written into the file meanwhile."""
    if isinstance(data, Mapped) and data.changed():
        raise InputError(f"{data.path}: the file has changed since it was read: read it again")
    return data if isinstance(data, bytes) else data[:]
