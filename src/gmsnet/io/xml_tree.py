"""Small XML files as a tree: their elements, and at which bytes what they contain stands."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.text import fail

MOST_DEEP, MOST_ELEMENTS = 100, 200_000
TAG = re.compile(rb"<[^<\"'>]*(?:(?:\"[^\"]*\"|'[^']*')[^<\"'>]*)*>")
ATTRIBUTE = re.compile(rb"\s([^\s=]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")
_ENCODING = "the XML has an encoding that is not supported: write it as UTF-8"


@dataclass(eq=False)
class Element:
    """tag: without its namespace; start: its first byte; stop: the byte behind what it contains."""

    tag: str
    attributes: Mapping[str, str]
    start: int
    stop: int = 0
    children: list[Element] = field(default_factory=list)

    def of(self, tag: str) -> list[Element]:
        """The children of this name."""
        return [child for child in self.children if child.tag == tag]

    def all(self, tag: str) -> Iterator[Element]:
        """All elements of this name inside, in the order of the file."""
        for child in self.children:
            if child.tag == tag:
                yield child
            yield from child.all(tag)

    def get(self, *keys: str, default: str = "") -> str:
        """The first of these attributes that is there."""
        return next((self.attributes[key] for key in keys if key in self.attributes), default)


def parse(data: Data, root_tag: str) -> Element:
    """The root element. Raises FormatError where the XML is not well formed, or its root has another name."""
    if not re.match(rb"[\xef\xbb\xbf \t\r\n]*<", data):
        raise FormatError(f"line 1: not an XML file: such a file starts with '<{root_tag}' or '<?xml'")
    walker = _Walker(data)
    try:
        walker.parser.Parse(data[:], True)
    except expat.ExpatError as error:
        raise FormatError(f"line {error.lineno}: the XML is not well formed: {expat.ErrorString(error.code)}") from None
    except (LookupError, ValueError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(_ENCODING) from None
    root = walker.root.children[0]
    if root.tag != root_tag:
        fail(data, root.start, f"the root element is {root.tag[:24]!r} instead of {root_tag!r}")
    return root


class _Walker:
    """Follows the parser's events and notes where things stand."""

    def __init__(self, data: Data) -> None:
        self.data, self.root = data, Element("", {}, 0)
        self.open, self.count = [self.root], 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler, self.parser.EndElementHandler = self.begin, self.finish
        for declared in ("Entity", "Element", "Attlist", "Notation", "UnparsedEntity"):
            setattr(self.parser, f"{declared}DeclHandler", self.declaration)

    def declaration(self, *_: object) -> None:
        """Programs write ``<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>``, which is never loaded. What declares is refused."""
        fail(self.data, self.parser.CurrentByteIndex, "a DOCTYPE with declarations is not allowed: remove it")

    def begin(self, name: str, attributes: dict[str, str]) -> None:
        at = self.parser.CurrentByteIndex
        self.count += 1
        if len(self.open) > MOST_DEEP or self.count > MOST_ELEMENTS:
            fail(self.data, at, "there are too many elements, or they lie too deep inside one another")
        element = Element(name.rpartition(":")[2], attributes, at)
        self.open[-1].children.append(element)
        self.open.append(element)

    def finish(self, name: str) -> None:
        self.open.pop().stop = self.parser.CurrentByteIndex


def check_plain(data: Data, element: Element) -> tuple[int, int]:
    """The bytes of an element that contains a text alone. Raises FormatError where there is more than that."""
    first, stop = _tag(data, element)[1], element.stop
    if element.children or data.find(b"<", first, stop) >= 0:
        blame(data, element, "nothing but numbers may stand in it")
    return (first, stop) if first <= stop else (stop, stop)


def span_of(data: Data, element: Element, attribute: str) -> tuple[int, int]:
    """The bytes of the value of an attribute that an element has, without the quotes."""
    for found in ATTRIBUTE.finditer(data, *_tag(data, element)):
        if found[1] == attribute.encode():
            return found.span(2 if found[2] is not None else 3)
    raise FormatError(_ENCODING)


def _tag(data: Data, element: Element) -> tuple[int, int]:
    """The bytes of the start tag of an element."""
    tag = TAG.match(data, element.start)
    if tag is None:
        raise FormatError(_ENCODING)
    return tag.span()


def blame(data: Data, element: Element, message: str) -> NoReturn:
    """Raises FormatError with the line and the name of an element."""
    fail(data, element.start, f"{element.tag[:40]}: {message}")
