"""The two layers of a legacy VTK file: lines with keywords, and arrays in text or big-endian binary between them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, NoReturn
from urllib.parse import unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.places import Places
from gmsnet.io.text import Text, fail, quoted
from gmsnet.io.words import ByteWords, TextWords, Words, fail_at

TYPES = {
    "unsigned_char": "u1", "char": "i1", "signed_char": "i1", "unsigned_short": "u2", "short": "i2",
    "unsigned_int": "u4", "int": "i4", "unsigned_long": "u8", "long": "i8", "float": "f4", "double": "f8",
    "vtkidtype": "i4",
}  # fmt: skip
OWN_TYPES = dict(TYPES)  # that VTK itself writes; meshio others, too
TYPES |= {f"vtktype{kind}{8 * size}": f"{kind[0]}{size}" for kind in ("int", "uint") for size in (1, 2, 4, 8)}

_HEAD = re.compile(
    rb"#\s*vtk\s+DataFile\s+Version\s+(\d+)\.\d+[^\r\n]*(?:\r\n?|\n)"
    rb"[^\r\n]*(?:\r\n?|\n)\s*(ASCII|BINARY)[ \t]*(?:\r\n?|\n)",
    re.IGNORECASE,
)


_LINE = re.compile(rb"\s*([^\r\n]*)(?:\r\n?|\n)?")
_BLANK_LINE = re.compile(rb"(?:\r\n|\r(?!\n)|\n)[ \t]*[\r\n]")


@dataclass(frozen=True)
class Line:
    """A line with a keyword. start: its first byte; words: what it says (latin-1, so that any byte is a character)."""

    start: int
    words: list[str]

    @property
    def key(self) -> str:
        """The keyword, which VTK reads in any case."""
        return self.words[0].upper() if self.words else ""


@dataclass(frozen=True)
class Array:
    """Numbers of a file: where they stand and of what type they are."""

    source: Words
    at: Places
    kind: str

    def values(self, finite: bool = False) -> NDArray[Any]:
        """int64 or float64; nan and inf are errors if ``finite``."""
        return self.source.values(self.at, self.kind, finite)

    def fail(self, index: int, message: str) -> NoReturn:
        """Raises FormatError with the place of one of the numbers."""
        self.source.fail(self.at[index] if len(self.at) else 0, message)


class Stream:
    """Reads on from byte ``at``."""

    data: Data
    at: int
    binary: bool

    def __init__(self, data: Data, at: int, binary: bool) -> None:
        self.data, self.at, self.binary = data, at, binary

    def fail(self, offset: int, message: str) -> NoReturn:
        """Raises FormatError with the line, in a binary file the byte, in front."""
        if self.binary:
            fail_at(offset, message)
        fail(self.data, offset, message)

    def line(self, skip_metadata: bool = True) -> Line:
        """The next line that is not empty, beyond METADATA (which ends at an empty line); no words: the end."""
        while True:
            match = _LINE.match(self.data, self.at)
            assert match is not None  # the pattern fits everywhere
            self.at = match.end()
            line = Line(match.start(1), match[1].decode("latin-1").split())
            if line.key != "METADATA" or not skip_metadata:
                return line
            end = _BLANK_LINE.search(self.data, match.end(1))
            self.at = end.end() if end else len(self.data)

    def next_is(self, keyword: bytes) -> bool:
        """Whether the next line begins with a keyword."""
        return re.compile(rb"(?i)\s*" + keyword + rb"\b").match(self.data, self.at) is not None

    def expect(self, line: Line, usage: str, optional: int = 0) -> list[str]:
        """The words behind the keyword, as many as ``usage`` names (the last ``optional`` of them may be missing)."""
        size = len(usage.split())
        if not size - optional <= len(line.words) <= size:
            shown = " ".join(line.words)[:60].encode("ascii", "replace").decode()
            self.fail(line.start, f"expected {usage!r}, found {shown!r}")
        return line.words[1:]

    def count(self, line: Line, text: str) -> int:
        """A word of a line as a count."""
        if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
            self.fail(line.start, f"a count was expected, found {text[:24].encode('ascii', 'replace').decode()!r}")
        return int(text)

    def array(self, line: Line, count: int, type_name: str) -> Array:
        """The next ``count`` numbers. Raises FormatError where the file ends before or for an unknown type."""
        kind = TYPES.get(type_name.lower())
        if kind is None:
            known = ", ".join(TYPES)
            self.fail(line.start, f"unknown type of numbers {word_of(type_name)}: known are {known}")
        if self.binary:
            source: Words = (raw := self.bytes())
            addresses = source.take(count, kind)
            self.at = raw.at
        else:
            text = Text(self.data)
            starts, self.at = text.tokens(self.at, count)
            source = TextWords(text, starts)
            addresses = source.take(count, kind)
        return Array(source, addresses, kind)

    def bytes(self) -> ByteWords:
        """The binary numbers from here on."""
        return ByteWords(self.data, ">", self.at)

    def bits(self, count: int) -> NDArray[np.uint8]:
        """Numbers of the type ``bit``: 0 and 1 in a text, eight to a byte in a binary file."""
        here = Line(self.at, [])
        if not self.binary:
            return self.array(here, count, "unsigned_char").values().astype(np.uint8)
        packed = self.array(here, (count + 7) // 8, "unsigned_char").values().astype(np.uint8)
        return np.unpackbits(packed, count=count)

    def skip_strings(self, count: int) -> None:
        """Goes past strings: one a line in a text, with a length in front (two bits tell its size) in a binary file."""
        for _ in range(count):
            if self.at >= len(self.data):
                self.fail(self.at, "expected more strings, the file ends")
            if self.binary:
                self.at += self.length_of_string()
                if self.at > len(self.data):
                    self.fail(len(self.data), "a string goes beyond the end of the file")
            else:
                end = self.data.find(b"\n", self.at)
                self.at = end + 1 if end >= 0 else len(self.data)

    def length_of_string(self) -> int:
        """Of one in a binary file that begins here, with its length in front."""
        size = 8 >> (self.data[self.at] >> 6)
        return size + (int.from_bytes(self.data[self.at : self.at + size], "big") & ((1 << (8 * size - 2)) - 1))


def word_of(text: str) -> str:
    """A word in quotes for a message: printable and short, whatever bytes it has."""
    return quoted(text.encode("latin-1", "replace"))


def field_name(text: str) -> str:
    """The name of an array, in which VTK writes blanks and the like as %20."""
    raw = unquote_to_bytes(text.encode("latin-1", "replace"))
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def opened(data: Data) -> tuple[Stream, bool]:
    """What follows the head of a file, and whether this is polygonal data, or else an unstructured grid."""
    head = _HEAD.match(data)
    if head is None:
        raise FormatError("line 1: not a legacy VTK file: it must start with '# vtk DataFile Version', a title and "
                          "ASCII or BINARY")  # fmt: skip
    stream = Stream(data, head.end(), head[2].upper() == b"BINARY")
    line = stream.line()
    if line.key != "DATASET":
        stream.fail(line.start, "expected DATASET")
    (dataset,) = stream.expect(line, "DATASET type")
    if dataset.upper() not in ("UNSTRUCTURED_GRID", "POLYDATA"):
        stream.fail(line.start, f"a DATASET of type {word_of(dataset)} is not supported: "
                                "write it as an UNSTRUCTURED_GRID")  # fmt: skip
    return stream, dataset.upper() == "POLYDATA"
