"""The table of file formats, and what a file looks like from within whatever its name says."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import import_module
from typing import cast

from gmsnet.errors import FormatError, InputError
from gmsnet.io.contents import Data
from gmsnet.io.document import Format


@dataclass(frozen=True)
class Entry:
    """A format in the table.

    key: the name that ``--format`` takes. title: what messages call it. suffixes: lower case, the first is that of the
    file with the coordinates. aliases: other suffixes of that file.
    """

    key: str
    title: str
    suffixes: tuple[str, ...]
    aliases: tuple[str, ...] = ()

    def load(self) -> Format:
        """The module that reads and writes the format, imported on first use."""
        return cast(Format, import_module(f"gmsnet.io.{self.key}"))


FORMATS = {
    entry.key: entry
    for entry in (
        Entry("su2", "SU2", (".su2",)),
        Entry("gmsh", "Gmsh", (".msh",)),
        Entry("vtk", "VTK", (".vtk",)),
        Entry("vtu", "VTU", (".vtu",)),
        Entry("medit", "Medit", (".mesh",)),
        Entry("triangle", "Triangle", (".node", ".ele")),
        Entry("stl", "STL", (".stl",)),
        Entry("obj", "OBJ", (".obj",)),
        Entry("off", "OFF", (".off",)),
        Entry("ply", "PLY", (".ply",)),
        Entry("abaqus", "Abaqus", (".inp",)),
        Entry("nastran", "Nastran", (".bdf",), (".nas", ".fem", ".dat")),
    )
}
BY_SUFFIX = {suffix: key for key, entry in FORMATS.items() for suffix in (*entry.suffixes, *entry.aliases)}

MENDS = {  # files that one may well have, but that are not read
    ".meshb": "binary Medit is not read: convert it to text (.mesh)",
    ".poly": "a .poly file is the input of Triangle: run Triangle on it and give the .node file",
    ".cgns": "CGNS is not read: convert it to .su2, .vtu or .msh",
    ".geo": "a .geo file is a geometry: mesh it with Gmsh and give the .msh file",
    ".zip": "unpack it first",
}

# What files begin with, comments (a pattern that is taken out first) and white space aside.
NONE, HASH, PERCENT, XML = rb"(?!)", rb"#[^\r\n]*", rb"%[^\r\n]*", rb"(?s)<\?.*?\?>|<!--.*?-->"
STARS, DOLLAR = rb"\*\*[^\r\n]*", rb"\$[^\r\n]*"
SIGNS = {
    "gmsh": (NONE, rb"\$(MeshFormat|Comments|NOD|Nodes|PhysicalNames)\b"),
    "vtk": (NONE, rb"#\s*vtk DataFile Version"),
    "vtu": (XML, rb"<VTKFile\b[^>]*\bUnstructuredGrid"),
    "ply": (NONE, rb"ply\s*\r?\n\s*(format|comment|obj_info)\b"),
    "stl": (NONE, rb"(?i:solid\b[^\r\n]*[\r\n]\s*(facet|endsolid)\b)"),
    "medit": (HASH, rb"MeshVersionFormatted\b"),
    "off": (HASH, rb"(ST)?C?N?4?n?OFF\b"),
    "su2": (PERCENT, rb"(NDIME|NZONE|NELEM|NPOIN|NMARK|IZONE|NCHUNK|AOA|FFD_NBOX)\s*="),
    "abaqus": (STARS, rb"\*[ \t]*[A-Za-z][A-Za-z \t]*(,|[\r\n])"),
    "nastran": (
        DOLLAR,
        rb"(?i)(NASTRAN|SOL|ID|INIT|ASSIGN)[ \t]+\w|CEND\b|BEGIN[ \t]+BULK\b"
        rb"|(GRID|CTRIA\w|CQUAD\w|CTETRA|CHEXA|CPENTA|CPYRAM?|PSHELL|PSOLID|MAT1|PARAM)[ \t,*]",
    ),
    "obj": (HASH, rb"((mtllib|o|g|usemtl|s)[ \t]+\S+[ \t]*[\r\n]\s*)*v[nt]?[ \t]+[-+.\deE]+[ \t]+[-+.\d]"),
}
# Known by sight, but not read.
STRANGERS = {
    "an MFEM mesh": rb"MFEM (NC )?mesh v",
    "a VTK file of another kind (not an UnstructuredGrid)": rb"(<\?xml[^>]*>\s*)?<VTKFile\b",
    "an HDF5 file (CGNS, XDMF or the like)": rb"\x89HDF\r\n",
    "a zip archive": rb"PK\x03\x04",
    "a binary Medit mesh": rb"\x01\0\0\0[\x01-\x04]\0\0\0\x03\0\0\0|\0\0\0\x01\0\0\0[\x01-\x04]\0\0\0\x03",
}
HEAD = 4096  # bytes that are looked at
MAY_BE_BINARY = ("gmsh", "vtk", "vtu", "stl", "ply")


def known() -> str:
    """The suffixes that are read and written, in words."""
    return ", ".join(BY_SUFFIX)


def entry_of(key: str) -> Entry:
    """The format with a name of the table. Raises InputError listing the names."""
    if not isinstance(key, str) or key.lower() not in FORMATS:
        raise InputError(f"unknown format {key!r}: known are {', '.join(FORMATS)}")
    return FORMATS[key.lower()]


def format_of_suffix(path: str, suffix: str, option: str = "--format", reading: bool = True) -> str:
    """The name of the format that goes by a suffix. Raises InputError naming the file and the known suffixes.

    option: that names the format where the suffix does not. reading: an existing file, not one to be written.
    """
    if suffix.lower() in BY_SUFFIX:
        return BY_SUFFIX[suffix.lower()]
    if reading and suffix.lower() in MENDS:
        raise InputError(f"{path}: {MENDS[suffix.lower()]}")
    what = f"the suffix {suffix!r} is unknown" if suffix else "the name has no suffix"
    raise InputError(f"{path}: {what}; known are {known()}; or name the format with {option}")


def sniff(data: Data) -> str | None:
    """The name of the format that the first bytes show, None where they do not."""
    head = data[:HEAD].removeprefix(b"\xef\xbb\xbf")
    for key, (comment, sign) in SIGNS.items():
        if re.match(sign, re.sub(comment, b"", head).lstrip()):
            return key
    if len(data) > 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return "stl"
    return None


def check_contents(data: Data, key: str) -> None:
    """Raises FormatError where a file is empty, is no mesh at all, or shows another format than ``key``."""
    if not re.search(rb"\S", data):
        raise FormatError("the file is empty")
    title = FORMATS[key].title
    shown = sniff(data)
    if shown is not None and shown != key:
        other = FORMATS[shown]
        raise FormatError(
            f"this looks like {other.title}, not {title}: rename it to {other.suffixes[0]} or pass --format {shown}"
        )
    if shown is None:
        for what, sign in STRANGERS.items():
            if re.match(sign, data[:HEAD]):
                raise FormatError(f"this is {what}, not {title}: convert it first ({known()} are read)")
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise FormatError("the text is in UTF-16; save it as plain text (ASCII or UTF-8)")
    if key not in MAY_BE_BINARY and (at := data.find(b"\0")) >= 0:
        raise FormatError(f"byte {at}: this is binary data, not {title}, or damaged: no text has a zero byte")
