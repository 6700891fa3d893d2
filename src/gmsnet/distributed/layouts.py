"""How a mesh stands in several files, of which each rank reads some: one file of VTK lists them, or none does."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

from gmsnet.distributed.planned import planned_format
from gmsnet.errors import FormatError, InputError
from gmsnet.io import vtk_links
from gmsnet.io.contents import Data
from gmsnet.io.files import loaded
from gmsnet.io.foam_case import OPENFOAM, mesh_folder
from gmsnet.io.formats import BY_SUFFIX, FORMATS, check_contents
from gmsnet.io.merge import Part
from gmsnet.io.packed import is_packed, split_name
from gmsnet.io.pieces import Pieces
from gmsnet.io.split_files import Group, group_of, takes_parts, targets_of
from gmsnet.io.split_parts import SplitFormat
from gmsnet.io.stamps import Stamp
from gmsnet.io.vtk_links import Link, kind_of
from gmsnet.io.vtk_pieces import part_in

KINDS = {"pvtu": "PUnstructuredGrid", "pvtp": "PPolyData"}  # format → type of the file
Opened = tuple[str, Data, Stamp | None]  # name, bytes, stamp


class Layout(Protocol):
    """The files of a mesh. Keys of files stand for them; it is the same on all ranks."""

    @property
    def parts(self) -> Sequence[tuple[str, ...]]:
        """For each part the keys of its files, of which the first has the coordinates."""
        ...

    @property
    def index(self) -> Opened | None:
        """The file that lists the others."""
        ...

    def load(self, key: str) -> Opened:
        """A file. Raises InputError where it cannot be read."""
        ...

    def part_in(self, keys: Sequence[str], files: Mapping[str, Data]) -> tuple[Part, Any] | None:
        """What the files of a part hold, and what ``check`` is to be told. None where it has no cells."""
        ...

    def check(self, told: Sequence[Any]) -> None:
        """Raises FormatError where parts do not belong together. told: of all parts with cells."""
        ...

    def targets(self, name: str, known: Collection[str]) -> dict[str, str]:
        """Key → path of the files to be written by a name. known: the absolute paths of those that were read."""
        ...

    def renamed(self, name: str) -> dict[str, Pieces]:
        """Path → the file that lists the others at their targets, to be written by a name; none where there is none."""
        ...


@dataclass(frozen=True)
class Listed:
    """The pieces that a file of VTK lists. name: its path."""

    name: str
    index: Opened
    links: Sequence[Link]

    @property
    def parts(self) -> Sequence[tuple[str, ...]]:
        """See Layout."""
        return [(link.path,) for link in self.links]

    def load(self, key: str) -> Opened:
        """See Layout."""
        try:
            return loaded(os.path.join(os.path.dirname(self.name), key))
        except InputError as error:
            raise type(error)(f"{self.name}: the file that it names cannot be read: {error}") from None

    def part_in(self, keys: Sequence[str], files: Mapping[str, Data]) -> tuple[Part, Any] | None:
        """See Layout."""
        link = next(link for link in self.links if link.path == keys[0])
        found = part_in(link, files)
        return None if found is None else (found[0], None)

    def check(self, told: Sequence[Any]) -> None:
        """See Layout: pieces of any kind belong together."""

    def targets(self, name: str, known: Collection[str]) -> dict[str, str]:
        """See Layout."""
        paths = {key: os.path.join(os.path.dirname(name), path) for key, path in self._placed(name).items()}
        lost = [path for path in paths.values() if os.path.abspath(path) in known and not self._is_own(name)]
        if lost:
            raise InputError(f"{lost[0]}: holds the numbers of the mesh that was read: name another output")
        return paths

    def renamed(self, name: str) -> dict[str, Pieces]:
        """See Layout."""
        text = vtk_links.relinked(bytes(self.index[1]), self._placed(name))
        return {name: Pieces(lambda: [text])}

    def _placed(self, name: str) -> dict[str, str]:
        """The path that each file gets below the folder of the file that lists it, if this is written by a name."""
        return vtk_links.placed(name, {key: key for (key,) in self.parts}, self._is_own(name))

    def _is_own(self, name: str) -> bool:
        return os.path.abspath(name) in (os.path.abspath(self.name), os.path.realpath(self.name))


@dataclass(frozen=True)
class Unlisted:
    """Files that no file lists (``gmsnet.io.split_files``)."""

    name: str
    group: Group
    index: None = None

    @property
    def _format(self) -> SplitFormat:
        return cast(SplitFormat, FORMATS[self.group.format].load())

    @property
    def parts(self) -> Sequence[tuple[str, ...]]:
        """See Layout."""
        return self.group.parts

    def load(self, key: str) -> Opened:
        """See Layout."""
        return loaded(self.group.path(key))

    def part_in(self, keys: Sequence[str], files: Mapping[str, Data]) -> tuple[Part, Any] | None:
        """See Layout."""
        if keys == self.parts[0]:
            check_contents(files[keys[0]], FORMATS[self.group.format].parts)
        return self._format.part_in(keys, files)

    def check(self, told: Sequence[Any]) -> None:
        """See Layout."""
        self._format.check(told, len(self.parts))

    def targets(self, name: str, known: Collection[str]) -> dict[str, str]:
        """See Layout."""
        return targets_of(name, self.group.format, self.group.keys, known)

    def renamed(self, name: str) -> dict[str, Pieces]:
        """See Layout."""
        return {}


def shared_format(
    source: str, target: str, read_as: str | None = None, write_as: str | None = None, *, named: bool = False
) -> str:
    """The format of two meshes that ranks read and write part by part; "" where they do not.

    read_as, write_as: the formats that are asked for. named: markers are asked for by name.
    """
    if (group := group_of(source, read_as)) is not None:
        return group.format if write_as in (None, group.format) and takes_parts(target, group.format) else ""
    folders = mesh_folder(source), mesh_folder(target)
    if any(folders):
        ours = {read_as, write_as} <= {None, OPENFOAM} and all(folders)
        return planned_format(source, OPENFOAM, named=named) if ours else ""
    if read_as or write_as:
        return ""
    first, second = (BY_SUFFIX.get(split_name(path)[1].lower(), "") for path in (source, target))
    if first != second or not first:
        return ""
    if first in KINDS:
        return first
    alike = FORMATS[first].form_of(source) == FORMATS[first].form_of(target)
    plain = alike and not (is_packed(source) or is_packed(target))
    return planned_format(source, first, named=named) if plain else ""


def layout_of(name: str, format: str) -> Layout:
    """The files of a mesh of one of these formats. Raises InputError where they are damaged, or some are missing."""
    if FORMATS[format].parts:
        group = group_of(name, format)
        assert group is not None
        return Unlisted(name, group)
    path, data, stamp = loaded(name)
    try:
        check_contents(data, format)
        kind, links = kind_of(data)
        if kind != KINDS[format]:
            raise FormatError(f"a VTKFile of type {kind} is not {FORMATS[format].title}: rename the file")
    except InputError as error:
        raise FormatError(f"{name}: {error}") from None
    return Listed(name, (path, bytes(data[:]), stamp), links)
