"""Reading and writing whole files: which format, what can go wrong, and nothing ever half-written."""

from __future__ import annotations

import os
from codecs import BOM_UTF8
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from gmsnet.errors import FormatError, InputError
from gmsnet.io import foreign
from gmsnet.io.atomic import reason, refuse_folder, replace_files
from gmsnet.io.cells import sealed
from gmsnet.io.contents import Data, is_open_pipe, load, refuse_unless_regular
from gmsnet.io.convert import listed
from gmsnet.io.document import Parsed
from gmsnet.io.foam_case import OPENFOAM, case_of, file_in
from gmsnet.io.formats import (
    BY_SUFFIX,
    FORMATS,
    Entry,
    check_contents,
    entry_in,
    entry_of,
    format_of_suffix,
    sniff,
)  # fmt: skip
from gmsnet.io.linked import folders_for, links_of, placed
from gmsnet.io.packed import MAGIC, is_packed, packed, split_name, unpacked
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.splice import FileSource, most_rounded
from gmsnet.io.stamps import Stamp, Stamps
from gmsnet.io.streams import STANDARD_INPUT, STANDARD_OUTPUT, is_special, standard_output
from gmsnet.mesh.mesh import Mesh, Source


def read(path: str | os.PathLike[str], format: str | None = None) -> Mesh:
    """The mesh in a file; ``mesh.source`` keeps the file, so that ``write`` can put new coordinates into it.

    path: the file; ``-`` is the standard input. Of Triangle's pair either file may be named. A file whose name ends
    with ``.gz`` is unpacked. Of an OpenFOAM case give the folder. format: a name of the table of formats
    (``gmsnet.io.FORMATS``: su2, gmsh, vtk, …); by default the suffix tells, or the contents where there is none to tell
    (standard input, pipes).

    Raises InputError where the file cannot be opened or is no regular file, where others change it while it is read,
    or where the format is unknown; FormatError (naming the line) where it is damaged or not of that format.
    """
    name = _name(path)
    shown = "standard input" if name in STANDARD_INPUT else name
    suffix = os.path.splitext(name)[1].lower()
    if format is None and suffix in foreign.READ and os.path.isfile(name):
        return foreign.read(name, suffix)
    entry, opened = _open(name, shown, format)
    files = {suffix: data for suffix, (_, data, _) in opened.items()}
    if len(files) > 1 and not entry.linked:
        shown = opened[entry.suffixes[0]][0]
    try:
        check_contents(files[entry.suffixes[0]], entry.key)
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


def _name(path: Any) -> str:
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise InputError(f"a file is given by its path, not by {path!r}")
    return os.fsdecode(path)


def _open(name: str, shown: str, format: str | None) -> tuple[Entry, dict[str, tuple[str, Data, Stamp | None]]]:
    """The format and, by suffix, the path, the bytes and the stamp of each file of the mesh."""
    stream = _is_stream(name)
    if (folder := case_of(name, format)) is not None:
        entry = FORMATS[OPENFOAM]
        there = [key for key in entry.optional if os.path.exists(file_in(folder, key))]
        return entry, {key: _loaded(file_in(folder, key)) for key in (*entry.suffixes, *there)}
    refuse_folder(name)
    if not stream:
        if not os.path.exists(name):
            raise InputError(f"{name}: there is no such file")
        refuse_unless_regular(name)
    if format is None and stream:
        opened = _loaded(name)
        key = sniff(opened[1])
        if key is None:
            raise InputError(f"{shown}: its format cannot be seen; name it with --format ({', '.join(FORMATS)})")
        entry = FORMATS[key]
        return entry, {entry.suffixes[0]: opened}
    entry = entry_of(format) if format is not None else FORMATS[format_of_suffix(name, split_name(name)[1])]
    if len(entry.suffixes) == 1:
        opened = _loaded(name)
        if format is None:
            entry = entry_in(opened[1], entry.key, split_name(name)[1])
        return entry, {entry.suffixes[0]: opened, **_linked(entry, name, shown, opened[1], stream)}
    if stream:
        raise InputError(f"{shown}: {entry.title} takes several files and cannot be read from a stream")
    return entry, {suffix: _loaded(_beside(name, suffix)) for suffix in entry.suffixes}


