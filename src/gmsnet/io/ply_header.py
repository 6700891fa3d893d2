"""The header of a PLY file: which elements follow, with which properties of which types, in text or binary."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.text import fail

TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"}
TYPES |= {"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
TYPES |= {"float32": "f4", "float64": "f8"}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

_FIRST = re.compile(rb"ply[ \t]*(\r\n|\r|\n)")


@dataclass(frozen=True)
class Property:
    """A number, or with ``length`` a list with its length, of that type, in front."""

    name: str
    kind: str
    length: str | None = None


@dataclass(frozen=True)
class Element:
    """``count`` rows of these properties. at: the byte of its line in the header."""

    name: str
    count: int
    at: int
    properties: list[Property] = field(default_factory=list)

    @property
    def called(self) -> str:
        """Its name for a message."""
        return repr(self.name[:24])


@dataclass(frozen=True)
class Header:
    """order: ``<`` or ``>`` of a binary file, empty for a text. end: the byte behind the header."""

    order: str
    elements: list[Element]
    end: int


def parse(data: Data) -> Header:
    """The header of the file. Raises FormatError naming the line that is not one of a PLY header."""
    first = _FIRST.match(data)
    if first is None:
        raise FormatError("line 1: not a PLY file: it must start with a line 'ply'")
    at, order, elements, known = first.end(), None, list[Element](), set[tuple[str, ...]]()
    while True:
        stop = data.find(first[1], at)
        if stop < 0:
            fail(data, len(data), "the header has no 'end_header': the file is cut off")
        words = data[at:stop].decode("latin-1").split()
        match words:
            case ["end_header"]:
                break
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, "1.0"] if name in ORDERS and order is None:
                order = ORDERS[name]
            case ["element", name, count] if re.fullmatch(r"\d{1,18}", count, re.ASCII):
                _add(data, at, known, "element", name)
                elements.append(Element(name, int(count), at))
            case ["property", kind, name] if kind in TYPES and elements:
                _add(data, at, known, "property", name, elements[-1].name)
                elements[-1].properties.append(Property(name, TYPES[kind]))
            case ["property", "list", length, kind, name] if (
                kind in TYPES and elements and TYPES.get(length, "f")[0] != "f"
            ):
                _add(data, at, known, "property", name, elements[-1].name)
                elements[-1].properties.append(Property(name, TYPES[kind], TYPES[length]))
            case _:
                shown = " ".join(words)[:60].encode("ascii", "replace").decode()
                fail(data, at, f"not a line of a PLY header, or of a type that is not supported: {shown!r}")
        at = stop + len(first[1])
    if order is None:
        fail(data, at, "the header has no 'format'")
    for element in elements:
        if element.count and not element.properties:
            fail(data, element.at, f"the element {element.called} has no properties")
    return Header(order, elements, stop + len(first[1]))


def _add(data: Data, at: int, known: set[tuple[str, ...]], what: str, name: str, of: str = "") -> None:
    """Notes that an element, or a property of one, has been given."""
    if (what, name, of) in known:
        fail(data, at, f"the {what} {name[:24]!r} is given twice")
    known.add((what, name, of))
