"""A mesh as Nastran's bulk data: nodes in fields of 16 columns, and elements; without properties and materials."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import convert
from gmsnet.io.document import Written
from gmsnet.io.nastran_numbers import fitted, rounding_of
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.mesh.mesh import Mesh

name = "Nastran"
suffixes: tuple[str, ...] = (".bdf",)

WRITTEN = {
    "line": "CROD", "triangle": "CTRIA3", "triangle6": "CTRIA6", "quad": "CQUAD4", "quad8": "CQUAD8", "quad9": "CQUAD",
    "tetra": "CTETRA", "tetra10": "CTETRA", "pyramid": "CPYRAM", "pyramid13": "CPYRAM", "wedge": "CPENTA",
    "wedge15": "CPENTA", "hexahedron": "CHEXA", "hexahedron20": "CHEXA",
}  # fmt: skip
ORDER: dict[str, tuple[int, ...]] = {
    "wedge15": (*range(9), 12, 13, 14, 9, 10, 11),
    "hexahedron20": (*range(12), 16, 17, 18, 19, 12, 13, 14, 15),
}
MOST = 99_999_999  # that a field of 8 columns can hold
WIDTH = 16
_AT_ONCE = 1 << 12


def write(mesh: Mesh) -> Written:
    """See Format. Regions become numbers of properties."""
    convert.check_kinds(mesh, name, [*WRITTEN, "vertex"])
    if max(len(mesh.points), sum(len(block.nodes) for block in mesh.cells)) > MOST:
        raise FormatError(f"{name} numbers at most {MOST:,} nodes and elements: write another format, such as .vtu")
    points, numbers = convert.in_space(mesh), _numbers(mesh)
    widths = np.full(len(points), WIDTH)
    kept = rounding_of(widths, points).kept(np.full_like(points, np.nan), points)
    lost = convert.lost_cells(mesh, name, (0,)) + convert.lost_digits(mesh, points, kept, name)
    changed = [f"{old} ({new})" for (_, old), new in numbers.items() if old != new]
    if changed and len(numbers) > 1:
        lost.append(f"{name} numbers its properties from 1, each for itself: {convert.listed(changed)}")
    lost += convert.lost_names(mesh, name, (1, 2, 3)) + convert.lost_data(mesh, name, regions=True)
    return Written({".bdf": Pieces(lambda: _text(mesh, kept, numbers))}, lost)


def _numbers(mesh: Mesh) -> dict[tuple[int, int], int]:
    """The number of the property of each region: its own where that can be, else the next that is free."""
    wanted = [(dim, region) for dim in (3, 2, 1) for region in convert.regions_of(mesh.cells, dim)]
    found: dict[tuple[int, int], int] = {}
    taken: set[int] = set()
    for dim, region in wanted:
        if 1 <= region <= MOST and region not in taken:
            found[dim, region] = region
            taken.add(region)
    following = max((number for number in taken if number < MOST // 2), default=0)
    for pair in wanted:
        if pair not in found:
            following += 1
            while following in taken:
                following += 1
            found[pair] = following
            taken.add(following)
    return found


def _text(mesh: Mesh, points: NDArray[np.float64], numbers: dict[tuple[int, int], int]) -> Iterator[Piece]:
    yield b"BEGIN BULK\n"
    for k in range(0, len(points), _AT_ONCE):
        yield "".join(
            f"GRID*   {number:>16}{'':16}{fitted(x, WIDTH):>16}{fitted(y, WIDTH):>16}\n*       {fitted(z, WIDTH):>16}\n"
            for number, (x, y, z) in enumerate(points[k : k + _AT_ONCE].tolist(), k + 1)
        ).encode()
    first = 1
    for block in mesh.cells:
        if block.kind == "vertex":
            continue
        nodes = block.nodes[:, list(ORDER[block.kind])] if block.kind in ORDER else block.nodes
        regions, which = np.unique(block.regions, return_inverse=True)
        known = np.array([numbers[block.cell.dimension, region] for region in regions.tolist()], dtype=np.int64)
        row = _template(WRITTEN[block.kind], 2 + nodes.shape[1])
        yield from convert.rows(row, np.arange(first, first + len(nodes)), known[which.reshape(-1)], nodes + 1)
        first += len(nodes)
    yield b"ENDDATA\n"


def _template(card: str, fields: int) -> bytes:
    """A row of so many fields between commas, 8 to a line."""
    lines = [",".join(["%"] * min(8, fields - k)) for k in range(0, fields, 8)]
    return f"{card},".encode() + ",+\n+,".join(lines).encode() + b"\n"
