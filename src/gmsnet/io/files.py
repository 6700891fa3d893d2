"""Reading whole files: which format, and what can go wrong."""

from __future__ import annotations

import os
from codecs import BOM_UTF8
from collections.abc import Mapping
from dataclasses import replace

from gmsnet.errors import FormatError, InputError
from gmsnet.io import foreign
from gmsnet.io.atomic import reason, refuse_folder
from gmsnet.io.cells import sealed
from gmsnet.io.contents import Data, is_open_pipe, load, refuse_unless_regular
from gmsnet.io.document import Parsed
from gmsnet.io.file_source import FileSource
from gmsnet.io.foam_case import OPENFOAM, case_of, file_in
from gmsnet.io.formats import (
    FORMATS,
    Entry,
    check_contents,
    entry_in,
    entry_of,
    format_of_suffix,
    sniff,
)  # fmt: skip
from gmsnet.io.linked import links_of, nested
from gmsnet.io.packed import MAGIC, is_packed, split_name, unpacked
from gmsnet.io.paths import beside, name_of
from gmsnet.io.split_files import group_of
from gmsnet.io.stamps import Stamp, Stamps
from gmsnet.io.streams import STANDARD_INPUT
from gmsnet.mesh.mesh import Mesh


def read(path: str | os.PathLike[str], format: str | None = None) -> Mesh:
    """The mesh in a file; ``mesh.source`` keeps the file, so that ``write`` can put new coordinates into it.

    path: the file; ``-`` is the standard input. Of Triangle's pair either file may be named. A file whose name ends
    with ``.gz`` is unpacked. Of an OpenFOAM case give the folder, of Gmsh's parts ``a_1.msh``, ``a_2.msh``, … the name
    ``a.msh``. format: a name of the table of formats
    (``gmsnet.io.FORMATS``: su2, gmsh, vtk, …); by default the suffix tells, or the contents where there is none to tell
    (standard input, pipes).

    Raises InputError where the file cannot be opened or is no regular file, where others change it while it is read,
    or where the format is unknown; FormatError (naming the line) where it is damaged or not of that format.
    """
    name = name_of(path)
    shown = "standard input" if name in STANDARD_INPUT else name
    suffix = os.path.splitext(name)[1].lower()
    if format is None and suffix in foreign.READ and os.path.isfile(name):
        return foreign.read(name, suffix)
    entry, opened = _open(name, shown, format)
    files = {suffix: data for suffix, (_, data, _) in opened.items()}
    if len(files) > 1 and not (entry.linked or entry.parts):
        shown = opened[entry.suffixes[0]][0]
    try:
        check_contents(files[entry.suffixes[0]], entry.parts or entry.key)
        parsed = entry.load().read(files)
        if not _is_stream(name):
            parsed = replace(parsed, form=_form_told(parsed.form, entry, name))
        return _mesh(parsed, entry, files, Stamps.of(opened.values()))
    except MemoryError:
        raise InputError(f"{shown}: there is not enough memory for this mesh") from None
    except InputError as error:
        raise FormatError(f"{shown}: {error}{_of_mark(files)}") from None


def _of_mark(files: Mapping[str, Data]) -> str:
    """What to add to the reason why files cannot be read if one begins with a byte-order mark."""
    if not any(data[: len(BOM_UTF8)] == BOM_UTF8 for data in files.values()):
        return ""
    return " (the file begins with a byte-order mark, which some editors add: save it as UTF-8 without one)"


def _open(name: str, shown: str, format: str | None) -> tuple[Entry, dict[str, tuple[str, Data, Stamp | None]]]:
    """The format and, by suffix, the path, the bytes and the stamp of each file of the mesh."""
    stream = _is_stream(name)
    if (group := group_of(name, format)) is not None:
        return FORMATS[group.format], {key: loaded(group.path(key)) for key in group.keys}
    if (folder := case_of(name, format)) is not None:
        entry = FORMATS[OPENFOAM]
        there = [key for key in entry.optional if os.path.exists(file_in(folder, key))]
        return entry, {key: loaded(file_in(folder, key)) for key in (*entry.suffixes, *there)}
    refuse_folder(name)
    if not stream:
        if not os.path.exists(name):
            raise InputError(f"{name}: there is no such file")
        refuse_unless_regular(name)
    if format is None and stream:
        opened = loaded(name)
        key = sniff(opened[1])
        if key is None:
            raise InputError(f"{shown}: its format cannot be seen; name it with --format ({', '.join(FORMATS)})")
        entry = FORMATS[key]
        return entry, {entry.suffixes[0]: opened}
    entry = entry_of(format) if format is not None else FORMATS[format_of_suffix(name, split_name(name)[1])]
    if len(entry.suffixes) == 1:
        opened = loaded(name)
        if format is None:
            entry = entry_in(opened[1], entry.key, split_name(name)[1])
        return entry, {entry.suffixes[0]: opened, **_linked(entry, name, shown, opened[1], stream)}
    if stream:
        raise InputError(f"{shown}: {entry.title} takes several files and cannot be read from a stream")
    return entry, {suffix: loaded(beside(name, suffix)) for suffix in entry.suffixes}


