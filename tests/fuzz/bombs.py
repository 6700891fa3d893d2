"""Small files that ask for much memory or time: counts that lie, zeros well packed, long, deep and many things.

``python -m fuzz.bombs`` reads them all with 200 MB to spare and prints what became of each, with seconds and megabytes.
"""

from __future__ import annotations

import base64
import json
import os
import re
import resource
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import gmsnet
from fuzz.corpus import stored
from fuzz.promises import MEMORY, NEXT, PAIR, parts, path_of, save
from gmsnet.errors import InputError

MANY = 1_000_000
_HOMES = [str(Path(gmsnet.__file__).parents[1]), str(Path(__file__).parents[1])]  # of what the process imports
READS = "reads"  # what becomes of a large file that is a mesh all the same

VTK = "# vtk DataFile Version 3.0\nt\n{}\nDATASET POLYDATA\n"
SQUARE = "POINTS 4 double\n0 0 0 1 0 0 1 1 0 0 1 0\n"
PLY = "ply\nformat {} 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
PLY_FACE = "element face 1\nproperty list int int vertex_indices\nend_header\n"
POINTS = (
    '<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0</DataArray>'
    "</Points>"
)
CELLS = (
    '<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2</DataArray>'
    '<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray>'
    '<DataArray type="UInt8" Name="types" format="ascii">5</DataArray></Cells>'
)


def bombs() -> Iterator[tuple[str, str, bytes, str]]:
    """(key of the format, what it is, the file, a pattern of its refusal or READS)."""
    yield from _large_cells()
    yield from _texts()
    yield from _vtu()
    yield from _abaqus()
    yield from _nastran()
    yield from _ugrid()
    yield from _openfoam()


def _large_cells() -> Iterator[tuple[str, str, bytes, str]]:
    corners = b"0 1 2 3 " * (MANY // 4)
    yield (
        "vtk",
        "one polygon",
        (VTK.format("ASCII") + SQUARE + f"POLYGONS 1 {MANY + 1}\n{MANY} ").encode() + corners,
        READS,
    )
    two = (VTK.format("ASCII") + SQUARE + f"POLYGONS 2 {MANY + 5}\n3 0 1 2 {MANY} ").encode() + corners
    yield "vtk", "a triangle and a polygon", two, READS
    binary = (VTK.format("BINARY") + "POINTS 4 float\n").encode() + bytes(48) + f"\nPOLYGONS 1 {MANY + 1}\n".encode()
    yield "vtk", "one polygon, binary", binary + struct.pack(">i", MANY) + bytes(4 * MANY), READS
    head = (PLY.format("ascii") + PLY_FACE).encode() + b"0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
    yield "ply", "one polygon", head + b"%d " % MANY + corners, READS
    head = (PLY.format("binary_little_endian") + PLY_FACE).encode() + bytes(96)
    yield "ply", "one polygon, binary", head + struct.pack("<i", MANY) + bytes(4 * MANY), READS
    yield "off", "one polygon", b"OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n%d " % MANY + corners, READS
    yield "obj", "one polygon", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf " + b"1 2 3 1 " * (MANY // 4), READS
    yield "obj", "one polyline", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nl " + b"1 2 3 1 " * (MANY // 4), READS


def _texts() -> Iterator[tuple[str, str, bytes, str]]:
    mesh = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"
    yield "obj", "backslashes", mesh + b"o " + b"\\" * 2 * MANY + b"\n", "a line that goes on"
    yield "obj", "backslashes in a comment", mesh + b"o " + b"x" * MANY + b" # " + b"\\ " * MANY, READS
    yield "off", "digits", b"OFF 3 1 0\n0 0 0\n1 0 0\n0." + b"1" * 2 * MANY + b" 0 0\n3 0 1 2\n", READS
    facet = b"facet normal 0 0 0 outer loop vertex %s 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n"
    zeros = b"1." + b"0" * MANY
    yield "stl", "digits", b"solid\n" + facet % (zeros + b"1") + facet % (zeros + b"01") + b"endsolid\n", READS
    yield "stl", "words like solid", b"solid\n" + b"sols " * MANY, "'endsolid' is missing"
    yield "stl", "a count", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50), "it would have 214748364834"
    yield "su2", "line ends", b"\r" * 20 * MANY + b"x", f"line {20 * MANY + 1}: a keyword such as NDIME= was expected"
    yield "su2", "keywords", b"A=\n" * MANY, "more than 100000 keywords"
    row = b"%d 0 0 " + b"0 " * 300_000 + b"\n"
    many = b"3 2 300000 0\n" + b"".join(row % k for k in range(3))
    yield "triangle", "attributes", many + PAIR + b"1 3 0\n1 0 1 2\n", "more than 1000 are not read"
    names = "".join(f"property int a{k}\n" for k in range(100_000))
    yield "ply", "properties", (PLY.format("ascii") + names + PLY_FACE).encode(), "expected 4 rows"
    names = "".join(f"element a{k} 0\n" for k in range(100_000))
    yield (
        "ply",
        "elements",
        ("ply\nformat ascii 1.0\n" + names + PLY_FACE).encode(),
        "the header has no element 'vertex'",
    )
    bits = (VTK.format("BINARY") + f"FIELD a 1\nb 1 {40 * MANY} bit\n").encode() + bytes(5 * MANY)
    yield "vtk", "bits", bits, "POINTS missing"
    yield "vtk", "metadata", VTK.format("ASCII").encode() + b"METADATA\n\n" * 200_000, "POINTS missing"
    sections = b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + b"$A\n$EndA\n" * 200_000
    yield "gmsh", "sections", sections, r"\$Nodes and \$Elements missing"


