"""The worst cells of a mesh, with their places: as plain values, as rows of a table, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.report import QualityReport
from gmsnet.measure.solids import MeasuredSolids
from gmsnet.measure.target import Target
from gmsnet.mesh.display import amount
from gmsnet.mesh.mesh import Mesh

WORST = 5  # cells are shown
NAMED = 10  # cells are named in one line


def worst_cells(
    mesh: Mesh, report: QualityReport, held: NDArray[np.bool_] | None = None, count: int = WORST
) -> list[dict[str, Any]]:
    """The cells of minimum 1/q, the worst first: number from 0, measures, place, and how many corners are held."""
    return described(mesh, report, report.worst(count), held)


def described(
    mesh: Mesh, report: QualityReport, rows: NDArray[np.int64], held: NDArray[np.bool_] | None = None
) -> list[dict[str, Any]]:
    """The same of the cells in some rows of a report."""
    cells = []
    for row in rows.tolist():
        cell = int(report.cell[row])
        found: dict[str, Any] = {
            "cell": cell,
            "shape": float(report.shape[row]),
            **{name: float(report.column(name)[row]) for name in report.angles},
            "inverted": not report.valid[row],
            "centre": report.centre[row].tolist(),
        }
        place = invalid_place(report, row)
        if place is not None:
            found["invalid_at"] = place
        if held is not None:
            found["held_corners"] = int(held[corners_of(mesh, cell)].sum())
            found["corners"] = len(corners_of(mesh, cell))
        cells.append(found)
    return cells


def invalid_place(report: QualityReport, row: int) -> list[float] | None:
    """Where in the reference cell a volume cell is not valid; None where it is, or is known by its corners alone."""
    if not isinstance(report.cells, MeasuredSolids) or report.valid[row]:
        return None
    place: list[float] = report.cells.judged[1][row].tolist()
    return place


def worst_rows(cells: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """The answer of ``worst_cells`` as rows of a table, the first of them its head."""
    space = any("min_dihedral" in cell for cell in cells)
    low, high = ("min_dihedral", "max_dihedral") if space else ("min_angle", "max_angle")
    columns = ["cell", "η" if space else "1/q", low.replace("_", " "), high.replace("_", " "), "at"]
    rows = [
        [
            f"{cell['cell']}{' (inverted)' if cell['inverted'] else ''}",
            f"{cell['shape']:.4f}",
            f"{cell[low]:.2f}",
            f"{cell[high]:.2f}",
            " ".join(f"{value:.6g}" for value in cell["centre"]),
            *([f"{cell['held_corners']} of {cell['corners']}"] if "held_corners" in cell else []),
        ]
        for cell in cells
    ]
    with_held = any("held_corners" in cell for cell in cells)
    return [[*columns, *(["held corners"] if with_held else [])], *rows]


def corners_of(mesh: Mesh, cell: int) -> NDArray[np.int64]:
    """The corner nodes of a cell by its index among all cells of the mesh."""
    for block in mesh.cells:
        if cell < len(block.nodes):
            return block.nodes[cell, : block.corners]
        cell -= len(block.nodes)
    raise IndexError(cell)


class Place(NamedTuple):
    """A cell by its number, its 1/q or η, and its middle."""

    shape: float
    cell: int
    centre: tuple[float, ...]


def unmet(report: QualityReport, target: Target | None) -> NDArray[np.int64]:
    """(k,) the rows of the cells that are inverted or miss a target, the worst first."""
    rows = np.flatnonzero(~report.valid)
    if target:
        rows = np.union1d(rows, target.missed_in(report))
    return rows[np.argsort(report.shape[rows], kind="stable")]


def places_of(report: QualityReport, rows: NDArray[np.int64]) -> tuple[Place, ...]:
    """The first NAMED of some rows."""
    rows = rows[:NAMED]
    found = zip(report.shape[rows].tolist(), report.cell[rows].tolist(), report.centre[rows].tolist(), strict=True)
    return tuple(Place(shape, cell, tuple(centre)) for shape, cell, centre in found)


def named_places(places: Sequence[Place], symbol: str) -> list[str]:
    """A line for each."""
    return [
        f"cell {each.cell} at {' '.join(f'{value:.6g}' for value in each.centre)}: {symbol} {each.shape:.4g}"
        for each in places
    ]


def named_cells(report: QualityReport, rows: NDArray[np.int64], what: str) -> str:
    """The cells of these rows, the worst first, in words: how many are what, and the first of them by number."""
    return named_numbers(report.cell[rows[:NAMED]].tolist(), len(rows), what)


def named_numbers(numbers: Sequence[int], count: int, what: str) -> str:
    """The same of so many cells. numbers: of the first of them."""
    named = ", ".join(map(str, numbers))
    more = ", …" if count > len(numbers) else ""
    return f"{amount(count, 'cell')} {what} (numbers from 0, worst first: {named}{more})"