def _linked(entry: Entry, name: str, shown: str, data: Data, stream: bool) -> dict[str, tuple[str, Data, Stamp | None]]:
    """The files that a file names, by their keys, and those that they name in turn."""
    opened, folder = dict[str, tuple[str, Data, Stamp | None]](), os.path.dirname(name)
    ways, naming = {os.path.normpath(name)}, [("", shown, data)]
    while naming:
        key, title, data = naming.pop()
        for path, file in _named(entry, title, data, os.path.dirname(key)).items():
            if stream:
                raise InputError(f"{shown}: {entry.title} that names another file cannot be read from a stream")
            place = os.path.join(folder, file)
            if os.path.normpath(place) in ways:
                raise FormatError(f"{title}: {file[:80]!r} is named twice, or names itself")
            ways.add(os.path.normpath(place))
            try:
                opened[path] = loaded(place)
            except InputError as error:
                raise type(error)(f"{shown}: the file that it names cannot be read: {error}") from None
            if nested(entry, file):
                naming.append((path, f"{shown}: {path}", opened[path][1]))
    return opened


def _named(entry: Entry, title: str, data: Data, folder: str) -> dict[str, str]:
    """Key → path of the files that a file names, both from the folder of the first file. folder: of the file itself."""
    try:
        found = links_of(entry, data)
    except FormatError as error:
        raise FormatError(f"{title}: {error}") from None
    return {os.path.join(folder, key): os.path.join(folder, path) for key, path in found.items()} if folder else found


def _is_stream(name: str) -> bool:
    return name in STANDARD_INPUT or is_open_pipe(name)


def _form_told(form: str, entry: Entry, name: str) -> str:
    """The form that the name of a file says. FormatError where it says another one than the file has.

    A name that says none is right for any: the file keeps its form under such names.
    """
    told = entry.form_of(name)
    if told and form != told:
        suffix = entry.suffixes[0]
        found = f".{form}{suffix}" if form else f"text ({suffix})"
        raise FormatError(f"the contents are those of {found}, but the name says .{told}{suffix}: rename the file")
    return told


def loaded(name: str) -> tuple[str, Data, Stamp | None]:
    """The name, the bytes, unpacked, and the stamp of one file. Errors: see ``read``."""
    try:
        data, stamp = load(name)
        if is_packed(name):
            return name, unpacked(data, name), stamp
        if data[: len(MAGIC)] == MAGIC:
            raise FormatError("this is compressed with gzip: add .gz to the name of the file, or unpack it first")
        return name, data, stamp
    except FormatError as error:
        raise FormatError(f"{name}: {error}") from None
    except FileNotFoundError:
        raise InputError(f"{name}: there is no such file") from None
    except IsADirectoryError:
        raise InputError(f"{name}: this is a folder; give the name of a file") from None
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {reason(error)}") from None
    except MemoryError:
        raise InputError(f"{name}: there is not enough memory for this file") from None


def _mesh(parsed: Parsed, entry: Entry, files: Mapping[str, Data], stamps: Stamps) -> Mesh:
    if not len(parsed.points):
        raise FormatError("the file holds no points")
    if not any(len(block.nodes) for block in parsed.cells):
        raise FormatError("the file holds no cells")
    mesh = Mesh(
        sealed(parsed.points),
        tuple(parsed.cells),
        parsed.region_names,
        parsed.point_data,
        parsed.cell_data,
        parsed.single,
        node_sets=parsed.node_sets,
        rounding=parsed.rounding,
    )
    main = parsed.main or entry.suffixes[0]
    companions = {suffix: data for suffix, data in files.items() if suffix != main}
    source = FileSource(
        entry.key, main, files[main], mesh.points, parsed.slots, mesh.cells, companions,
        mesh.region_names, mesh.point_data, mesh.cell_data, tuple(parsed.unread), stamps, parsed.images,
        mesh.node_sets, parsed.form, parsed.shares, getattr(entry.load(), "normals", None),
    )  # fmt: skip
    return replace(mesh, source=source)