def _abaqus() -> Iterator[tuple[str, str, bytes, str]]:
    deck = b"*NODE\n" + b"".join(b"%d,%d,0\n" % (k, k) for k in range(1, 20_001)) + b"*ELEMENT,TYPE=S3\n1,1,2,3\n"
    yield "abaqus", "keywords", b"*A\n" * MANY, "more than 100000 keywords"
    yield "abaqus", "a keyword line that goes on", b"*A,\n" + b",\n" * MANY, "more than 4096 characters"
    yield "abaqus", "asterisks", b"*HEADING\n" + b" *" * MANY + b"\n" + deck, READS
    yield "abaqus", "ranges of all", deck + b"*NSET,NSET=a,GENERATE\n" + b"1,1000000000000\n" * 100_000, READS
    steps = b"*NSET,NSET=a,GENERATE\n" + b"1,20000,3\n" * 100_000
    yield "abaqus", "ranges with steps", deck + steps, "name the same numbers again and again"
    sets = b"*NSET,NSET=s0,GENERATE\n1,20000\n" + b"".join(
        b"*NSET,NSET=s%d\ns%d,s%d\n" % (k, k - 1, k - 1) for k in range(1, 40)
    )
    yield "abaqus", "sets of sets", deck + sets, READS
    yield "abaqus", "an element of many nodes", deck + b"*ELEMENT,TYPE=U1\n2," + b"1," * MANY + b"1\n", READS


