"""Small meshes written by hand in each format and variant, with one fact more or less, for docs/formats.py.

A sample is made of the decimals of its points, so that it can be made again with other points: what gmsnet writes must
be that file, byte for byte.
"""

from __future__ import annotations

import base64
import lzma
import struct
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import lz4.block

from gmsnet.io.nastran_numbers import fitted

PACKERS: dict[str, Callable[[bytes], bytes]] = {
    "zlib": zlib.compress, "LZMA": partial(lzma.compress, check=lzma.CHECK_CRC32, preset=5),
    "LZ4": partial(lz4.block.compress, store_size=False),
}  # fmt: skip
Row = Sequence[str]  # the decimals of a point
Files = dict[str, bytes]  # suffix → bytes

# Two squares side by side with a free node in each, further on a quadrilateral; as decimals, some spelled oddly.
POINTS = ("0 -0.0", "1e0 0", "+1.0 1.00", "0 1.25", ".3 .6", "2 0", "2. 1.1", "1.7 0.4")
OTHERS = {"tetrahedra": ("10 -0.0 0", "11. 0 0", "10 1e0 0", "10 0 +1", "10.2 .2 .3"),
          "hexahedra": ("13 0 0", "14 0 0", "14 1 0", "13 1 0", "13 0 1", "14 0 1", "14 1 1", "13 1 1"),
          "quads": ("3.5 0", "4.5 0", "4.5 1", "3.5 1"), "curved": ("5 0", "6 0", "5 1", "5.5 0", "5.5 .5", "5 .5"),
          "unused node": ("9 9",)}  # fmt: skip
