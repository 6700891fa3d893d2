"""The table of file formats, and what a file looks like from within whatever its name says."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from importlib import import_module
from typing import cast

from gmsnet.errors import FormatError, InputError
from gmsnet.io import foreign
from gmsnet.io.contents import Data
from gmsnet.io.document import Format, Written
from gmsnet.io.hdf5 import MAGIC
from gmsnet.io.packed import split_name
from gmsnet.mesh.mesh import Mesh


@dataclass(frozen=True)
class Entry:
    """A format in the table.

    key: the name that ``--format`` takes. title: what messages call it. suffixes: lower case, the first is that of the
    file with the coordinates. aliases: other suffixes of that file. forms: of which one stands before the suffix of
    its files (``b8`` of a.b8.ugrid); without it a file has the form "". folder: the mesh is a folder, and the suffixes
    are the names of its files; those of ``optional`` may be there. own: files of this format are only written again,
    and no other mesh is converted to it. linked: the file may name others, which hold the numbers: the module that
    knows them (``io/linked.py``). within: the module that has the format beside others; by default it is one by itself.
    parts: the mesh stands in several files that no file lists (``io/split_files.py``), of this format each.
    """

    key: str
    title: str
    suffixes: tuple[str, ...]
    aliases: tuple[str, ...] = ()
    forms: tuple[str, ...] = ()
    folder: bool = False
    optional: tuple[str, ...] = ()
    own: bool = False
    linked: str = ""
    within: str = ""
    parts: str = ""

    def form_of(self, path: str) -> str:
        """The form that the name of a file says."""
        stem, _, _ = split_name(path)
        form = os.path.splitext(stem)[1][1:].lower()
        return form if form in self.forms else ""

    def load(self) -> Format:
        """The module that reads and writes the format, imported on first use."""
        module = import_module(f"gmsnet.io.{self.within or self.key}")
        return cast(Format, getattr(module, self.key) if self.within else module)

    def write(self, mesh: Mesh, form: str) -> Written:
        """The mesh in one of the forms. Raises FormatError where it cannot hold the cells at all."""
        module = self.load()
        if self.own and self.key in foreign.WRITTEN:
            return foreign.written(mesh, self.key, self.title, self.suffixes[0], module)
        return module.write_as(mesh, form) if form else module.write(mesh)  # type: ignore[attr-defined]


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
        Entry(
            "openfoam",
            "OpenFOAM",
            ("points", "faces", "owner", "neighbour", "boundary"),
            folder=True,
            own=True,
            optional=("cellZones", "faceZones", "pointZones"),
        ),
        Entry(
            "ugrid",
            "UGRID",
            (".ugrid",),
            (),
            tuple(f"{little}{how}{real}" for real in (8, 4) for how in "br" for little in ("", "l")),
        ),
        Entry("xdmf", "XDMF", (".xdmf",), (".xmf",), own=True, linked="xdmf_links"),
        Entry("exodus", "Exodus II", (".e",), (".exo", ".ex2", ".exii", ".g", ".gen"), own=True),
        Entry("cgns", "CGNS", (".cgns",), own=True),
        Entry("med", "MED", (".med",), own=True),
        Entry("vtkhdf", "VTKHDF", (".vtkhdf",), (".hdf",), own=True),
        Entry("vtp", "VTP", (".vtp",), own=True),
        *(
            Entry(key, key.upper(), (f".{key}",), own=True, linked="vtk_links", within="vtk_pieces")
            for key in ("pvtu", "pvtp", "vtm")
        ),
        Entry("split", "Gmsh (split)", ("_1.msh",), own=True, within="split_parts", parts="gmsh"),
        Entry(
            "decomposed",
            "OpenFOAM (decomposed)",
            ("processor0/constant/polyMesh/points",),
            own=True,
            within="split_parts",
            parts="openfoam",
        ),
        Entry("netgen", "Netgen", (".vol",), own=True),
        Entry("mfem", "MFEM", (".mesh",), own=True),
        Entry("fluent", "Fluent", (".msh",), (".cas",), own=True),
    )
}
BY_SUFFIX: dict[str, str] = {}  # the first format of each; the contents tell it from others of that suffix
for _key, _entry in FORMATS.items():
    for _suffix in () if _entry.folder or _entry.parts else (*_entry.suffixes, *_entry.aliases):
        BY_SUFFIX.setdefault(_suffix, _key)

MENDS = {  # files that one may well have, but that are not read
    ".poly": "a .poly file is the input of Triangle: run Triangle on it and give the .node file",
    ".geo": "a .geo file is a geometry: mesh it with Gmsh and give the .msh file",
    ".zip": "unpack it first",
}

# What files begin with, comments (a pattern that is taken out first) and white space aside.
NONE, HASH, PERCENT, XML = rb"(?!)", rb"#[^\r\n]*", rb"%[^\r\n]*", rb"(?s)<\?.*?\?>|<!--.*?-->"
SLASHES = rb"(?s)/\*.*?\*/|//[^\r\n]*"
STARS, DOLLAR = rb"\*\*[^\r\n]*", rb"\$[^\r\n]*"
SIGNS = {
    "gmsh": (NONE, rb"\$(MeshFormat|Comments|NOD|Nodes|PhysicalNames)\b"),
    "vtk": (NONE, rb"#\s*vtk DataFile Version"),
    "vtu": (XML, rb"<VTKFile\b[^>]*\bUnstructuredGrid"),
    "vtp": (XML, rb"<VTKFile\b[^>]*[\"']PolyData"),
    "pvtu": (XML, rb"<VTKFile\b[^>]*[\"']PUnstructuredGrid"),
    "pvtp": (XML, rb"<VTKFile\b[^>]*[\"']PPolyData"),
    "vtm": (XML, rb"<VTKFile\b[^>]*[\"']vtkMultiBlockDataSet"),
    "xdmf": (rb"(?s)<\?.*?\?>|<!.*?>", rb"<Xdmf\b"),
    "exodus": (NONE, rb"CDF[\x01\x02\x05]"),
    "netgen": (HASH, rb"mesh3d\b"),
    "mfem": (HASH, rb"MFEM mesh v1\.[0-3]\b"),
    "fluent": (NONE, rb"\(\s*(0\s*\"|1\s*\"|2\s+[23]\s*\))"),
    "ply": (NONE, rb"ply\s*\r?\n\s*(format|comment|obj_info)\b"),
    "stl": (NONE, rb"(?i:solid\b[^\r\n]*[\r\n]\s*(facet|endsolid)\b)"),
    "medit": (HASH, rb"MeshVersionFormatted\b"),
    "off": (HASH, rb"(ST)?C?N?4?n?OFF\b"),
    "su2": (PERCENT, rb"(NDIME|NZONE|NELEM|NPOIN|NMARK|IZONE|NCHUNK|AOA|FFD_NBOX)\s*="),
    "abaqus": (STARS, rb"\*[ \t]*[A-Za-z][A-Za-z \t]*(,|[\r\n])"),
    "openfoam": (SLASHES, rb"FoamFile\s*\{"),
    "nastran": (
        DOLLAR,
        rb"(?i)(NASTRAN|SOL|ID|INIT|ASSIGN)[ \t]+\w|CEND\b|BEGIN[ \t]+BULK\b"
        rb"|(GRID|CTRIA\w|CQUAD\w|CTETRA|CHEXA|CPENTA|CPYRAM?|PSHELL|PSOLID|MAT1|PARAM)[ \t,*]",
    ),
    "obj": (HASH, rb"((mtllib|o|g|usemtl|s)[ \t]+\S+[ \t]*[\r\n]\s*)*v[nt]?[ \t]+[-+.\deE]+[ \t]+[-+.\d]"),
}
# Known by sight, but not read.
STRANGERS = {
    "an MFEM mesh of another kind (not v1.0)": rb"MFEM [\w -]*mesh v",
    "a VTK file of another kind (not an UnstructuredGrid or PolyData)": rb"(<\?xml[^>]*>\s*)?<VTKFile\b",
    "an HDF5 file": rb"\x89HDF\r\n",
    "a CGNS file of the old kind (ADF, which adf2hdf converts)": rb"@\(#\)ADF Database",
    "a zip archive": rb"PK\x03\x04",
    "a binary Medit mesh": rb"\x01\0\0\0[\x01-\x04]\0\0\0\x03\0\0\0|\0\0\0\x01\0\0\0[\x01-\x04]\0\0\0\x03",
}
IN_HDF5 = ("exodus", "cgns", "med", "vtkhdf")
HEAD = 4096  # bytes that are looked at
MAY_BE_BINARY = (
    "gmsh", "vtk", "vtu", "vtp", "stl", "ply", "ugrid", "openfoam", "exodus", "cgns", "med", "vtkhdf", "fluent"
)  # fmt: skip


def known() -> str:
    """The suffixes that are read and written, in words."""
    return f"{', '.join(BY_SUFFIX)}, and folders of OpenFOAM cases"


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


def entry_in(data: Data, key: str, suffix: str) -> Entry:
    """The format of a file whose suffix several have: the one that the contents show, else that of ``key``."""
    shown = sniff(data)
    if shown is not None and suffix.lower() in (*FORMATS[shown].suffixes, *FORMATS[shown].aliases):
        return FORMATS[shown]
    return FORMATS[key]


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
    if shown is None and not (key in IN_HDF5 and data[:8] == MAGIC):
        for what, sign in STRANGERS.items():
            if re.match(sign, data[:HEAD]):
                raise FormatError(f"this is {what}, not {title}: convert it first ({known()} are read)")
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise FormatError("the text is in UTF-16; save it as plain text (ASCII or UTF-8)")
    if key not in MAY_BE_BINARY and (at := data.find(b"\0")) >= 0:
        raise FormatError(f"byte {at}: this is binary data, not {title}, or damaged: no text has a zero byte")