def _linked(entry: Entry, name: str, shown: str, data: Data, stream: bool) -> dict[str, tuple[str, Data, Stamp | None]]:
    """The files that a file names, by their keys."""
    try:
        named = links_of(entry, data)
    except FormatError as error:
        raise FormatError(f"{shown}: {error}") from None
    if named and stream:
        raise InputError(f"{shown}: {entry.title} that names another file cannot be read from a stream")
    try:
        return {key: _loaded(os.path.join(os.path.dirname(name), path)) for key, path in named.items()}
    except InputError as error:
        raise type(error)(f"{shown}: the file that it names cannot be read: {error}") from None


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


def _loaded(name: str) -> tuple[str, Data, Stamp | None]:
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


def _beside(name: str, suffix: str) -> str:
    """The name of a companion file, its suffix in capitals if that of ``name`` is, and compressed if that is."""
    stem, given, gz = split_name(name)
    if given.lower() not in BY_SUFFIX:
        stem, given = stem + given, ""
    return stem + (suffix.upper() if given.isupper() else suffix) + gz


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
        mesh.region_names, mesh.point_data, mesh.cell_data, tuple(parsed.unread), stamps, parsed.matched,
        mesh.node_sets, parsed.form, parsed.shares,
    )  # fmt: skip
    return replace(mesh, source=source)


def write(mesh: Mesh, path: str | os.PathLike[str], format: str | None = None) -> list[str]:
    """Writes a mesh to a file and returns, in words, what the target's format could not hold.

    A mesh that was read from a file of the same format, and differs from it in coordinates alone, is written as that
    file with the new coordinates in the places of the old ones; then nothing is lost. Any other is converted. A file
    whose name ends with ``.gz`` is compressed; what is promised byte for byte is what it unpacks to.

    path: the file; ``-`` is the standard output, and pipes and devices are written straight. Everything else is
    replaced in one step, once all is on the disk. format: as in ``read``; by default the suffix tells, or the format
    that the mesh was read from where there is none to tell.

    Raises InputError where the file cannot be written, or is the one that the mesh was read from and others have
    changed or replaced it since; FormatError where the format cannot hold the mesh.
    """
    name = _name(path)
    if not isinstance(mesh, Mesh):
        raise InputError(f"only a gmsnet.Mesh can be written, no {type(mesh).__name__}: of a result, give its .mesh")
    shown = "standard output" if name in STANDARD_OUTPUT else name
    entry = output_format(mesh, name, format)
    source = mesh.source
    lost: list[str] = []
    try:
        form = _form_for(source, entry, name)
        if isinstance(source, FileSource) and (source.format, source.form) == (entry.key, form) and source.fits(mesh):
            lost = _rounded(mesh, source)
            files = source.splice(mesh.points)
        else:
            written = entry.write(mesh, form)
            files, lost = dict(written.files), [*written.lost, *_unread(source)]
    except MemoryError:
        raise _no_memory(shown) from None
    except InputError as error:
        raise FormatError(f"{shown}: {error}") from None
    stamps = source.stamps if isinstance(source, FileSource) else Stamps()
    targets: dict[str, str] = {}
    if entry.linked and len(files) > 1:
        if name in STANDARD_OUTPUT or is_special(name):
            raise InputError(f"{shown}: {entry.title} in several files cannot be written to a stream")
        files, targets = placed(entry, files, name, stamps)
    pieces = {suffix: _with_memory(shown, part) for suffix, part in files.items()}
    if name in STANDARD_OUTPUT:
        _to_standard_output(*pieces.values())
    else:
        targets = targets or _targets(name, entry, list(files), stamps)
        with folders_for(name, targets.values() if entry.linked else ()):
            replace_files(
                {path: packed(pieces[key]) if is_packed(path) else pieces[key] for key, path in targets.items()}, stamps
            )
    return lost


