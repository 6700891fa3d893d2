"""The XML of a VTU file: which arrays it holds and at which bytes their tags and their contents stand.

Raw appended data are no XML: the parser stops where they begin, and the end tags behind them are looked for by hand.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.text import fail
from gmsnet.io.xml_tree import ATTRIBUTE, TAG

MOST_DEEP, MOST_ARRAYS = 100, 100_000  # elements inside one another, arrays: no grid has so many

_OFFSET = re.compile(rb"\s*(\d{1,18})\s*")
_TAIL = re.compile(rb"</AppendedData\s*>\s*</VTKFile\s*>\s*\Z")


@dataclass(frozen=True)
class DataArray:
    """An array. tag: first byte of its start tag and the byte behind it; body: likewise of what it contains.

    offset: of appended data, and the bytes where it is written.
    """

    section: str
    element: str
    attributes: Mapping[str, str]
    tag: tuple[int, int]
    body: tuple[int, int]
    offset: tuple[int, int, int] | None = None


@dataclass
class Document:
    """A VTU file. kind: the type of its VTKFile, which is the name of the element with the pieces too.

    hidden: first byte of comments, and of what arrays contain beside their numbers, and the byte behind, in turn. root,
    pieces: the attributes of these elements. appended: the encoding of the appended data, and their bytes. global_ids:
    the name of the array that numbers the points over all pieces, "" where none is said to.
    """

    data: Data
    kind: str = "UnstructuredGrid"
    hidden: list[tuple[int, int]] = field(default_factory=list)
    root: dict[str, str] = field(default_factory=dict)
    pieces: list[dict[str, str]] = field(default_factory=list)
    arrays: list[DataArray] = field(default_factory=list)
    appended: tuple[str, int, int] | None = None
    global_ids: str = ""

    def visible(self, start: int, stop: int) -> list[tuple[int, int]]:
        """The parts of what stands between two bytes that are not hidden."""
        found = []
        for first, end in self.hidden[bisect_left(self.hidden, (start, 0)) :]:
            if first >= stop:
                break
            if start < end:
                found.append((start, first))
                start = end
        return [*found, (start, stop)]


class _RawDataFollow(Exception):
    """The parser has met the start tag of raw appended data."""


def parse(data: Data, kind: str = "UnstructuredGrid") -> Document:
    """The structure of the file, which must be of this kind. Raises FormatError where it is not, or not well formed."""
    if not re.match(rb"[\xef\xbb\xbf \t\r\n]*<", data):
        raise FormatError("line 1: not an XML file: such a file starts with '<VTKFile' or '<?xml'")
    walker = _Walker(data, kind)
    try:
        walker.parser.Parse(data, True)
    except _RawDataFollow:
        walker.find_raw_data()
    except expat.ExpatError as error:
        raise FormatError(f"line {error.lineno}: the XML is not well formed: {expat.ErrorString(error.code)}") from None
    except (LookupError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"the XML has an encoding that is not supported, write it as UTF-8: {error}") from None
    walker.document.hidden.sort()
    return walker.document


class _Walker:
    """Follows the parser's events and notes where things stand."""

    def __init__(self, data: Data, kind: str) -> None:
        self.data, self.document = data, Document(data, kind)
        self.path: list[str] = []
        self.tags: list[tuple[int, int]] = []
        self.open: tuple[str, str, dict[str, str], tuple[int, int]] | None = None
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.begin
        self.parser.EndElementHandler = self.finish
        self.parser.CommentHandler = self.comment
        self.parser.ProcessingInstructionHandler = self.instruction
        self.parser.StartDoctypeDeclHandler = self.doctype

    @property
    def at(self) -> int:
        return self.parser.CurrentByteIndex

    def fail(self, message: str) -> None:
        fail(self.data, self.at, message)

    def doctype(self, *_: object) -> None:
        self.fail("a DOCTYPE is not allowed in a VTU file: remove it")

    def comment(self, _: str) -> None:
        self.document.hidden.append((self.at, self.data.find(b"-->", self.at) + 3))

    def instruction(self, *_: object) -> None:
        self.document.hidden.append((self.at, self.data.find(b"?>", self.at) + 2))

    def tag(self) -> tuple[int, int]:
        match = TAG.match(self.data, self.at)
        if match is None:
            raise FormatError("the XML has an encoding that is not supported: write it as UTF-8")
        return match.span()

    def begin(self, name: str, attributes: dict[str, str]) -> None:
        depth = len(self.path)
        if depth == MOST_DEEP:
            self.fail(f"elements lie more than {MOST_DEEP} deep inside one another")
        if depth == 0:
            self.document.root = attributes
            if name != "VTKFile":
                self.fail(f"the root element is {name[:24]!r} instead of 'VTKFile'")
            kind = attributes.get("type")
            if kind != self.document.kind:
                wanted = self.document.kind
                self.fail(f"a VTKFile of type {str(kind)[:24]!r} is not supported here: write it as {wanted}")
        elif self.path == ["VTKFile", self.document.kind] and name == "Piece":
            if self.document.pieces:
                self.fail("several pieces in one file are not supported: merge them first")
            self.document.pieces.append(attributes)
        elif self.path == ["VTKFile"] and name == "AppendedData":
            encoding = attributes.get("encoding", "raw")
            if self.document.appended is not None or encoding not in ("raw", "base64"):
                self.fail(f"AppendedData with the encoding {encoding[:24]!r} are unknown or given twice")
            self.document.appended = encoding, self.tag()[1], -1
            if encoding == "raw":
                raise _RawDataFollow
        elif name == "PointData" and depth == 3:
            self.document.global_ids = attributes.get("GlobalIds", "")
        elif name in ("DataArray", "Array") and self.open is None:
            section = self.path[-1] if self.path[:3] == ["VTKFile", self.document.kind, "Piece"] and depth == 4 else ""
            self.open = section, name, attributes, self.tag()
        self.path.append(name)
        self.tags.append(self.tag())

    def finish(self, name: str) -> None:
        self.path.pop()
        tag = self.tags.pop()
        empty = self.data[tag[1] - 2 : tag[1]] == b"/>"
        first, end = (tag[1], tag[1]) if empty else self.tag()
        if self.open is not None and self.open[3] == tag:
            section, element, attributes, _ = self.open
            self.open = None
            if len(self.document.arrays) == MOST_ARRAYS:
                self.fail(f"there are more than {MOST_ARRAYS} arrays")
            offset = self.offset(tag) if attributes.get("format") == "appended" else None
            self.document.arrays.append(DataArray(section, element, attributes, tag, (tag[1], first), offset))
        elif self.open is not None and self.tags[-1] == self.open[3]:
            self.document.hidden.append((tag[0], end))  # a child, and all that it contains
        elif name == "AppendedData" and self.path == ["VTKFile"] and self.document.appended is not None:
            encoding, _, _ = self.document.appended
            self.document.appended = encoding, self.underscore(tag[1], first), first

    def offset(self, tag: tuple[int, int]) -> tuple[int, int, int] | None:
        """The offset in a start tag, and the bytes where it is written: it may have to be written anew."""
        for attribute in ATTRIBUTE.finditer(self.data, *tag):
            if attribute[1] == b"offset":
                place = 2 if attribute[2] is not None else 3
                found = _OFFSET.fullmatch(self.data, *attribute.span(place))
                return (int(found[1]), *found.span(1)) if found else None
        return None

    def find_raw_data(self) -> None:
        """Raw appended data lie between the first underscore and the last end tags."""
        assert self.document.appended is not None
        encoding, start, _ = self.document.appended
        tail = _TAIL.search(self.data, max(start, self.data.rfind(b"</AppendedData")))
        if tail is None:
            raise FormatError("the file does not end with </AppendedData></VTKFile>: it is cut off")
        self.document.appended = encoding, self.underscore(start, tail.start()), tail.start()

    def underscore(self, start: int, stop: int) -> int:
        found = re.compile(rb"\s*_").match(self.data, start, stop)
        if found is None:
            fail(self.data, start, "an underscore is missing at the beginning of AppendedData")
        return found.end()
