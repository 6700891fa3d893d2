"""A mesh as an Abaqus and CalculiX deck: nodes, elements and sets, without materials, sections and steps."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gmsnet.io import convert
from gmsnet.io.abaqus_types import WRITTEN, as_written
from gmsnet.io.cells import distinct
from gmsnet.io.document import Written
from gmsnet.io.fields import of_abaqus
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.mesh.mesh import Mesh

name = "Abaqus"
suffixes: tuple[str, ...] = (".inp",)

_LONGEST = 80  # characters of a name
_PER_LINE = 16  # numbers
_ODD = re.compile(r"[^A-Za-z0-9_-]")


def write(mesh: Mesh) -> Written:
    """See Format. Regions become element sets, vertex cells and node sets become sets of nodes."""
    convert.check_kinds(mesh, name, [*WRITTEN, "vertex"])
    names = _names(mesh)
    lost = convert.lost_order(mesh, name) + convert.lost_data(mesh, name, kept=mesh.node_sets, regions=True)
    renamed = [f"{old!r} ({new})" for old, new in names.items() if old != new]
    if renamed:
        lost.append(f"{name} names its sets by letters, digits, - and _: {convert.listed(renamed)}")
    vertices = sum(len(block.nodes) for block in mesh.cells if block.dimension == 0)
    if vertices:
        lost.append(f"{name} has no vertex cells: {vertices} became members of sets of nodes")
    points = convert.in_space(mesh)
    kept = of_abaqus(points).kept(np.full_like(points, np.nan), points)
    lost += convert.lost_digits(mesh, points, kept, name)
    return Written({".inp": Pieces(lambda: _text(mesh, kept, names))}, lost)


def _names(mesh: Mesh) -> dict[str, str]:
    """The name of each region, marker and node set as the deck can hold it: each another one, capitals or not."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for dimension in range(4):
        for region in convert.regions_of(mesh.cells, dimension):
            _add(convert.marker_name(mesh, dimension, region), found, taken)
    for key in mesh.node_sets:
        _add(key, found, taken)
    return found


def _add(old: str, found: dict[str, str], taken: set[str]) -> None:
    if old in found:
        return
    new = _ODD.sub("_", old)[: _LONGEST - 8] or "set"
    new = new if new[0].isalpha() else f"region_{new}"
    base, count = new, 1
    while new.upper() in taken:
        count += 1
        new = f"{base}_{count}"
    taken.add(new.upper())
    found[old] = new


def _text(mesh: Mesh, points: NDArray[np.float64], names: dict[str, str]) -> Iterator[Piece]:
    yield b"*NODE\n"
    yield from convert.rows(b"%, %, %, %\n", np.arange(1, len(points) + 1), points)
    flat = int(mesh.plane is None or not np.array_equal(points[:, :2], points[:, list(mesh.plane)]))
    number = 1
    for block in mesh.cells:
        if block.kind == "vertex":
            continue
        for region in distinct(block.regions):
            nodes = block.nodes[block.regions == region] + 1
            label = names[convert.marker_name(mesh, block.cell.dimension, region)]
            yield f"*ELEMENT, TYPE={WRITTEN[block.kind][flat]}, ELSET={label}\n".encode()
            yield from _records(as_written(block.kind, nodes), number)
            number += len(nodes)
    for block in mesh.cells:
        for region in distinct(block.regions) if block.kind == "vertex" else ():
            label = names[convert.marker_name(mesh, 0, region)]
            yield from _set(label, block.nodes[block.regions == region].ravel())
    for key, nodes in mesh.node_sets.items():
        yield from _set(names[key], nodes)


def _records(nodes: NDArray[np.int64], first: int) -> Iterator[Piece]:
    """A row for each cell: its number and its nodes; a comma at the end of a line says that the next goes on."""
    width = nodes.shape[1] + 1
    lines = [b", ".join([b"%"] * min(_PER_LINE, width - k)) for k in range(0, width, _PER_LINE)]
    yield from convert.rows(b",\n".join(lines) + b"\n", np.arange(first, first + len(nodes)), nodes)


def _set(label: str, nodes: NDArray[np.int64]) -> Iterator[Piece]:
    yield f"*NSET, NSET={label}\n".encode()
    yield from convert.rows(b"%\n", nodes + 1)
