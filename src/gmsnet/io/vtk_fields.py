"""The data of points, of cells and of the whole grid in a legacy VTK file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

from gmsnet.io.vtk_stream import Line, Stream, field_name, word_of
from gmsnet.io.words import typed

Take = Callable[[Stream, Line, int, int, str], Any]  # of an array of so many rows, numbers in each, and type

ATTRIBUTES = {  # keyword: how its line goes on, components
    "VECTORS": ("VECTORS name type", 3),
    "NORMALS": ("NORMALS name type", 3),
    "TENSORS": ("TENSORS name type", 9),
    "TENSORS6": ("TENSORS6 name type", 6),
    "GLOBAL_IDS": ("GLOBAL_IDS name type", 1),
    "PEDIGREE_IDS": ("PEDIGREE_IDS name type", 1),
    "EDGE_FLAGS": ("EDGE_FLAGS name type", 1),
}


def keyword(stream: Stream, key: str) -> Line:
    """The next line, which must begin with this key."""
    line = stream.line()
    if line.key != key:
        stream.fail(line.start, f"expected {key}")
    return line


def attribute(
    stream: Stream, line: Line, count: int, others: list[str], take: Take | None = None
) -> list[tuple[str, Any]]:
    """The arrays of an attribute that begins with a line, of ``count`` rows; others, take: see ``field_arrays``."""
    take = take or _values
    key = line.key
    if key == "FIELD":
        return field_arrays(stream, line, count, others, take)
    if key == "LOOKUP_TABLE":  # colours, which are not kept
        called, text = stream.expect(line, "LOOKUP_TABLE name size")
        size = stream.count(line, text)
        others.append(f"the colours {field_name(called)!r}")
        stream.array(line, 4 * size, "unsigned_char" if stream.binary else "float").values()
        return []
    kind = "unsigned_char" if stream.binary else "float"
    if key == "SCALARS":
        called, kind, *more = stream.expect(line, "SCALARS name type components", 1)
        width = stream.count(line, more[0]) if more else 1
        table = keyword(stream, "LOOKUP_TABLE")
        stream.expect(table, "LOOKUP_TABLE name")
    elif key == "COLOR_SCALARS":
        called, text = stream.expect(line, "COLOR_SCALARS name components")
        width = stream.count(line, text)
    elif key == "TEXTURE_COORDINATES":
        called, text, kind = stream.expect(line, "TEXTURE_COORDINATES name components type")
        width = stream.count(line, text)
    elif key in ATTRIBUTES:
        usage, width = ATTRIBUTES[key]
        called, kind = stream.expect(line, usage)
    else:
        stream.fail(line.start, f"unknown keyword {word_of(line.words[0])}")
    return [(field_name(called), take(stream, line, count, width, kind))]


def field_arrays(
    stream: Stream, line: Line, rows: int | None, others: list[str], take: Take | None = None
) -> list[tuple[str, Any]]:
    """The arrays of a FIELD, which must have ``rows`` rows (None: any number, and they are not kept).

    others: takes the words for those that are not kept. take: what makes something else than the values of an array.
    """
    take, found = take or _values, []
    for _ in range(stream.count(line, stream.expect(line, "FIELD name arrays")[1])):
        head = stream.line()
        if head.key == "NULL_ARRAY":
            continue
        called, components, tuples, kind = [head.words[0] if head.words else "", *stream.expect(head, _ARRAY)]
        width, length = stream.count(head, components), stream.count(head, tuples)
        if rows is not None and length != rows:
            stream.fail(head.start, f"the array {word_of(called)} has {length} rows instead of {rows}")
        if kind.lower() in ("string", "utf8_string"):
            stream.skip_strings(width * length)
            others.append(f"the texts {field_name(called)!r}")
        elif rows is None:
            take(stream, head, length, width, kind)
            others.append(f"the field {field_name(called)!r} of the whole grid")
        else:
            found.append((field_name(called), take(stream, head, length, width, kind)))
    return found


_ARRAY = "name components rows type"


def _values(stream: Stream, line: Line, rows: int, width: int, kind: str) -> NDArray[Any]:
    """An attribute: (rows,) or (rows, width), of the type that the file declares."""
    if kind.lower() == "bit":
        values: NDArray[Any] = stream.bits(rows * width)
    else:
        array = stream.array(line, rows * width, kind)
        values = typed(array.values(), array.kind)
    return values if width == 1 else values.reshape(rows, width)


def vectors(stream: Stream, line: Line, rows: int, width: int, kind: str) -> Any:
    """A Take: of vectors of floats where their numbers stand, an Array, of others the values."""
    if width == 3 and kind.lower() in ("float", "double"):
        return stream.array(line, 3 * rows, kind)
    return _values(stream, line, rows, width, kind)