TRIANGLES = ((0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (1, 5, 7), (5, 6, 7), (6, 2, 7), (2, 1, 7))
LINES = ((0, 1), (1, 5), (3, 2), (2, 6))
VERTICES = ((0,), (5,))
TETRAHEDRA = ((0, 1, 2, 4), (0, 3, 1, 4), (1, 3, 2, 4), (0, 2, 3, 4))
VOLUMES = ("tetra", "hexahedron")


@dataclass(frozen=True)
class Cell:
    """A cell: its type, nodes, region (or marker) and number in the file."""

    kind: str
    nodes: tuple[int, ...]
    region: int
    number: int


class Sample:
    """What is to be written, and the bytes so far. order: of bytes, ``<`` or ``>``; a text where it is empty."""

    def __init__(self, facts: Iterable[str], points: Sequence[Row], order: str = "", single: bool = False) -> None:
        self.facts, self.points, self.order, self.real = set(facts), points, order, "f" if single else "d"
        self.bytes = bytearray()
        self.tags = [3 * (len(points) - k) if self.has("node numbers") else k + 1 for k in range(len(points))]
        self.cells = [Cell(*cell, 10 + 5 * k if self.has("cell numbers") else k + 1) for k, cell in
                      enumerate(self._cells())]  # fmt: skip

    def has(self, fact: str) -> bool:
        return fact in self.facts

    def _cells(self) -> list[tuple[str, tuple[int, ...], int]]:
        regions = (3, 7) if self.has("regions") else (1, 1)
        found = [("triangle", nodes, regions[k // 4]) for k, nodes in enumerate(TRIANGLES)]
        at = len(POINTS)
        if self.has("tetrahedra"):
            found += [("tetra", tuple(at + k for k in nodes), regions[1]) for nodes in TETRAHEDRA]
            at += 5
        if self.has("hexahedra"):
            found.append(("hexahedron", tuple(range(at, at + 8)), regions[1]))
            at += 8
        if self.has("quads"):
            found.append(("quad", tuple(range(at, at + 4)), regions[1]))
            at += 4
        if self.has("curved"):
            found.append(("triangle6", tuple(range(at, at + 6)), regions[1]))
        if self.has("cell order"):
            found.sort(key=lambda cell: sum(k * node**2 for k, node in enumerate(cell[1])))
        markers = (5, 6) if self.has("markers") else (5, 5)
        if self.has("lines"):
            found += [("line", nodes, markers[k // 2]) for k, nodes in enumerate(LINES)]
        if self.has("vertices"):
            found += [("vertex", nodes, 8) for nodes in VERTICES]
        return found

    def names(self) -> dict[tuple[int, int], str]:
        """(dimension, region) → name."""
        dimensions = (2, 3) if self.has("tetrahedra") else (2,)
        found = {(d, k): name for d in dimensions for k, name in ((3, "steel"), (7, "dry air"))}
        found = found if self.has("names of regions") else {}
        return found | ({(1, 5): "wall", (1, 6): "outlet"} if self.has("names of markers") else {})

    def faces(self) -> list[Cell]:
        return [cell for cell in self.cells if cell.kind not in ("line", "vertex")]

    def of(self, *kinds: str) -> list[Cell]:
        return [cell for cell in self.cells if cell.kind in kinds]

    def space(self, k: int) -> list[str]:
        """The decimals of a point in space."""
        return [*self.points[k], "5.0" if self.has("other plane") else "0"][:3]

    def line(self, text: str = "", always: bool = True) -> None:
        self.bytes += (text + self.end).encode() if always else b""

    @property
    def end(self) -> str:
        return "\r\n" if self.has("line ends") else "\n"

    def row(self, *parts: tuple[str, Iterable[object]], end: str | None = None, comma: str = "") -> None:
        """Numbers with their types as ``struct`` calls them."""
        if self.order:
            for code, values in parts:
                numbers = [float(v) if code in "fd" else v for v in values]  # type: ignore[arg-type]
                self.bytes += struct.pack(f"{self.order}{len(numbers)}{code}", *numbers)
        else:
            gap = " \t " if self.has("blanks") else " "
            tokens = [str(value) for _, values in parts for value in values]
            self.bytes += (
                gap * self.has("blanks") + (comma + gap).join(tokens) + (self.end if end is None else end)
            ).encode()
            self.bytes += self.end.encode() * (self.has("blanks") and end is None)

    def close(self, text: str = "") -> None:
        """Ends binary numbers with a line end."""
        if self.order:
            self.line()
        self.line(text, bool(text))


def su2(out: Sample, dimension: int) -> Files:
    codes = {"line": 3, "vertex": 1, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12}
    out.line("% a comment", out.has("comments"))
    out.line(f"NDIME= {dimension}" + " % axes" * out.has("comments"))
    out.line("AOA= 5.0", out.has("more"))
    faces = out.of("triangle", "quad", *VOLUMES[: 2 * (dimension - 2)])
    out.line(f"NELEM= {len(faces)}")
    for cell in faces:
        out.row(("i", [codes[cell.kind], *cell.nodes, cell.number - 1]))
    out.line(f"NPOIN= {len(out.points)}")
    for k in range(len(out.points)):
        out.row(("d", out.space(k)[:dimension]), ("i", [out.tags[k]]))
    names = out.names()
    groups: dict[str, list[Cell]] = {}
    for cell in out.of("line", "vertex"):
        groups.setdefault(names.get((1, cell.region), f"m{cell.region}"), []).append(cell)
    out.line(f"NMARK= {len(groups)}")
    for name, cells in groups.items():
        out.line(f"MARKER_TAG= {name}")
        out.line(f"MARKER_ELEMS= {len(cells)}")
        for cell in cells:
            out.row(("i", [codes[cell.kind], *cell.nodes]))
    if out.has("more"):
        for text in ("FFD_NBOX= 1", "FFD_TAG= box", "0.0 0.0"):
            out.line(text)
    return {".su2": bytes(out.bytes)}


GMSH = {"line": 1, "triangle": 2, "quad": 3, "tetra": 4, "hexahedron": 5, "triangle6": 9, "vertex": 15}
DIMENSION = {"line": 1, "vertex": 0, "tetra": 3, "hexahedron": 3}


def gmsh(out: Sample, version: str) -> Files:
    """Regions are physical tags if they are a fact, and elementary entities alone otherwise."""
    out.line("$MeshFormat")
    out.line(f"{version} {int(bool(out.order))} 8")
    if out.order:
        out.row(("i", [1]))
    out.close("$EndMeshFormat")
    for text in ("$Comments", "made by hand", "$EndComments") if out.has("comments") else ():
        out.line(text)
    if names := out.names():
        out.line("$PhysicalNames")
        out.line(str(len(names)))
        for (dim, region), name in names.items():
            out.line(f'{dim} {region} "{name}"')
        out.line("$EndPhysicalNames")
    {"2.2": _gmsh_old, "4.1": _gmsh_new}[version](out)
    if out.has("more"):
        out.line("$Periodic")
        if out.order and version == "4.1":
            out.row(("Q", [0]))
        else:
            out.line("0")
        out.close("$EndPeriodic")
    if out.has("point data"):
        for text in ("$NodeData", "1", '"speed"', "1", "0.0", "3", "0", "1", str(len(out.points))):
            out.line(text)
        for k, tag in enumerate(out.tags):
            out.row(("i", [tag]), ("d", [k / 4]))
        out.close("$EndNodeData")
    return {".msh": bytes(out.bytes)}


def _physical(out: Sample, cell: Cell) -> int:
    return cell.region if out.has("regions") or cell.kind in ("line", "vertex") else 0


def _gmsh_old(out: Sample) -> None:
    out.line("$Nodes")
    out.line(str(len(out.points)))
    for k, tag in enumerate(out.tags):
        out.row(("i", [tag]), ("d", out.space(k)))
    out.close("$EndNodes")
    out.line("$Elements")
    out.line(str(len(out.cells)))
    for cell in out.cells:
        more = (_physical(out, cell), _entity(out, cell), *(out.tags[k] for k in cell.nodes))
        if out.order:
            out.row(("i", [GMSH[cell.kind], 1, 2, cell.number, *more]))
        else:
            out.row(("i", [cell.number, GMSH[cell.kind], 2, *more]))
    out.close("$EndElements")


def _entity(out: Sample, cell: Cell) -> int:
    """What the cell belongs to: its region, or entities of two or three cells each."""
    return 20 + out.cells.index(cell) // 3 if out.has("entities") else cell.region


def _gmsh_new(out: Sample) -> None:
    blocks: list[tuple[int, int, str, list[Cell]]] = []  # dimension, entity, type
    for cell in out.cells:
        head = (DIMENSION.get(cell.kind, 2), _entity(out, cell), cell.kind)
        if not blocks or blocks[-1][:3] != head:
            blocks.append((*head, []))
        blocks[-1][3].append(cell)
    entities = {(dim, tag): _physical(out, cells[0]) for dim, tag, _, cells in blocks}
    out.line("$Entities")
    out.row(("q", [sum(dim == k for dim, _ in entities) for k in range(4)]))
    for (dim, tag), physical in sorted(entities.items()):
        box = (0.0, 0.0, 0.0) if dim == 0 else (0.0, 0.0, 0.0, 9.0, 9.0, 0.0)
        group, bounds = [int(bool(physical))], [0] * bool(dim)
        tail = [("i", [physical])] * bool(physical) + [("q", bounds)] * bool(dim)
        out.row(("i", [tag]), ("d", box), ("q", group), *tail)
    out.close("$EndEntities")
    out.line("$Nodes")
    half = len(out.points) // 2
    home = max(entities)
    out.row(("q", [2, len(out.points), min(out.tags), max(out.tags)]))
    for some in (range(half), range(half, len(out.points))):
        out.row(("i", [*home, 0]), ("q", [len(some)]))
        for k in some:
            out.row(("q", [out.tags[k]]))
        for k in some:
            out.row(("d", out.space(k)))
    out.close("$EndNodes")
    out.line("$Elements")
    numbers = [cell.number for cell in out.cells]
    out.row(("q", [len(blocks), len(numbers), min(numbers), max(numbers)]))
    for dim, tag, kind, cells in blocks:
        out.row(("i", [dim, tag, GMSH[kind]]), ("q", [len(cells)]))
        for cell in cells:
            out.row(("q", [cell.number, *(out.tags[k] for k in cell.nodes)]))
    out.close("$EndElements")


MEDIT = {"line": "Edges", "triangle": "Triangles", "quad": "Quadrilaterals", "triangle6": "TrianglesP2",
         "tetra": "Tetrahedra", "hexahedron": "Hexahedra"}  # fmt: skip


def medit(out: Sample, dimension: int) -> Files:
    out.line("# a comment", out.has("comments"))
    out.line("MeshVersionFormatted 2")
    out.line(f"Dimension {dimension}" + " # a comment" * out.has("comments"))
    out.line("Vertices")
    out.line(str(len(out.points)))
    for k in range(len(out.points)):
        out.row(("d", out.space(k)[:dimension]), ("i", [k if out.has("point data") else 0]))
    for kind, title in MEDIT.items():
        cells = out.of(kind)
        if cells and (dimension == 3 or kind not in VOLUMES):
            out.line(title)
            out.line(str(len(cells)))
            for cell in cells:
                out.row(("i", [*(k + 1 for k in cell.nodes), cell.region]))
    if vertices := out.of("vertex"):
        out.line("Corners")
        out.line(str(len(vertices)))
        for cell in vertices:
            out.row(("i", [cell.nodes[0] + 1]))
    for text in ("Ridges", "1", "1") if out.has("more") and out.has("lines") else ():
        out.line(text)
    out.line("End")
    return {".mesh": bytes(out.bytes)}


def triangle(out: Sample, dimension: int) -> Files:
    markers = {k: cell.region for cell in out.of("vertex") for k in cell.nodes}
    numbered = len(out.points) * out.has("node numbers")  # from 1 or from elsewhere
    out.line("# a comment", out.has("comments"))
    out.row(("i", [len(out.points), dimension, int(out.has("point data")), 1]))
    for k in range(len(out.points)):
        data = [k / 4] if out.has("point data") else []
        out.row(("i", [k + 1 + numbered]), ("d", out.space(k)[:dimension]), ("d", data), ("i", [markers.get(k, 0)]))
    nodes, out.bytes = bytes(out.bytes), bytearray()
    cells = out.of({2: "triangle", 3: "tetra"}[dimension])
    regions, data = out.has("regions") or out.has("cell data"), out.has("cell data")
    out.row(("i", [len(cells), dimension + 1, regions + data]))
    for cell in cells:
        more = [cell.region] * regions + [cell.number / 4] * data
        out.row(("i", [cell.number, *(k + 1 + numbered for k in cell.nodes)]), ("d", more))
    out.line("# the end", out.has("comments"))
    return {".node": nodes, ".ele": bytes(out.bytes)}


def obj(out: Sample) -> Files:
    out.line("# a comment", out.has("comments"))
    out.line("mtllib some.mtl", out.has("more"))
    for k in range(len(out.points)):
        colour = ["0.1", "0.2", "0.3"] if out.has("point data") else []
        out.row(("s", ["v"]), ("d", out.space(k)), ("d", colour))
    out.line("vn 0 0 1", out.has("more"))
    names, group = out.names(), 0
    for cell in [cell for cell in out.cells if cell.kind not in ("triangle6", *VOLUMES)]:
        if cell.region != group and (out.has("regions") or out.has("markers")):
            group = cell.region
            dim = DIMENSION.get(cell.kind, 2)
            out.line(f"g {names.get((dim, group), f'g{group}')}")
        letter = {"line": "l", "vertex": "p"}.get(cell.kind, "f")
        corner = "//1" if out.has("more") and letter == "f" else ""
        out.row(("s", [letter, *(f"{k + 1}{corner}" for k in cell.nodes)]))
    return {".obj": bytes(out.bytes)}


def off(out: Sample) -> Files:
    cells = out.of("triangle", "quad", "line", "vertex")
    out.line("# a comment", out.has("comments"))
    out.line("COFF" if out.has("point data") else "OFF")
    out.line(f"{len(out.points)} {len(cells)} 0")
    for k in range(len(out.points)):
        out.row(("d", out.space(k)), ("d", [k / 8, 0, 0, 1] if out.has("point data") else []))
    for cell in cells:
        out.row(("i", [len(cell.nodes), *cell.nodes]), ("d", [0.5, 0.5, cell.number / 99] * out.has("cell data")))
    return {".off": bytes(out.bytes)}


def stl_text(out: Sample) -> Files:
    solids: dict[int, list[Cell]] = {}
    for cell in out.of("triangle"):
        solids.setdefault(cell.region, []).append(cell)
    for region, cells in solids.items():
        name = out.names().get((2, region), "")
        out.line(f"solid {name}")
        for cell in cells:
            out.row(("s", ["facet", "normal", 0, 0, 1]))
            out.line("outer loop")
            for k in cell.nodes:
                out.row(("s", ["vertex", *out.space(k)]))
            out.line("endloop")
            out.line("endfacet")
        out.line(f"endsolid {name}")
    return {".stl": bytes(out.bytes)}


def stl_binary(out: Sample) -> Files:
    cells = out.of("triangle")
    out.bytes += (b"made by hand" if out.has("comments") else b"").ljust(80, b"\0")
    out.row(("I", [len(cells)]))
    for cell in cells:
        out.row(("f", [0, 0, 1]), *(("f", out.space(k)) for k in cell.nodes), ("H", [17 * out.has("cell data")]))
    return {".stl": bytes(out.bytes)}


def ply(out: Sample) -> Files:
    forms = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}
    faces, edges = out.of("triangle", "quad"), out.of("line")
    kind = {"f": "float", "d": "double"}[out.real]
    head = ["ply", f"format {forms[out.order]} 1.0"] + ["comment made by hand"] * out.has("comments")
    head += [f"element vertex {len(out.points)}", *(f"property {kind} {axis}" for axis in "xyz")]
    head += ["property float speed"] * out.has("point data")
    head += ["element material 1", "property int colour"] * out.has("more")
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    cell_data = ["property float heat"] * out.has("cell data")
    head += ["property int region"] * out.has("regions") + cell_data
    if edges:
        head += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2", "property int region"]
    for text in [*head, "end_header"]:
        out.line(text)
    for k in range(len(out.points)):
        out.row((out.real, out.space(k)), ("f", [k / 4] * out.has("point data")))
    if out.has("more"):
        out.row(("i", [77]))
    for cell in faces:
        data = [("i", [cell.region])] * out.has("regions") + [("f", [cell.number / 4])] * out.has("cell data")
        out.row(("B", [len(cell.nodes)]), ("i", cell.nodes), *data)
    for cell in edges:
        out.row(("i", [*cell.nodes, cell.region]))
    return {".ply": bytes(out.bytes)}


ABAQUS = {"triangle": "CPS3", "quad": "CPS4", "triangle6": "CPS6", "tetra": "C3D4", "hexahedron": "C3D8",
          "line": "T2D2"}  # fmt: skip


def abaqus(out: Sample) -> Files:
    out.line("** made by hand", out.has("comments"))
    out.line("*NODE")
    for k in range(len(out.points)):
        out.row(("i", [out.tags[k]]), ("d", out.space(k)), comma=",")
    group, names = None, out.names()
    for cell in [cell for cell in out.cells if cell.kind in ABAQUS]:
        dim = DIMENSION.get(cell.kind, 2)
        told = out.has("regions") if dim > 1 else out.has("markers")
        if (key := (cell.kind, cell.region if told else 0)) != group:
            label = names.get((dim, cell.region), f"set{cell.region}").replace(" ", "_")
            out.line(f"*ELEMENT, TYPE={ABAQUS[cell.kind]}" + f", ELSET={label}" * told)
            group = key
        out.row(("i", [cell.number, *(out.tags[k] for k in cell.nodes)]), comma=",")
    if vertices := out.of("vertex"):
        out.line("*BOUNDARY")
        for cell in vertices:
            out.row(("i", [out.tags[cell.nodes[0]], 1]), comma=",")
    for text in ("*MATERIAL, NAME=steel", "*ELASTIC", "2e5, 0.3") if out.has("more") else ():
        out.line(text)
    return {".inp": bytes(out.bytes)}


NASTRAN = {"triangle": "CTRIA3", "quad": "CQUAD4", "triangle6": "CTRIA6", "tetra": "CTETRA", "hexahedron": "CHEXA",
           "line": "CROD"}  # fmt: skip


def _real(word: str, width: int) -> str:
    """A number with a point, as Nastran wants it; one that is not of this file, as gmsnet writes it."""
    given = {text for texts in (POINTS, *OTHERS.values()) for point in texts for text in point.split()} | {"5.0"}
    if word not in given:
        return fitted(float(word), width)
    return word if "." in word or "e" in word else f"{word}."


def nastran(out: Sample, large: bool = False) -> Files:
    """Fields of 8 or of 16 columns."""
    out.line("$ a comment", out.has("comments"))
    out.line("BEGIN BULK")
    out.line("MAT1           1    2.+5              .3", out.has("more"))
    for k in range(len(out.points)):
        x, y, z = (_real(word, 16 if large else 8) for word in out.space(k))
        if large:
            out.line(f"GRID*   {out.tags[k]:>16}{'':16}{x:>16}{y:>16}")
            out.line(f"*       {z:>16}")
        else:
            out.line(f"GRID    {out.tags[k]:>8}{'':8}{x:>8}{y:>8}{z:>8}")
    for cell in [cell for cell in out.cells if cell.kind in NASTRAN]:
        told = out.has("regions") or out.has("markers")
        words = [cell.number, cell.region if told else 1, *(out.tags[k] for k in cell.nodes)]
        for k in range(0, len(words), 8):
            name = "+" if k else NASTRAN[cell.kind]
            out.line(f"{name:<8}" + "".join(f"{word:>8}" for word in words[k : k + 8]))
    for cell in out.of("vertex"):
        out.line(f"FORCE          1{out.tags[cell.nodes[0]]:>8}       0      1.      1.")
    out.line("ENDDATA")
    return {".bdf": bytes(out.bytes)}


def ugrid(out: Sample, form: str = "") -> Files:
    kinds = ("triangle", "quad", "tetra", "hexahedron")
    lists = {kind: out.of(kind) for kind in kinds}
    out.row(("i", [len(out.points), len(lists["triangle"]), len(lists["quad"]), len(lists["tetra"]), 0, 0,
                   len(lists["hexahedron"])]))  # fmt: skip
    for k in range(len(out.points)):
        out.row((out.real, out.space(k)))
    for kind in kinds[:2]:
        for cell in lists[kind]:
            out.row(("i", [k + 1 for k in cell.nodes]))
    for kind in kinds[:2]:
        for cell in lists[kind]:
            out.row(("i", [cell.region if out.has("regions") else 1]))
    for kind in kinds[2:]:
        for cell in lists[kind]:
            out.row(("i", [k + 1 for k in cell.nodes]))
    if out.has("more") and out.real == "d":  # a length that fits no form is taken for one of double precision
        out.row(("i", [0, 0, 0]))
    return {f"{form}.ugrid": bytes(out.bytes)}


VTK = {"vertex": 1, "line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "triangle6": 22}


def vtk(out: Sample, version: str, polygonal: bool = False) -> Files:
    out.line(f"# vtk DataFile Version {version}")
    out.line("made by hand" if out.has("comments") else "mesh")
    out.line("BINARY" if out.order else "ASCII")
    out.line(f"DATASET {'POLYDATA' if polygonal else 'UNSTRUCTURED_GRID'}")
    if out.has("more"):
        out.line("FIELD FieldData 1")
        out.line("TIME 1 1 double")
        out.row(("d", [2.5]))
        out.close()
    out.line(f"POINTS {len(out.points)} {({'f': 'float', 'd': 'double'})[out.real]}")
    for k in range(len(out.points)):
        out.row((out.real, out.space(k)))
    out.close()
    cells = out.cells
    if polygonal:
        lists = {"VERTICES": out.of("vertex"), "LINES": out.of("line"), "POLYGONS": out.of("triangle", "quad")}
        cells = [cell for part in lists.values() for cell in part]
    else:
        lists = {"CELLS": cells}
    for title, some in lists.items():
        if some:
            (_vtk_offsets if version == "5.1" else _vtk_lists)(out, title, some)
    if not polygonal:
        out.line(f"CELL_TYPES {len(cells)}")
        for cell in cells:
            out.row(("i", [VTK[cell.kind]]))
        out.close()
    if out.has("regions") or out.has("markers") or out.has("cell data"):
        out.line(f"CELL_DATA {len(cells)}")
        if out.has("regions") or out.has("markers"):
            out.line("SCALARS material int 1")
            out.line("LOOKUP_TABLE default")
            for cell in cells:
                out.row(("i", [cell.region]))
            out.close()
        if out.has("cell data"):
            out.line("VECTORS heat double")
            for cell in cells:
                out.row(("d", [cell.number / 4, 0, 1]))
            out.close()
    if out.has("point data"):
        out.line(f"POINT_DATA {len(out.points)}")
        out.line("SCALARS speed double 1")
        out.line("LOOKUP_TABLE default")
        for k in range(len(out.points)):
            out.row(("d", [k / 4]))
        out.close()
    return {".vtk": bytes(out.bytes)}


def _vtk_lists(out: Sample, title: str, cells: list[Cell]) -> None:
    out.line(f"{title} {len(cells)} {sum(1 + len(cell.nodes) for cell in cells)}")
    for cell in cells:
        out.row(("i", [len(cell.nodes), *cell.nodes]))
    out.close()


def _vtk_offsets(out: Sample, title: str, cells: list[Cell]) -> None:
    ends = [sum(len(cell.nodes) for cell in cells[:k]) for k in range(len(cells) + 1)]
    out.line(f"{title} {len(ends)} {ends[-1]}")
    out.line("OFFSETS vtktypeint64")
    out.row(("q", ends))
    out.close()
    out.line("CONNECTIVITY vtktypeint64")
    out.row(("q", [k for cell in cells for k in cell.nodes]))
    out.close()


VTU_TYPES = {"f": "Float32", "d": "Float64", "i": "Int32", "q": "Int64", "B": "UInt8"}


def vtu(out: Sample, encoding: str, packer: str = "") -> Files:
    """encoding: ``ascii``, ``binary`` (base64), ``raw`` or ``base64`` (both appended). packer: of PACKERS, or none."""
    order = out.order
    appended = bytearray()

    def array(name: str, code: str, rows: Iterable[Sequence[object]], width: int = 1) -> None:
        table = list(rows)
        head = f'<DataArray type="{VTU_TYPES[code]}" Name="{name}" NumberOfComponents="{width}" '
        if encoding == "ascii":
            out.line(head + 'format="ascii">')
            for values in table:
                out.row((code, values))
        else:
            numbers = [float(v) if code in "fd" else v for values in table for v in values]  # type: ignore[arg-type]
            block = _encoded(struct.pack(f"{order}{len(numbers)}{code}", *numbers), order, encoding, packer)
            if encoding == "binary":
                out.line(head + 'format="binary">')
                out.line(block.decode())
            else:
                out.line(head + f'format="appended" offset="{len(appended)}">')
                appended.extend(block)
        out.line("</DataArray>")

    out.line('<?xml version="1.0"?>')
    out.line("<!-- made by hand -->", out.has("comments"))
    compressor = ' header_type="UInt32"'
    if packer:
        compressor += f' compressor="vtk{"ZLib" if packer == "zlib" else packer}DataCompressor"'
    name = "BigEndian" if order == ">" else "LittleEndian"
    out.line(f'<VTKFile type="UnstructuredGrid" version="0.1" byte_order="{name}"{compressor}>')
    out.line("<UnstructuredGrid>")
    if out.has("more"):
        out.line("<FieldData>")
        out.line('<DataArray type="Float64" Name="TIME" NumberOfTuples="1" format="ascii">2.5</DataArray>')
        out.line("</FieldData>")
    out.line(f'<Piece NumberOfPoints="{len(out.points)}" NumberOfCells="{len(out.cells)}">')
    out.line("<PointData>")
    if out.has("point data"):
        array("speed", "d", ([k / 4] for k in range(len(out.points))))
    out.line("</PointData>")
    out.line("<CellData>")
    if out.has("regions") or out.has("markers"):
        array("material", "i", ([cell.region] for cell in out.cells))
    if out.has("cell data"):
        array("heat", "d", ([cell.number / 4, 0, 1] for cell in out.cells), 3)
    out.line("</CellData>")
    out.line("<Points>")
    array("Points", out.real, (out.space(k) for k in range(len(out.points))), 3)
    out.line("</Points>")
    out.line("<Cells>")
    array("connectivity", "q", (cell.nodes for cell in out.cells))
    array("offsets", "q", ([sum(len(c.nodes) for c in out.cells[: k + 1])] for k in range(len(out.cells))))
    array("types", "B", ([VTK[cell.kind]] for cell in out.cells))
    for text in ("</Cells>", "</Piece>", "</UnstructuredGrid>"):
        out.line(text)
    if appended:
        out.line(f'<AppendedData encoding="{encoding}">')
        out.bytes += b"_" + appended + out.end.encode() + b"</AppendedData>" + out.end.encode()
    out.line("</VTKFile>")
    return {".vtu": bytes(out.bytes)}


def _encoded(data: bytes, order: str, encoding: str, packer: str) -> bytes:
    head, body = struct.pack(f"{order}I", len(data)), data
    if packer:
        body = PACKERS[packer](data)
        head = struct.pack(f"{order}4I", 1, len(data), 0, len(body))
    if encoding == "raw":
        return head + body
    if packer:
        return base64.b64encode(head) + base64.b64encode(body)
    return base64.b64encode(head + body)


@dataclass(frozen=True)
class Variant:
    """A format and a variant of it. key: of the format; order, single: see Sample; base: facts it always has."""

    key: str
    title: str
    build: Callable[[Sample], Files]
    order: str = ""
    single: bool = False
    base: frozenset[str] = frozenset()

    def make(self, facts: Iterable[str], points: Sequence[Row]) -> Files:
        """The files (suffix → bytes) of the sample with these facts."""
        return self.build(Sample(facts, points, self.order, self.single))


def points_of(facts: Iterable[str], plain: bool = False) -> list[Row]:
    """The points that the sample with these facts has; plain: each number as most programs write it."""
    facts = set(facts)
    texts = [*POINTS, *(text for fact, more in OTHERS.items() if fact in facts for text in more)]
    return [[repr(float(word)) if plain else word for word in text.split()] for text in texts]


_LITTLE, _BIG = "little endian", "big endian"
VARIANTS = [
    Variant("su2", "SU2", partial(su2, dimension=2)),
    Variant("su2", "SU2, 3D", partial(su2, dimension=3)),
    *(Variant("gmsh", f"Gmsh {version}, {how}", partial(gmsh, version=version), order)
      for version in ("2.2", "4.1") for how, order in (("text", ""), (_LITTLE, "<"), (_BIG, ">"))),
    *(Variant("vtk", f"VTK {version}, {what}{how}", partial(vtk, version=version, polygonal=polygonal), order)
      for version in ("4.2", "5.1") for what, polygonal in (("", False), ("PolyData, ", True))
      for how, order in (("text", ""), ("binary", ">"))),
    Variant("vtk", "VTK 4.2, binary, single", partial(vtk, version="4.2"), ">", True),
    Variant("vtu", "VTU, text", partial(vtu, encoding="ascii")),
    *(Variant("vtu", f"VTU, {how}{', ' * bool(packer)}{packer}, {end}", partial(vtu, encoding=code, packer=packer),
              order)
      for how, code in (("base64", "binary"), ("appended raw", "raw"), ("appended base64", "base64"))
      for packer in ("", "zlib") for end, order in ((_LITTLE, "<"), (_BIG, ">"))),
    Variant("vtu", "VTU, base64, LZMA", partial(vtu, encoding="binary", packer="LZMA"), "<"),
    Variant("vtu", "VTU, appended raw, LZ4", partial(vtu, encoding="raw", packer="LZ4"), "<"),
    Variant("vtu", "VTU, appended raw, single", partial(vtu, encoding="raw"), "<", True),
    Variant("medit", "Medit, 2D", partial(medit, dimension=2)),
    Variant("medit", "Medit, 3D", partial(medit, dimension=3)),
    Variant("triangle", "Triangle", partial(triangle, dimension=2)),
    Variant("triangle", "TetGen", partial(triangle, dimension=3), base=frozenset({"tetrahedra"})),
    Variant("stl", "STL, text", stl_text),
    Variant("stl", "STL, binary", stl_binary, "<", True),
    Variant("obj", "OBJ", obj),
    Variant("off", "OFF", off),
    Variant("abaqus", "Abaqus", abaqus),
    Variant("nastran", "Nastran, 8 columns", nastran),
    Variant("ugrid", "UGRID, text", ugrid),
    Variant("ugrid", "UGRID, b8", partial(ugrid, form=".b8"), ">"),
    Variant("ugrid", "UGRID, lb8", partial(ugrid, form=".lb8"), "<"),
    Variant("ugrid", "UGRID, b4", partial(ugrid, form=".b4"), ">", True),
    Variant("nastran", "Nastran, 16 columns", partial(nastran, large=True)),
    *(Variant("ply", f"PLY, {how}{', single' * single}", ply, order, single)
      for how, order in (("text", ""), (_LITTLE, "<"), (_BIG, ">")) for single in (False, True)),
]  # fmt: skip
