"""Where the result goes: everything about it that can be wrong is found before the work starts."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gmsnet.errors import InputError
from gmsnet.io.atomic import check_writable, refuse_folder
from gmsnet.io.foam_case import OPENFOAM, case_of
from gmsnet.io.formats import BY_SUFFIX, FORMATS, entry_of, format_of_suffix
from gmsnet.io.packed import split_name
from gmsnet.io.paths import files_of
from gmsnet.io.split_files import DECOMPOSED, Group, group_of, takes_parts, targets_of
from gmsnet.io.streams import STANDARD_INPUT, STANDARD_OUTPUT, is_special, is_standard_output, standard_output

if TYPE_CHECKING:
    from gmsnet.mesh.mesh import Mesh


@dataclass(frozen=True)
class Destination:
    """path: of the output. format: its name in the table; None where the suffix tells, or that of the input is kept.

    aside: the output is the standard output, so what is said goes to standard error.
    """

    path: str
    format: str | None
    aside: bool = False


def destination_of(
    source: str, output: str | None, in_place: bool, format: str | None, read_as: str | None = None
) -> Destination:
    """The output of ``smooth``. read_as: the format of the input, None where it is to be seen.

    Raises InputError where it is missing, is the input, or cannot be written.
    """
    group = group_of(source, read_as)
    if in_place:
        if output is not None:
            raise InputError(f"--in-place writes to the input, so leave out {output}, or leave out --in-place")
        if format is not None:
            raise InputError("--in-place keeps the format of the input: leave out --output-format")
        own = group.paths if group is not None else [*_case(source), source][:1]
        if not all(map(os.path.isfile, own)):
            raise InputError(f"{source}: only a file can be smoothed in place")
        for path in own:
            check_writable(path)
        return Destination(source, None, is_standard_output(source))
    if output is None:
        raise InputError("the output is missing: give IN and OUT, or --in-place to overwrite the input")
    if format is not None:
        format = entry_of(format).key
    aside = is_standard_output(output)
    if output in STANDARD_OUTPUT:
        standard_output()  # raises where it is closed
    if output in STANDARD_OUTPUT or is_special(output):
        return Destination(output, format, aside)
    if group is not None and format in (None, group.format) and takes_parts(output, group.format):
        written = list(targets_of(output, group.format, group.keys).values())
        _refuse_input(group.paths, written)
        for path in written:
            check_writable(path)
        return Destination(output, group.format, aside)
    if case_of(output, format) is not None:
        key = OPENFOAM
    elif format is None and _is_case(source, group) and not os.path.splitext(output)[1] and not os.path.exists(output):
        raise InputError(
            f"{output}: an OpenFOAM mesh is written into a case: copy the case there first, "
            "or give --in-place, or --out-dir FOLDER for the mesh alone"
        )
    else:
        refuse_folder(output)
        key = format or format_of_suffix(output, split_name(output)[1], "--output-format", reading=False)
    _refuse_input(group.paths if group is not None else _files(source), _files(output, key))
    for path in files_of(output, FORMATS[key]):
        check_writable(path)
    return Destination(output, key if key == OPENFOAM else format, aside)


def _refuse_input(read: Sequence[str], written: Sequence[str]) -> None:
    """InputError where a file is written that is read."""
    own = {_identity(path): path for path in read if os.path.isfile(path)}
    for path in written:
        if (source := own.get(_identity(path))) is not None:
            raise InputError(f"{path} is the input {source} itself: name another output, or use --in-place")


def refuse_mixture(destination: Destination, json: bool) -> None:
    """InputError where the mesh and a JSON document would both go to the standard output."""
    if json and destination.aside:
        raise InputError(
            f"--json and the output {destination.path} both want the standard output: write the mesh elsewhere"
        )


def check_picture(plot: str, source: str, destination: Destination | None = None) -> None:
    """InputError where a picture cannot be written to this path, or would overwrite a mesh that is read or written."""
    from gmsnet.plot import check_target

    check_target(plot)
    _check_beside(plot, "picture", source, destination)


def check_report(report: str, source: str, destination: Destination | None = None) -> None:
    """The same of a page."""
    from gmsnet.page import check_page

    check_page(report)
    _check_beside(report, "report", source, destination)


def _check_beside(path: str, what: str, source: str, destination: Destination | None) -> None:
    meshes = [*_files(source), *(_files(destination.path, destination.format) if destination else ())]
    if any(_is_same(path, mesh) for mesh in meshes):
        raise InputError(f"{path}: the {what} would overwrite the mesh: give it another name")
    check_writable(path)


def check_drawable(mesh: Mesh, source: str) -> None:
    """InputError, naming the input, where no picture can show the mesh."""
    from gmsnet.plot import check_mesh

    try:
        check_mesh(mesh)
    except InputError as error:
        raise InputError(f"{shown(source)}: {error}; leave out --plot") from error


def shown(path: str) -> str:
    """What messages call an input."""
    return "standard input" if path in STANDARD_INPUT else path


def _files(path: str, format: str | None = None) -> Sequence[str]:
    if format is None and (own := _case(path)):
        return own
    if format is None and (group := group_of(path)) is not None:
        return group.paths
    key = format or BY_SUFFIX.get(split_name(path)[1].lower())
    return list(dict.fromkeys([path, *(files_of(path, FORMATS[key]) if key in FORMATS else ())]))


def _case(path: str) -> list[str]:
    """The files of an OpenFOAM case, that of the points first; none where the path leads to no case."""
    return files_of(path, FORMATS[OPENFOAM]) if case_of(path, None) is not None else []


def _is_case(source: str, group: Group | None) -> bool:
    """Whether the input is an OpenFOAM case, decomposed or not."""
    return bool(_case(source)) if group is None else group.format == DECOMPOSED


def _is_same(one: str, other: str) -> bool:
    """Whether two paths lead to the same file, by whatever name, or to the place of the same file to be made."""
    return _identity(one) == _identity(other)


def _identity(path: str) -> object:
    """The same for all names of a file, or of the place of one to be made."""
    try:
        status = os.stat(path)
    except OSError:  # there is none yet
        return os.path.realpath(path)
    return status.st_dev, status.st_ino
