"""Which files a mesh stands in that no file lists: Gmsh's ``a_1.msh``, ``a_2.msh``, … and OpenFOAM's ``processor0``, ….

The former go by the name ``a.msh``, which is no file then; the latter by the folder of their case.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

from gmsnet.errors import InputError
from gmsnet.io.foam_case import GZ, OPENFOAM, file_in, mesh_folder
from gmsnet.io.packed import is_packed, split_name

SPLIT, DECOMPOSED = "split", "decomposed"  # formats
NUMBERED = ".msh"  # what the names of Gmsh's parts end with
FILES = ("points", "faces", "owner", "neighbour", "boundary")
MORE = ("cellZones", "faceZones", "pointZones", "pointProcAddressing")  # those of a processor that may be there


class Group(NamedTuple):
    """format: a key of the table. root: what stands before each key in the path of its file. parts: for each part the
    keys of its files, of which the first has the coordinates."""

    format: str
    root: str
    parts: tuple[tuple[str, ...], ...]

    @property
    def keys(self) -> list[str]:
        """Of all parts."""
        return [key for part in self.parts for key in part]

    def path(self, key: str) -> str:
        """Of a file, compressed where it is only so."""
        return file_in("", self.root + key)

    @property
    def paths(self) -> list[str]:
        """Of all files."""
        return [self.path(key) for key in self.keys]


def group_of(name: str, format: str | None = None) -> Group | None:
    """The files that a name stands for; None where it does not stand for several.

    format: the one that is asked for. Without, a folder with a mesh of the whole case is no decomposed one.

    Raises InputError where a part is missing, and where this format is asked for and there are no such files.
    """
    asked = format.lower() if isinstance(format, str) else None
    found = None
    if asked in (None, SPLIT):
        found = _numbered(name)
    if found is None and asked in (None, DECOMPOSED):
        found = _processors(name) if asked or mesh_folder(name) is None else None
    if found is None and asked == SPLIT:
        stem = split_name(name)[0]
        raise InputError(f"{name}: there are no files {stem}_1{NUMBERED}, {stem}_2{NUMBERED}, …, which it stands for")
    if found is None and asked == DECOMPOSED:
        raise InputError(f"{name}: there is no decomposed case: give the folder that holds processor0, processor1, …")
    return found


def takes_parts(name: str, format: str) -> bool:
    """Whether a mesh of this format is written in parts by this name, if no other format is asked for."""
    return split_name(name)[1] == NUMBERED if format == SPLIT else os.path.isdir(_case(name))


def targets_of(name: str, format: str, keys: Sequence[str], known: Collection[str] = ()) -> dict[str, str]:
    """Key → path of the files that are written of a mesh by this name.

    known: the absolute paths of files that were read; of a case those that do not change are not written over these.
    Raises InputError where these would not be the mesh that the name stands for.
    """
    root = split_name(name)[0] if format == SPLIT else os.path.join(_case(name), "")
    paths = {key: file_in("", root + key, is_packed(name)) for key in keys}
    others = (
        f"{name}: there are more parts of this name than those that are written: remove them, or name another output"
    )
    if format == SPLIT:
        if os.path.exists(name):
            raise InputError(f"{name}: this file would hide the parts {root}_1{NUMBERED}, …: name another output")
        if any(os.path.exists(f"{root}_{len(keys) + 1}{NUMBERED}{gz}") for gz in ("", GZ)):
            raise InputError(others)
    else:
        missing = [path for path in map(os.path.dirname, paths.values()) if not os.path.isdir(path)]
        if missing:
            raise InputError(
                f"{missing[0]}: there is no such folder, and an OpenFOAM mesh is written into a case: copy the case "
                "there first, or give --in-place"
            )
        if os.path.isdir(f"{root}processor{len({key.partition('/')[0] for key in keys})}"):
            raise InputError(others)
        changed = FILES[0]
        paths = {k: p for k, p in paths.items() if os.path.basename(k) == changed or os.path.abspath(p) not in known}
    return paths


def other_points(name: str, format: str | None) -> str:
    """The path of processor folders that keep their points when the mesh of the whole case is written; "" for none."""
    first = os.path.join(_case(name), "processor0")
    return first if format == OPENFOAM and os.path.isdir(first) else ""


def _case(name: str) -> str:
    return os.path.dirname(name) or os.curdir if name.lower().endswith(".foam") else name


def _numbered(name: str) -> Group | None:
    stem, suffix, _ = split_name(name)
    if suffix != NUMBERED or os.path.exists(name):
        return None
    folder, base = os.path.split(stem)
    pattern = re.compile(re.escape(base) + r"_([1-9]\d{0,8})" + re.escape(NUMBERED) + f"(?:{re.escape(GZ)})?")
    numbers = {int(found[1]) for each in _listed(folder) if (found := pattern.fullmatch(each))}
    return _whole(SPLIT, stem, numbers, 1, lambda k: (f"_{k}{NUMBERED}",)) if numbers else None


def _processors(name: str) -> Group | None:
    case = _case(name)
    listed = _listed(case) if os.path.isdir(case) else []
    numbers = {int(found[1]) for each in listed if (found := re.fullmatch(r"processor(0|[1-9]\d{0,8})", each))}
    root = os.path.join(case, "")
    if not numbers:
        if collated := next((each for each in listed if re.fullmatch(r"processors\d+(_.*)?", each)), None):
            raise InputError(
                f"{root}{collated}: the collated form is not read: write a folder for each processor "
                "(decomposePar -fileHandler uncollated)"
            )
        return None

    def files(k: int) -> tuple[str, ...]:
        folder = f"processor{k}/constant/polyMesh/"
        there = (key for key in MORE if any(os.path.exists(f"{root}{folder}{key}{gz}") for gz in ("", GZ)))
        return tuple(folder + key for key in (*FILES, *there))

    return _whole(DECOMPOSED, root, numbers, 0, files)


def _whole(format: str, root: str, numbers: set[int], first: int, files: Callable[[int], tuple[str, ...]]) -> Group:
    """The group of these parts, none of which may be missing."""
    last = max(numbers)
    if len(numbers) <= last - first:
        missing = next(k for k in range(first, last) if k not in numbers)
        raise InputError(f"{root}{files(missing)[0]}: is missing among the parts {first} to {last} of this mesh")
    return Group(format, root, tuple(files(k) for k in range(first, last + 1)))


def _listed(folder: str) -> list[str]:
    try:
        return os.listdir(folder or os.curdir)
    except OSError:  # there is no such folder, or it is not to be looked at: then there are no parts
        return []
