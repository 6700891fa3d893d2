"""Writing whole files: which format, what can go wrong, and nothing ever half-written."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator

from gmsnet.errors import FormatError, InputError
from gmsnet.io import foreign
from gmsnet.io.atomic import reason, refuse_folder, replace_files
from gmsnet.io.convert import listed
from gmsnet.io.file_source import FileSource
from gmsnet.io.foam_case import OPENFOAM, case_of, file_in
from gmsnet.io.formats import (
    FORMATS,
    Entry,
    entry_of,
    format_of_suffix,
)  # fmt: skip
from gmsnet.io.linked import folders_for, placed
from gmsnet.io.packed import is_packed, packed, split_name
from gmsnet.io.paths import beside, name_of
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.splice import most_rounded
from gmsnet.io.split_files import takes_parts, targets_of
from gmsnet.io.stamps import Stamps
from gmsnet.io.streams import STANDARD_OUTPUT, is_special, standard_output
from gmsnet.mesh.mesh import Mesh, Source


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
    name = name_of(path)
    if not isinstance(mesh, Mesh):
        raise InputError(f"only a gmsnet.Mesh can be written, no {type(mesh).__name__}: of a result, give its .mesh")
    shown = "standard output" if name in STANDARD_OUTPUT else name
    entry = output_format(mesh, name, format)
    source = mesh.source
    lost: list[str] = []
    try:
        form = _form_for(source, entry, name)
        if isinstance(source, FileSource) and (source.format, source.form) == (entry.key, form) and source.fits(mesh):
            lost = [*_rounded(mesh, source), *_stale(source, entry)]
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
        targets = targets or paths_of(name, entry, list(files), stamps)
        with folders_for(name, targets.values() if entry.linked else ()):
            replace_files(
                {path: packed(pieces[key]) if is_packed(path) else pieces[key] for key, path in targets.items()}, stamps
            )
    return lost


def paths_of(name: str, entry: Entry, keys: list[str], stamps: Stamps) -> dict[str, str]:
    """Suffix → the path of each file that is written. Files of a case that were read and do not change are not."""
    if entry.parts:
        return targets_of(name, entry.key, keys, stamps.known)
    folder = case_of(name, entry.key)
    if folder is None:
        return {key: beside(name, key) if len(keys) > 1 else name for key in keys}
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


def _stale(source: FileSource, entry: Entry) -> Iterator[str]:
    """In words, which normals were to be computed anew in a file and are not."""
    if source.stale:
        yield (
            f"normals ({', '.join(source.stale)}) stay as they are in {entry.title} files, though nodes moved: to have "
            "them computed anew write another format, such as .vtu"
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
    own = FORMATS.get(mesh.source.format) if mesh.source is not None else None
    if own is not None and own.parts and format in (None, own.key) and takes_parts(path, own.key):
        return own
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
        if own is not None and suffix.lower() in (*own.suffixes, *own.aliases):
            entry = own  # of several formats with this suffix the one that was read
    if stream and len(entry.suffixes) > 1:
        raise InputError(f"{shown}: {entry.title} takes several files and cannot be written to a stream")
    return entry


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
