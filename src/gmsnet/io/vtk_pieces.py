"""Meshes in several files of VTK's XML: pieces (``.pvtu``, ``.pvtp``) and blocks (``.vtm``), read as one mesh.

The file that names the others stays as it is; in each of these the coordinates of moved nodes are written anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gmsnet.errors import FormatError, InputError
from gmsnet.io import vtp, vtu
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.merge import Part, one_mesh
from gmsnet.io.packed import split_name
from gmsnet.io.vtk_links import BLOCKS, Link, kind_of, leaves
from gmsnet.io.vtu_reader import Reader
from gmsnet.mesh.mesh import Mesh

IDS = ("GlobalPointIds", "GlobalNodeIds", "GlobalNodeId", "GlobalIds")  # of points, where the file does not say which


@dataclass(frozen=True)
class PieceFormat:
    """A format of a file that names others (see Format). kind: the type of its VTKFile."""

    name: str
    suffixes: tuple[str, ...]
    kind: str

    def read(self, files: Mapping[str, Data]) -> Parsed:
        """See Format; the other files are there under the names that the first gives them."""
        kind, named = kind_of(files[self.suffixes[0]])
        if kind != self.kind:
            raise FormatError(f"a VTKFile of type {kind} is not {self.name}: rename the file")
        links = list(leaves(files, named))
        parts = [part for link in links if (part := part_in(link, files)) is not None]
        if kind == BLOCKS:
            parts = _numbered(parts, links)
        return one_mesh({link.path: part for part, link in parts}, len(links))

    def write(self, mesh: Mesh) -> Written:
        """Raises FormatError: only files of this format are written again."""
        return own_files_only(self.name)


def part_in(link: Link, files: Mapping[str, Data]) -> tuple[Part, Link] | None:
    """What a piece holds; None where it has no cells. Raises FormatError naming the piece."""
    polygons = split_name(link.path)[1].lower() == vtp.suffixes[0]
    module = vtp if polygons else vtu
    try:
        reader = Reader(files[link.path], "PolyData" if polygons else "UnstructuredGrid")
        if module.is_empty(reader):
            return None
        parsed = module.facts(reader)
    except InputError as error:
        raise FormatError(f"{link.path}: {error}") from None
    named = [reader.document.global_ids, *IDS]
    ids = next((parsed.point_data[name] for name in named if name in parsed.point_data), None)
    return Part(
        parsed, ids.astype(np.int64) if ids is not None and ids.ndim == 1 and ids.dtype.kind in "iu" else None
    ), link


def _numbered(parts: list[tuple[Part, Link]], links: list[Link]) -> list[tuple[Part, Link]]:
    """The same with a region for each block, where the files tell no regions apart; its name is that of the block."""
    if any(block.regions.any() for part, _ in parts for block in part.parsed.cells):
        return parts
    numbers = {group: k for k, group in enumerate(dict.fromkeys(link.group for link in links), 1)}
    return [(part.in_region(numbers[link.group], link.name), link) for part, link in parts]


pvtu: PieceFormat = PieceFormat("PVTU", (".pvtu",), "PUnstructuredGrid")
pvtp: PieceFormat = PieceFormat("PVTP", (".pvtp",), "PPolyData")
vtm: PieceFormat = PieceFormat("VTM", (".vtm",), BLOCKS)
