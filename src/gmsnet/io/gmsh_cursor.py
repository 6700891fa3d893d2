"""A Gmsh file as its sections: how it begins, and where the next one does."""

from __future__ import annotations

import re
from typing import NoReturn

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.text import Text, fail, quoted
from gmsnet.io.words import ByteWords, TextWords, Words, fail_at

_REMARKS = rb"\s*(?:\$Comments\b.*?\$EndComments\s*)*"
_HEAD = re.compile(_REMARKS + rb"\$MeshFormat\s+(\S+)[ \t]+(\S+)[ \t]+(\S+)[ \t]*(?:\r\n?|\n)", re.DOTALL)
SECOND = ("2.2", "2", "2.0", "2.1")  # alike in what is read of them
BEGIN = 4096  # bytes, in which a file begins


def opened(data: Data) -> tuple[Cursor, bool]:
    """The file behind its first section, and whether its version is 2.2, or one before that is alike."""
    head = _HEAD.match(data)
    if head is None and not data[:BEGIN].lstrip().startswith(b"$NOD"):
        raise FormatError("line 1: not a Gmsh file: it must start with $MeshFormat, the version, 0 or 1, and 8")
    version = head[1].decode("latin-1") if head else "1"
    if head is None or version not in (*SECOND, "4.1"):
        mend = "convert it with 'gmsh OLD.msh -save -format msh41 -o NEW.msh'"
        raise FormatError(f"Gmsh's format {version[:24]!r} is not supported, 2.2 and 4.1 are: {mend}")
    if head[2] not in (b"0", b"1") or head[3] != b"8":
        raise FormatError("$MeshFormat must say 0 (text) or 1 (binary) and the size 8 of its numbers")
    at, order = head.end(), ""
    if head[2] == b"1":
        one, at = data[at : at + 4], at + 4
        order = {b"\1\0\0\0": "<", b"\0\0\0\1": ">"}.get(one, "")
        if not order:
            raise FormatError(f"byte {at - 4}: the number 1 must follow, which tells the byte order")
    source = Cursor(data, at, order)
    here = source.at
    if source.word() != b"$EndMeshFormat":
        source.fail(here, "expected $EndMeshFormat")
    return source, version in SECOND


class Cursor:
    """A Gmsh file. at: the byte that reading goes on from; order: of a binary file, empty for a text."""

    data: Data
    at: int
    order: str

    def __init__(self, data: Data, at: int, order: str) -> None:
        self.data, self.at, self.order = data, at, order

    def fail(self, offset: int, message: str) -> NoReturn:
        """Raises FormatError with the line, in a binary file the byte, in front."""
        if self.order:
            fail_at(offset, message)
        fail(self.data, offset, message)

    def word(self) -> bytes:
        """The next word, and behind it the one line end that binary data follow. Nothing: the end of the file."""
        match = re.compile(rb"\s*(\S*)(?:[ \t]*(?:\r\n?|\n))?").match(self.data, self.at)
        assert match is not None  # the pattern fits everywhere
        self.at = match.end()
        return match[1]

    def count(self) -> int:
        """The next word as a count."""
        here, text = self.at, self.word()
        if not re.fullmatch(rb"\d{1,18}", text):
            self.fail(here, f"a count was expected, found {quoted(text)}")
        return int(text)

    def skip_section(self, title: bytes) -> None:
        """Goes behind the end of a section that is not read."""
        found = self.data.find(b"$End" + title, self.at)
        if found < 0:
            self.fail(self.at, f"$End{show(title)} is missing: the file is cut off")
        self.at = found + len(title) + 4

    def words(self, title: bytes, as_text: bool = False) -> Words:
        """The numbers of the section that begins here. as_text: it is a text in binary files, too."""
        if self.order and not as_text:
            return ByteWords(self.data, self.order, self.at)
        stop = self.data.find(b"$End" + title, self.at)
        if stop < 0:
            self.fail(len(self.data), f"$End{show(title)} is missing: the file is cut off")
        text = Text(self.data, stop=stop)
        starts, _ = text.tokens(self.at)
        self.at = stop
        return TextWords(text, starts)

    def close(self, title: bytes, words: Words) -> None:
        """The section must end where its counts say."""
        if isinstance(words, ByteWords):
            self.at = words.at
        elif words.at < words.end:
            words.fail(words.at, f"${show(title)} goes on where its counts say that it ends")
        here = self.at
        if self.word() != b"$End" + title:
            self.fail(here, f"${show(title)} does not end where its counts say")


def show(title: bytes) -> str:
    """The name of a section for a message, whatever bytes it has."""
    return quoted(title)[1:-1]