def _targets(name: str, entry: Entry, keys: list[str], stamps: Stamps) -> dict[str, str]:
    """Suffix → the path of each file that is written. Files of a case that were read and do not change are not."""
    folder = case_of(name, entry.key)
    if folder is None:
        return {key: _beside(name, key) if len(keys) > 1 else name for key in keys}
    paths = {key: file_in(folder, key, is_packed(name)) for key in keys}
    return {
        key: path for key, path in paths.items()
        if key == entry.suffixes[0] or os.path.abspath(path) not in stamps.known
    }  # fmt: skip


def _form_for(source: Source | None, entry: Entry, name: str) -> str:
    """The form that is written: what the name says, and in a stream, which has none, that of the file that was read."""
    if name not in STANDARD_OUTPUT and not is_special(name):
        return entry.form_of(name)
    return source.form if isinstance(source, FileSource) and source.format == entry.key else ""


def _rounded(mesh: Mesh, source: FileSource) -> list[str]:
    """In words, by how much the file that was read keeps points differently. Those that ``smooth`` returns are so."""
    most = most_rounded(mesh.rounding, source.points, mesh.points) if mesh.rounding else 0.0
    return (
        [f"coordinates were rounded to {mesh.rounding.words}, by at most {most:.2g}"] if mesh.rounding and most else []
    )


def _unread(source: Source | None) -> Iterator[str]:
    """What a conversion leaves behind in the file that was read, in words."""
    if isinstance(source, foreign.ForeignSource):
        yield f"what meshlane does not read of a file of {source.title}: left out"
    if isinstance(source, FileSource) and source.unread:
        title = FORMATS[source.format].title
        yield f"only the {title} file that was read holds {listed(source.unread)}: left out"


def _with_memory(shown: str, pieces: Pieces) -> Iterator[Piece]:
    try:
        yield from pieces
    except MemoryError:
        raise _no_memory(shown) from None


def _no_memory(shown: str) -> InputError:
    return InputError(f"{shown}: there is not enough memory to write this mesh")


def output_format(mesh: Mesh, path: str, format: str | None = None) -> Entry:
    """The format that ``write`` takes. Raises the InputErrors of ``write`` that do not need the conversion."""
    stream = path in STANDARD_OUTPUT or is_special(path)
    shown = "standard output" if path in STANDARD_OUTPUT else path
    if case_of(path, format) is not None:
        return FORMATS[OPENFOAM]
    refuse_folder(path)
    if format is not None:
        entry = entry_of(format)
    elif stream and mesh.source is not None and mesh.source.format:
        entry = entry_of(mesh.source.format)
    elif stream:
        raise InputError(f"{shown}: name the format with --format ({', '.join(FORMATS)})")
    else:
        suffix = split_name(path)[1]
        entry = FORMATS[format_of_suffix(path, suffix, reading=False)]
        own = FORMATS.get(mesh.source.format) if mesh.source is not None else None
        if own is not None and suffix.lower() in (*own.suffixes, *own.aliases):
            entry = own  # of several formats with this suffix the one that was read
    if stream and len(entry.suffixes) > 1:
        raise InputError(f"{shown}: {entry.title} takes several files and cannot be written to a stream")
    return entry


def files_of(name: str, entry: Entry) -> list[str]:
    """The files that a mesh of this name and format stands in: more than one where its format says so."""
    if (folder := case_of(name, entry.key)) is not None:
        return [file_in(folder, key, is_packed(name)) for key in entry.suffixes]
    return [name] if len(entry.suffixes) == 1 else [_beside(name, suffix) for suffix in entry.suffixes]


def _to_standard_output(pieces: Iterable[Piece]) -> None:
    stream = standard_output()
    try:
        for piece in pieces:
            stream.write(piece)
        stream.flush()
    except BrokenPipeError:  # nobody reads any more: no fault of the user's
        raise
    except OSError as error:
        raise InputError(f"standard output: cannot be written: {reason(error)}") from None
