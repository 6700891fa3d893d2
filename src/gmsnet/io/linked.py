"""Files that a file of a mesh names: which they are, where they go, and the folders that are made for them."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from typing import Protocol, cast

from gmsnet.errors import InputError
from gmsnet.io.atomic import reason
from gmsnet.io.contents import Data
from gmsnet.io.formats import BY_SUFFIX, FORMATS, Entry
from gmsnet.io.packed import split_name
from gmsnet.io.pieces import Pieces
from gmsnet.io.stamps import Stamps


class Links(Protocol):
    """What is known of the files that those of a format name. Paths are relative to the folder of the naming file."""

    def links(self, data: Data) -> dict[str, str]:
        """The key of each file in a mesh, and its path. Raises FormatError for names that are not to be followed."""
        ...

    def placed(self, name: str, links: Mapping[str, str], in_place: bool) -> dict[str, str]:
        """The path that each file gets, by key, if the naming file is written as ``name``."""
        ...

    def relinked(self, data: bytes, names: Mapping[str, str]) -> bytes:
        """The naming file with these paths."""
        ...


def links_of(entry: Entry, data: Data) -> dict[str, str]:
    """Key → path of the files that a file of this format names; none where its format names none."""
    return _module(entry).links(data) if entry.linked else {}


def nested(entry: Entry, path: str) -> bool:
    """Whether a file that is named may name others in turn, as this format's do. Their paths are kept as they are."""
    other = FORMATS.get(BY_SUFFIX.get(split_name(path)[1].lower(), ""))
    return other is not None and other.linked == entry.linked != ""


def _module(entry: Entry) -> Links:
    return cast(Links, import_module(f"gmsnet.io.{entry.linked}"))


def placed(
    entry: Entry, files: Mapping[str, Pieces], name: str, stamps: Stamps
) -> tuple[dict[str, Pieces], dict[str, str]]:
    """The files as they are to be written, and key → path of each. files: by key, as they were read.

    Raises InputError where one would overwrite what the mesh was read from, while its naming file is another one.
    """
    main = entry.suffixes[0]
    data = bytes(files[main])
    module, in_place = _module(entry), os.path.abspath(name) in stamps.known
    named = module.links(data)
    below = {key: key for key in files if key != main and key not in named}  # named by those that are named
    names = module.placed(name, {**named, **below}, in_place)
    paths = {key: os.path.join(os.path.dirname(name), path) for key, path in names.items()}
    for path in paths.values():
        if os.path.abspath(path) in stamps.known and not in_place:
            raise InputError(f"{path}: holds the numbers of the mesh that was read: name another output")
    text = module.relinked(data, names)
    return {**files, main: Pieces(lambda: [text])}, {main: name, **paths}


@contextlib.contextmanager
def folders_for(name: str, paths: Iterable[str]) -> Iterator[None]:
    """Makes the folders of these files that are missing below that of ``name``; they go again where the block fails."""
    made: list[str] = []
    try:
        base = os.path.dirname(name)
        for folder in sorted({os.path.dirname(path) for path in paths}):
            missing = []
            while folder != base and not os.path.isdir(folder):
                missing.append(folder)
                folder = os.path.dirname(folder)
            for each in reversed(missing) if os.path.isdir(base or os.curdir) else ():
                _make(each)
                made.append(each)
        yield
    except BaseException:
        for folder in reversed(made):
            with contextlib.suppress(OSError):  # others have put something there meanwhile
                os.rmdir(folder)
        raise


def _make(folder: str) -> None:
    try:
        os.mkdir(folder)
    except OSError as error:
        raise InputError(
            f"{folder}: this folder, for the files that the output names, cannot be made: {reason(error)}"
        ) from None