def _nastran() -> Iterator[tuple[str, str, bytes, str]]:
    grids = b"".join(b"GRID,%d,,%d.,0.,0.\n" % (k, k) for k in range(1, 20_001))
    deck = grids + b"CTRIA3,1,1,1,2,3\n"
    yield (
        "nastran",
        "cards of many names",
        deck + b"".join(b"X%d,1\n" % k for k in range(100_000)),
        "more than 10000 names",
    )
    yield (
        "nastran",
        "a card of many lines",
        deck + b"RBE2,1,1,123\n" + b"+,1,2,3\n" * (MANY // 5),
        "goes on in more than 10000",
    )
    yield "nastran", "ranges of all", deck + b"SPC1,1,1,1,THRU,20000\n" * 100_000, "more than 1000 SPC1 with THRU"
    yield "nastran", "a long field", deck + b"CTRIA3,2,1,1,2," + b"3" * MANY + b"\n", "a field has 1000000 characters"
    yield "nastran", "commas", deck + b"CTRIA3,2,1,1,2,3" + b"," * 5 * MANY + b"\n", READS
    yield "nastran", "blanks", b" " * 5 * MANY + b"\n" + deck, READS


def _ugrid() -> Iterator[tuple[str, str, bytes, str]]:
    counts = struct.pack(">7i", *[2**31 - 1] * 7)
    yield "ugrid", "counts", counts + bytes(MANY), "its counts ask for"
    yield "ugrid", "counts of a text", b"999999999999 1 1 1 1 1 1 " + b"0 " * MANY, "expected 2999999999997 numbers"
    yield (
        "ugrid",
        "bytes behind the volumes",
        struct.pack(">7i", 3, 1, 0, 0, 0, 0, 0) + bytes(72) + struct.pack(">4i", 1, 2, 3, 0) + bytes(5 * MANY),
        READS,
    )


def _openfoam() -> Iterator[tuple[str, str, bytes, str]]:
    head = b"FoamFile{format ascii;}\n"
    two = (head + b"3((0 0 0)(1 0 0)(0 1 0))", head + b"2(3(0 1 2)3(0 2 1))", head + b"2(0 0)", head + b"0()")
    walls = head + b"1(a{type wall;nFaces 2;startFace 0;})"
    yield (
        "openfoam",
        "a list of one value",
        NEXT.join((*two[:2], head + b"1000000000000{0}", two[3], walls)),
        "more than the",
    )
    yield (
        "openfoam",
        "patches",
        NEXT.join((*two, head + b"200000(" + b"a{nFaces 0;startFace 0;}" * 200_000 + b")")),
        "200000",
    )
    many = head + b"1(a{" + b"{" * MANY + b"})"
    yield "openfoam", "depth", NEXT.join((*two, many)), "has no startFace"
    yield "openfoam", "remarks", NEXT.join((head + b"/*" * MANY, *two[1:], walls)), "a list such as"
    yield (
        "openfoam",
        "brackets",
        NEXT.join((two[0], head + b"1(" + b")" * 5 * MANY, *two[2:], walls)),
        "announces 1 faces",
    )
    yield "openfoam", "remarks behind faces", NEXT.join((two[0], two[1] + b"\n//)" * MANY, *two[2:], walls)), ""
    zone = b"a{type cellZone;cellLabels List<label> 0();}"
    yield "openfoam", "zones", NEXT.join((*two, walls, head + zone * 200_000)), "more than 100000 zones"


def _vtu() -> Iterator[tuple[str, str, bytes, str]]:
    yield "vtu", "depth", _grid(POINTS + CELLS + "<a>" * MANY + "</a>" * MANY), "more than 100 deep"
    yield "vtu", "a long tag", _grid(POINTS + CELLS + "<a" + " " * 5 * MANY + "/>"), READS
    yield "vtu", "attributes", _grid(POINTS + CELLS + "<a" + "".join(f" a{k}=''" for k in range(200_000)) + "/>"), READS
    yield "vtu", "a long attribute", _grid(POINTS + CELLS + "<a b='" + "x" * 5 * MANY + "'/>"), READS
    yield "vtu", "arrays", _grid(POINTS + CELLS + "<DataArray/>" * MANY), "more than 100000 arrays"
    fields = "".join(f'<DataArray type="Int8" Name="{k}">0 0 0 0</DataArray>' for k in range(5000))
    yield "vtu", "comments", _grid(POINTS + "<!---->" * 100_000 + CELLS + f"<PointData>{fields}</PointData>"), READS
    laughs = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    doctype = f'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY l0 "lol">{laughs}]>'
    yield "vtu", "entities", doctype.encode() + _grid(POINTS + CELLS + "<a>&l9;</a>"), "a DOCTYPE is not allowed"
    outside = '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///dev/zero">]>'
    yield "vtu", "a file as entity", outside.encode() + _grid(POINTS + "&x;" + CELLS), "a DOCTYPE is not allowed"
    array = '<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="{}"{}>{}</DataArray>'
    points = "<Points>" + array.format("Float64", "Points", 3, "binary", "", _zeros(480 * MANY)) + "</Points>"
    yield (
        "vtu",
        "zeros as points",
        _grid(points + CELLS, 20 * MANY, zipped=True),
        "60000000 numbers are too many",
    )
    types, none = _zeros(20 * MANY), array.format("Int8", "connectivity", 1, "ascii", "", "")
    cells = none + "".join(array.format("UInt8", name, 1, "binary", "", types) for name in ("offsets", "types"))
    cells = _grid(POINTS + f"<Cells>{cells}</Cells>", 4, 20 * MANY, zipped=True)
    yield "vtu", "zeros as cells", cells, "20000000 numbers are too many"
    points = "<Points>" + array.format("Float64", "Points", 3, "binary", "", _zeros(480 * MANY, 96)) + "</Points>"
    yield "vtu", "a block longer than it says", _grid(points + CELLS, zipped=True), "does not decompress to the 96"
    fields = "".join(array.format("Int8", k, 1, "appended", ' offset="0"', "") for k in range(1000))
    points = "<Points>" + array.format("Float64", "Points", 3, "ascii", "", "0 " * 3 * MANY) + "</Points>"
    grid = _grid(f"<PointData>{fields}</PointData>{points}{CELLS}", MANY)
    block = b'<AppendedData encoding="raw">_' + struct.pack("<I", MANY) + bytes(MANY) + b"</AppendedData></VTKFile>"
    yield "vtu", "one block for many arrays", grid.replace(b"</VTKFile>", block), "shares its bytes with other arrays"


def _grid(inside: str, points: int = 4, cells: int = 1, zipped: bool = False) -> bytes:
    packer = ' compressor="vtkZLibDataCompressor"' if zipped else ""
    return (
        f'<VTKFile type="UnstructuredGrid"{packer}><UnstructuredGrid><Piece NumberOfPoints="{points}" '
        f'NumberOfCells="{cells}">{inside}</Piece></UnstructuredGrid></VTKFile>'
    ).encode()


def _zeros(size: int, told: int | None = None) -> str:
    """So many zeros, packed in one block, of which the header tells the length, or another one."""
    packer = zlib.compressobj(9)
    packed = b"".join(packer.compress(bytes(MANY)) for _ in range(size // MANY)) + packer.flush()
    header = struct.pack("<4I", 1, told or size, 0, len(packed))
    return (base64.b64encode(header) + base64.b64encode(packed)).decode()


def huge_counts(key: str) -> Iterator[bytes]:
    """The files of the corpus with 10¹² in the place of a short number of text, the first of them in turn."""
    for data in stored(key):
        for match in list(re.finditer(rb"(?<![\w.+-])\d{1,3}(?![\w.])", data))[:20]:
            yield data[: match.start()] + b"1000000000000" + data[match.end() :]


def with_little_memory(files: Sequence[tuple[str, bytes]]) -> list[tuple[str, float, float]]:
    """(message or READS, seconds of the processor, MB) of each (key of the format, file), read in a process of its own
    that may have MEMORY bytes, and the length of the file, more than it has for small ones.
    """
    with tempfile.TemporaryDirectory() as folder:
        for k, (key, data) in enumerate(files):
            save(key, parts(key, data), _stem(Path(folder), k))
        run = subprocess.run(
            [sys.executable, "-m", "fuzz.bombs", folder, *(key for key, _ in files)],
            stdout=subprocess.PIPE, timeout=600, check=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(_HOMES)},
        )  # fmt: skip
    return [tuple(row) for row in json.loads(run.stdout)]


def _stem(folder: Path, number: int) -> Path:
    return folder / f"{number}" / "mesh"


def _read_all(folder: Path, keys: list[str]) -> None:
    """The process of ``with_little_memory``."""
    for key in sorted(set(keys)):  # loads all that there is to load
        for data in stored(key):
            with suppress(InputError):
                gmsnet.read(save(key, parts(key, data), _stem(folder, len(keys))), key)
    rows = []
    for k, key in enumerate(keys):
        path = path_of(key, _stem(folder, k))
        have = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        room = have + MEMORY + sum(each.stat().st_size for each in _stem(folder, k).parent.rglob("*") if each.is_file())
        resource.setrlimit(resource.RLIMIT_AS, (room, resource.getrlimit(resource.RLIMIT_AS)[1]))
        before, start = _peak(), time.process_time()
        try:
            gmsnet.read(path, key)
            said = READS
        except InputError as error:
            said = str(error).removeprefix(f"{path}: ")
        rows.append((said, time.process_time() - start, (_peak() - before) / 1e6))
    print(json.dumps(rows))


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main() -> None:
    """The table of all bombs."""
    for key, what, data, _ in bombs():
        ((said, seconds, megabytes),) = with_little_memory([(key, data)])
        print(
            f"{key:8} {what:36} {len(data) / 1e6:5.2f} MB: {seconds:5.2f} s {megabytes:4.0f} MB  {said[:110]}",
            flush=True,
        )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _read_all(Path(sys.argv[1]), sys.argv[2:])
    else:
        main()
