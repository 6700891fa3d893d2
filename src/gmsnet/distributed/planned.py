"""Which files ranks share, and how the numbers of such a file lie."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, TypeVar, cast

from gmsnet.errors import FormatError, GmsnetError, InputError
from gmsnet.io.foam_case import MAIN, OPENFOAM, case_of, file_in
from gmsnet.io.formats import FORMATS, HEAD, entry_in
from gmsnet.io.packed import split_name
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges

# Formats whose files can tell how their numbers lie.
PLANNED = ("cgns", "exodus", "fluent", "gmsh", "med", "openfoam", "ply", "stl", "ugrid", "vtk", "vtkhdf", "vtu", "xdmf")
Value = TypeVar("Value")


def plan_of(file: Ranges, format: str) -> Plan | None:
    """How the numbers of a file lie; None where only a reader of the whole can tell. Raises FormatError."""
    plan: Callable[[Ranges], Plan | None] = cast(Any, FORMATS[format].load()).plan
    return said(file, lambda: plan(file))


def said(file: Ranges, make: Callable[[], Value]) -> Value:
    """What is made of a file, with its name in front of what is wrong."""
    try:
        return make()
    except FormatError as error:
        raise FormatError(f"{file.path}: {error}") from None
    except MemoryError:
        raise InputError(f"{file.path}: there is not enough memory for this mesh") from None


def path_of(source: str, format: str) -> str:
    """The file that has the points, or that tells where these are. source: that was asked for, or its folder."""
    folder = case_of(source, format) if format == OPENFOAM else None
    return source if folder is None else file_in(folder, MAIN)


def planned_format(source: str, format: str, *, named: bool = False) -> str:
    """The format where a file of it can be shared by ranks, "" where not. named: markers are asked for by name.

    Of formats with the same suffix it is the one that the file shows.
    """
    if format not in PLANNED:
        return ""
    try:
        path = path_of(source, format)
        if not os.path.isfile(path):
            return ""
        file = Ranges(path)
        format = entry_in(bytes(file.read(0, min(HEAD, file.size))), format, split_name(path)[1]).key
        plan = plan_of(file, format) if format in PLANNED else None
    except GmsnetError:  # told by the reader of the whole
        return ""
    return format if plan is not None and not (named and plan.names is None) else ""
