"""Where the result goes: everything about it that can be wrong is found before the work starts."""

from __future__ import annotations

import itertools
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass

from gmsnet.errors import InputError

STREAM = "-"


@dataclass(frozen=True)
class Target:
    """path: of the output, ``-`` the standard output. format: its name in the table, None where the input's is kept."""

    path: str
    format: str | None


def target_of(source: str, output: str | None, in_place: bool, format: str | None) -> Target:
    """The output of ``smooth``. Raises InputError where it is missing, is the input, or cannot be written."""
    from gmsnet.io.formats import BY_SUFFIX, FORMATS, entry_of

    if in_place:
        if output is not None:
            raise InputError(f"--in-place writes to the input, so leave out {output}, or leave out --in-place")
        if format is not None:
            raise InputError("--in-place keeps the format of the input: leave out --output-format")
        if not os.path.isfile(source):
            raise InputError(f"{source}: only a file can be smoothed in place")
        check_writable(source)
        return Target(source, None)
    if output is None:
        raise InputError("the output is missing: give IN and OUT, or --in-place to overwrite the input")
    if format is not None:
        format = entry_of(format).key
    if output == STREAM or is_stream(output):
        return Target(output, format)
    refuse_folder(output)
    suffix = os.path.splitext(output)[1].lower()
    if format is None and suffix not in BY_SUFFIX:
        what = f"the suffix {suffix!r} is unknown" if suffix else "the name has no suffix"
        known = ", ".join(BY_SUFFIX)
        raise InputError(f"{output}: {what}; known are {known}; or name the format with --output-format")
    entry = FORMATS[format or BY_SUFFIX[suffix]]
    refuse_same(files_of(source), files_of(output, entry.key))
    check_writable(output)
    return Target(output, entry.key)


def shown(path: str) -> str:
    """What messages call an input."""
    return "standard input" if path == STREAM else path


def files_of(path: str, format: str | None = None) -> list[str]:
    """The files that a mesh of this name stands in: more than one where its format says so."""
    from gmsnet.io.formats import BY_SUFFIX, FORMATS

    stem, suffix = os.path.splitext(path)
    key = format or BY_SUFFIX.get(suffix.lower())
    suffixes = FORMATS[key].suffixes if key in FORMATS else ()
    return [path, *(stem + each for each in suffixes if len(suffixes) > 1)]


def is_stream(path: str) -> bool:
    """Whether a path leads to a pipe or a device."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


def refuse_same(read: Sequence[str], written: Sequence[str]) -> None:
    """InputError where one of the files to be written is one that is read, by whatever name."""
    for source, path in itertools.product(read, written):
        if os.path.isfile(source) and os.path.exists(path) and os.path.samefile(source, path):
            raise InputError(f"{path} is the input {source} itself: name another output, or use --in-place")


def refuse_folder(path: str) -> None:
    """InputError where a path leads to a folder."""
    if os.path.isdir(path) or path.endswith(("/", os.sep)):
        raise InputError(f"{path}: this is a folder; give the name of a file")


def check_writable(path: str) -> None:
    """InputError where a file cannot be written to this path, found out by making one beside it."""
    refuse_folder(path)
    if is_stream(path):
        return
    folder = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(folder):
        what = "is not a folder" if os.path.exists(folder) else "is a folder that does not exist: make it first"
        raise InputError(f"{path}: {folder} {what}")
    if os.path.exists(path) and not os.access(path, os.W_OK):
        raise InputError(f"{path}: the file is write-protected: name another output")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"{path}: nothing can be written in {folder}: {error.strerror}") from error
