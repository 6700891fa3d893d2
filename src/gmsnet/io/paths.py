"""The names of the files that a mesh stands in."""

from __future__ import annotations

import os
from typing import Any

from gmsnet.errors import InputError
from gmsnet.io.foam_case import case_of, file_in
from gmsnet.io.formats import BY_SUFFIX, Entry
from gmsnet.io.packed import is_packed, split_name
from gmsnet.io.split_files import group_of


def name_of(path: Any) -> str:
    """The path as text. Raises InputError for what is none."""
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise InputError(f"a file is given by its path, not by {path!r}")
    return os.fsdecode(path)


def beside(name: str, suffix: str) -> str:
    """The name of a companion file, its suffix in capitals if that of ``name`` is, and compressed if that is."""
    stem, given, gz = split_name(name)
    if given.lower() not in BY_SUFFIX:
        stem, given = stem + given, ""
    return stem + (suffix.upper() if given.isupper() else suffix) + gz


def files_of(name: str, entry: Entry) -> list[str]:
    """The files that a mesh of this name and format stands in: more than one where its format says so."""
    if entry.parts:
        group = group_of(name)  # those that are there; there need be none yet
        return [] if group is None or group.format != entry.key else group.paths
    if (folder := case_of(name, entry.key)) is not None:
        return [file_in(folder, key, is_packed(name)) for key in entry.suffixes]
    return [name] if len(entry.suffixes) == 1 else [beside(name, suffix) for suffix in entry.suffixes]
