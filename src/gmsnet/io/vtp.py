"""Polygonal data in VTK's XML (``.vtp``), read and written again as ``.vtu`` is: vertices, lines and polygons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NoReturn

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io import vtk_ghosts, vtu
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.normals import Normals
from gmsnet.io.vtu_reader import Reader
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.vtk_types import POLYGON, POLYLINE, POLYVERTEX, STRIP

name = "VTP"
suffixes: tuple[str, ...] = (".vtp",)

SECTIONS = {"Verts": POLYVERTEX, "Lines": POLYLINE, "Strips": STRIP, "Polys": POLYGON}  # as the cell data are in order


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    return vtk_ghosts.held(facts(Reader(files[".vtp"], "PolyData")))


def normals(files: Mapping[str, Data], cells: Sequence[CellBlock]) -> list[Normals]:
    """See ``io.normals.Find``."""
    reader = Reader(files[".vtp"], "PolyData")
    return vtu.normals_in(reader, cells, sum(_count(reader, section) for section in SECTIONS))


def is_empty(reader: Reader) -> bool:
    """Whether there are no cells."""
    return not reader.document.pieces or not any(_count(reader, section) for section in SECTIONS)


def _count(reader: Reader, section: str) -> int:
    """How many cells a section has; one that the piece does not count has none."""
    counted = not reader.document.pieces or f"NumberOf{section}" in reader.document.pieces[0]
    return reader.count(f"NumberOf{section}") if counted else 0


def facts(reader: Reader) -> Parsed:
    """The facts of a file."""
    parts, codes, cuts = [], [], [0]
    for section, code in SECTIONS.items():
        count = _count(reader, section)
        arrays = {a.attributes.get("Name", ""): a for a in reader.section(section)}
        if not count:
            continue
        if missing := [key for key in ("connectivity", "offsets") if key not in arrays]:
            raise FormatError(f"the array {missing[0]!r} is missing among the {section}")
        parts.append(vtu.listed(reader, arrays, count))
        codes.append(np.full(count, code))
        cuts.append(cuts[-1] + len(parts[-1].nodes))

    def fail(index: int, message: str) -> NoReturn:
        k = int(np.searchsorted(cuts, index, side="right")) - 1
        parts[k].fail(index - cuts[k], message)

    none = np.empty(0, dtype=np.int64)
    sizes, nodes = (np.concatenate([none, *(part[k] for part in parts)]) for k in (0, 1))
    return vtu.parsed(reader, np.concatenate([none, *codes]), vtu.Listed(sizes, nodes, fail))


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
