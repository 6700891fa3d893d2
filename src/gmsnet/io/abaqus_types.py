"""Types of elements of Abaqus and CalculiX, and the kind of cell that each is.

A type is a family and a number of nodes, with letters behind for the formulation: CPE4RH is a quad of four nodes. The
nodes of all kinds below stand in the order of Mesh, but for those of lines of three nodes, of which the second is in
the middle, and the last seven of hexahedra of 27: the middle of the cell, then those of its faces 1 to 6.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.cell_table import Kind

_FLAT = ("CPS", "CPE", "CPEG", "CAX", "CGAX", "DC2D", "DCAX", "AC2D", "ACAX", "M3D", "SFM3D", "R3D", "STRI", "DS", "S")
_SOLID = ("C3D", "DC3D", "DCC3D", "AC3D", "SC")
_FACES = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
_VOLUMES = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron", 10: "tetra10", 13: "pyramid13", 15: "wedge15",
            20: "hexahedron20", 27: "hexahedron27"}  # fmt: skip
_SINGLE = {"MASS": "vertex", "ROTARYI": "vertex", "SPRING1": "vertex", "DASHPOT1": "vertex", "HEATCAP": "vertex",
           "SPRINGA": "line", "SPRING2": "line", "DASHPOTA": "line", "DASHPOT2": "line", "CONN2D2": "line",
           "CONN3D2": "line", "GAPUNI": "line", "RB2D2": "line", "RB3D2": "line"}  # fmt: skip
_LINE2 = re.compile(r"(T[23]D2|B[23][13]|R2D2|RAX2|SAX1|MAX1|DC1D2)[A-Z]*")
_LINE3 = re.compile(r"(T[23]D3|B[23]2|SAX2|MAX2|DC1D3)[A-Z]*")
_TYPE = re.compile(rf"({'|'.join(sorted((*_FLAT, *_SOLID), key=len, reverse=True))})(\d{{1,4}})([A-Z]*\d?)")
_SIZES = {"STRI65": 6}  # whose number is not that of its nodes
_ORDERS = {"hexahedron27": (*range(20), 26, 24, 23, 25, 21, 22, 20)}  # of Mesh's nodes, the places in a record
LEAST = {"hexahedron27": 21}  # of kinds whose last nodes may be left out, how many must be there
_VARIES = "V"  # how many nodes a cell has is not told by its type: C3D15V

WRITTEN = {  # in the plane, and elsewhere where that is another type
    "line": ("T2D2", "T3D2"), "line3": ("T2D3", "T3D3"), "triangle": ("CPS3", "S3"), "quad": ("CPS4", "S4"),
    "triangle6": ("CPS6", "STRI65"), "quad8": ("CPS8", "S8R"), "quad9": ("M3D9", "M3D9"), "tetra": ("C3D4", "C3D4"),
    "tetra10": ("C3D10", "C3D10"), "hexahedron": ("C3D8", "C3D8"), "hexahedron20": ("C3D20", "C3D20"),
    "wedge": ("C3D6", "C3D6"), "wedge15": ("C3D15", "C3D15"), "pyramid": ("C3D5", "C3D5"),
    "pyramid13": ("C3D13", "C3D13"), "hexahedron27": ("C3D27", "C3D27"),
}  # fmt: skip


def kind_of(name: str) -> Kind | None:
    """The kind of a type in capitals; None where it is not known, or means something else than its nodes say."""
    if name in _SINGLE:
        return Kind(_SINGLE[name])
    if _LINE2.fullmatch(name):
        return Kind("line")
    if _LINE3.fullmatch(name):
        return Kind("line3", (0, 2, 1))
    match = _TYPE.fullmatch(name)
    if match is None or _VARIES in match[3]:
        return None
    kinds, size = _FACES if match[1] in _FLAT else _VOLUMES, _SIZES.get(name, int(match[2]))
    return Kind(kinds[size], _ORDERS.get(kinds[size])) if size in kinds else None


def as_written(kind: str, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """The nodes of cells of a kind in the order of Abaqus."""
    order = (0, 2, 1) if kind == "line3" else _ORDERS.get(kind)
    return nodes if order is None else nodes[:, np.argsort(order)]
