"""Files that are either written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from collections.abc import Callable, Iterable, Mapping

from gmsnet.errors import InputError
from gmsnet.io.pieces import Piece
from gmsnet.io.stamps import Stamp, Stamps
from gmsnet.io.streams import is_special
from gmsnet.io.temporary import Temporary, remove_leftovers


def replace_files(
    files: Mapping[str, bytes | Iterable[Piece]], stamps: Stamps | None = None, agree: Callable[[], None] | None = None
) -> None:
    """Writes files (path → bytes, or pieces made as they are written): each new content goes to a temporary file beside
    its target, reaches the disk, and only when all of them have done so are the targets replaced.

    A link is followed, an existing file keeps its permissions. What is no regular file (a pipe, a device) is written
    straight. What killed processes have left in the folders is removed.

    stamps: of the files that were read, which are replaced only if they are as they were then. agree: called when all
    is on the disk and nothing is replaced yet; what it raises, this raises. Raises InputError where
    they are not or a target cannot be written, BrokenPipeError where nobody reads a pipe any more; then, as after any
    other interruption, no temporary file is left and no target is half-written.
    """
    with contextlib.ExitStack() as made:
        finished: list[tuple[Temporary, str, str, Stamp]] = []
        for path, contents in files.items():
            pieces = [contents] if isinstance(contents, bytes) else contents
            try:
                _check(path)
                if is_special(path):
                    with open(path, "wb") as stream:
                        for piece in pieces:
                            stream.write(piece)
                else:
                    target = os.path.realpath(path)
                    remove_leftovers(os.path.dirname(target))
                    temporary = made.enter_context(Temporary(os.path.dirname(target)))
                    stamp = _write(temporary, target, pieces)
                    finished.append((temporary, target, path, stamp))
            except BrokenPipeError:  # no fault of the user's
                raise
            except OSError as error:
                raise InputError(f"{path}: cannot be written: {reason(error)}") from None
        stamps = stamps or Stamps()
        for _, _, path, _ in finished:
            stamps.check(path)
        if agree is not None:
            agree()
        for temporary, target, path, stamp in finished:
            try:
                temporary.become(target)
            except OSError as error:
                raise InputError(f"{target}: cannot be written: {reason(error)}") from None
            stamps.update(path, stamp)
        for folder in {os.path.dirname(target) for _, target, _, _ in finished}:
            _settle(folder)


def reason(error: OSError) -> str:
    """What the system says, without numbers and paths."""
    text = error.strerror or type(error).__name__
    return text[:1].lower() + text[1:]


def refuse_folder(path: str) -> None:
    """InputError where a path leads to a folder, or can lead nowhere."""
    if "\0" in path:
        raise InputError(f"{path!r}: names of files hold no null characters")
    if os.path.isdir(path) or path.endswith(("/", os.sep)):
        raise InputError(f"{path}: this is a folder; give the name of a file")


def check_writable(path: str) -> None:
    """Raises now what ``replace_files`` would raise after the work, found out by making a file beside the target."""
    _check(path)
    if is_special(path):
        return
    folder = os.path.dirname(os.path.realpath(path))
    try:
        with Temporary(folder) as temporary:
            os.close(temporary.create())
    except OSError as error:
        raise InputError(f"{path}: nothing can be written in {folder}: {reason(error)}") from None


def _check(path: str) -> None:
    refuse_folder(path)
    if is_special(path):
        return
    target = os.path.realpath(path)
    folder = os.path.dirname(target)
    if os.path.islink(target):
        raise InputError(f"{path}: this link leads back to itself; name another output")
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise InputError(f"{path}: {folder} is not a folder")
    if not os.path.isdir(folder):
        raise InputError(f"{path}: the folder {folder} does not exist; make it first")
    if os.path.exists(path) and not os.access(path, os.W_OK):
        raise InputError(f"{path}: the file is write-protected; name another output")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{path}: the folder {folder} is write-protected")


def _write(temporary: Temporary, target: str, pieces: Iterable[Piece]) -> Stamp:
    """Fills a file that has the permissions and owner of the target, if that exists; on the disk when this returns.

    Until it has them nobody else may open it: the target may be private.
    """
    mode = 0o600 if os.path.exists(target) else 0o666  # less what the umask or the folder takes away
    with os.fdopen(temporary.create(mode), "wb") as stream:
        for piece in pieces:
            stream.write(piece)
        stream.flush()
        if os.path.exists(target):
            old = os.stat(target)
            if sys.platform == "win32":
                os.chmod(temporary.name, stat.S_IMODE(old.st_mode))
            else:  # of the file itself, whatever its name leads to by now
                with contextlib.suppress(PermissionError):  # only the superuser may give files away
                    os.fchown(stream.fileno(), old.st_uid, old.st_gid)
                os.fchmod(stream.fileno(), stat.S_IMODE(old.st_mode))
        os.fsync(stream.fileno())
        return Stamp.of(os.fstat(stream.fileno()))


def _settle(folder: str) -> None:
    """Brings the new names in a folder to the disk, where the system can do that."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with contextlib.suppress(OSError):  # not every file system knows how; the files themselves are there
            os.fsync(descriptor)
    finally:
        os.close(descriptor)
