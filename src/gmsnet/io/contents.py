"""The bytes of a file, all of them read before any is looked at: what others write into it then does no harm."""

from __future__ import annotations

import contextlib
import io
import mmap
import os
import re
import stat
import sys
from typing import BinaryIO

from gmsnet.errors import InputError
from gmsnet.io.stamps import Stamp
from gmsnet.io.streams import STANDARD_INPUT, standard_input
from gmsnet.parallel.memory import refuse_unless_free

LARGE = 1 << 24  # bytes; so many are read into large pages of memory, which takes a third of the time
_AT_ONCE = 1 << 20  # bytes of a stream
_DESCRIPTOR = re.compile(r"/dev/fd/\d+|/proc/(self|\d+)/fd/\d+")

Data = bytes | mmap.mmap  # the latter is memory of this process alone, with no file behind it


def load(path: str) -> tuple[Data, Stamp | None]:
    """The contents of a file and its stamp, or of the standard input or another pipe that is open, which have none.

    Raises OSError as ``open`` does. Raises InputError for devices, sockets and named pipes, where the memory does not
    suffice, and where others write into the file while it is read.
    """
    if path in STANDARD_INPUT:
        return _drained(standard_input(), "standard input"), None
    if is_open_pipe(path):
        with open(path, "rb") as stream:
            return _drained(stream, path), None
    refuse_unless_regular(path)
    with open(path, "rb", buffering=0) as file:
        stamp = Stamp.of(os.fstat(file.fileno()))
        refuse_unless_free(stamp.size, f"{path}: the file")
        data = _filled(file, stamp.size) if stamp.size >= LARGE else file.readall()
        if data is None or Stamp.of(os.fstat(file.fileno())) != stamp:
            raise InputError(f"{path}: the file changed while it was read: read it again once it is finished")
    return data, stamp


def small(path: str, most: int, what: str) -> bytes:
    """The contents of a file of ``most`` bytes at most; pipes as in ``load``.

    Raises OSError as ``open`` does, and InputError for a file that is larger (``what`` names those that are not) or is
    no file.
    """
    pipe = path in STANDARD_INPUT or is_open_pipe(path)
    if not pipe:
        refuse_unless_regular(path)
    with contextlib.ExitStack() as opened:
        stream = standard_input() if path in STANDARD_INPUT else opened.enter_context(open(path, "rb"))
        if pipe:
            _refuse_device(stream, path)
        data = stream.read(most + 1)
    if len(data) > most:
        raise InputError(f"{path}: too large for {what}, which takes at most {most} bytes")
    return data


def refuse_unless_regular(path: str) -> None:
    """InputError where a path leads to something that exists and is no regular file: its bytes may never end."""
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        mode = os.stat(path).st_mode
        if stat.S_ISDIR(mode):
            raise InputError(f"{path}: this is a folder; give the name of a file")
        if not stat.S_ISREG(mode):
            kind = "a named pipe" if stat.S_ISFIFO(mode) else "a socket" if stat.S_ISSOCK(mode) else "a device"
            raise InputError(f"{path}: this is {kind}, no regular file: give a file, or - for the standard input")


def is_open_pipe(path: str) -> bool:
    """Whether a path such as /dev/fd/63 is the number of a pipe that a shell has opened for us."""
    return _DESCRIPTOR.fullmatch(path) is not None and os.path.exists(path) and stat.S_ISFIFO(os.stat(path).st_mode)


def _filled(file: io.FileIO, size: int) -> Data | None:
    """So many bytes of a file, in memory of large pages where the system has them; None where it ends before."""
    if sys.platform == "win32":
        data = file.readall()
        return data if len(data) == size else None
    try:
        room = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    except OSError:
        raise MemoryError from None
    if hasattr(mmap, "MADV_HUGEPAGE"):
        with contextlib.suppress(OSError):  # this system has none
            room.madvise(mmap.MADV_HUGEPAGE)
    with memoryview(room) as view:
        done = 0
        while done < size:  # one call of the system reads 2 GB at most
            with view[done:] as rest:
                count = file.readinto(rest)
            if not count:
                return None
            done += count
    return room


def _drained(stream: BinaryIO, shown: str) -> bytes:
    """All that comes out of a stream. Raises InputError before it takes all the memory there is."""
    _refuse_device(stream, shown)
    parts, size = [], 0
    while part := stream.read(_AT_ONCE):
        parts.append(part)
        size += len(part)
        refuse_unless_free(size, f"{shown}: its {size:,} bytes so far")  # which are copied once more in the end
    return b"".join(parts)


def _refuse_device(stream: BinaryIO, shown: str) -> None:
    """InputError where a stream comes from a device that nobody types on: it may never end."""
    with contextlib.suppress(io.UnsupportedOperation):  # a stream in memory
        if stat.S_ISCHR(os.fstat(stream.fileno()).st_mode) and not stream.isatty():
            raise InputError(f"{shown}: this is a device, no mesh: give a file or a pipe")
