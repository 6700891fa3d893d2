"""What the command line says about the quality of a mesh: tables, the worst cells with their place, JSON documents."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from gmsnet.cli.output import table
from gmsnet.mesh.cell_block import cells_in_words
from gmsnet.mesh.display import amount
from gmsnet.mesh.mesh import Mesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from gmsnet.measure.report import QualityReport
    from gmsnet.metric.conformity import ConformityChange
    from gmsnet.run.sweep import Sweep

WORST = 5  # cells are shown
NAMED = 10  # cells are named in one line

FIGURES = (  # of QualityReport.summary(): label, path, number of decimals
    ("inverted cells", ("inverted",), 0),
    ("1/q, least", ("shape", "min"), 4),
    ("1/q, 1st percentile", ("shape", "p1"), 4),
    ("1/q, mean", ("shape", "mean"), 4),
    ("cells with 1/q < 0.3", ("shape", "below_0.3"), 0),
    ("scaled Jacobian, least", ("scaled_jacobian", "min"), 4),
    ("scaled Jacobian, mean", ("scaled_jacobian", "mean"), 4),
    ("1/q_V, least", ("aspect", "min"), 4),
    ("1/q_V, mean", ("aspect", "mean"), 4),
    ("min angle, least", ("min_angle", "min"), 2),
    ("min angle, mean", ("min_angle", "mean"), 2),
    ("max angle, greatest", ("max_angle", "max"), 2),
    ("max angle, mean", ("max_angle", "mean"), 2),
    ("dihedral angle, least", ("min_dihedral", "min"), 2),
    ("dihedral angle, mean of the least", ("min_dihedral", "mean"), 2),
    ("cells with a dihedral angle < 5°", ("min_dihedral", "below_5"), 0),
    ("cells with a dihedral angle < 10°", ("min_dihedral", "below_10"), 0),
    ("dihedral angle, greatest", ("max_dihedral", "max"), 2),
    ("cells with a dihedral angle > 165°", ("max_dihedral", "above_165"), 0),
    ("q-hat with 1/q", ("qhat",), 4),
    ("q-hat with 1/q_V", ("qhat_aspect",), 4),
)


def figures(reports: Mapping[str, QualityReport]) -> Table:
    """One row for each figure of quality, one column for each report."""
    summaries = [report.summary() for report in reports.values()]
    rows = [
        [_label(label, summaries), *(_text(_at(summary, path), decimals) for summary in summaries)]
        for label, path, decimals in FIGURES
    ]
    return table(["", *reports], [row for row in rows if any(text != "-" for text in row[1:])])


def _label(label: str, summaries: Sequence[Mapping[str, Any]]) -> str:
    """Of tetrahedra, what stands for 1/q is η."""
    return label.replace("1/q", "η") if "tetrahedra" in summaries[0] else label


def counts(mesh: Mesh) -> str:
    """How many nodes and cells of which kind a mesh has, in words."""
    return ", ".join([amount(len(mesh.points), "node"), *cells_in_words(mesh.cells)])


def worst_cells(mesh: Mesh, report: QualityReport, held: NDArray[np.bool_] | None = None) -> list[dict[str, Any]]:
    """The cells of minimum 1/q, the worst first: number from 0, measures, place, and how many corners are held."""
    rows = []
    for row in report.worst(WORST).tolist():
        cell = int(report.cell[row])
        found: dict[str, Any] = {
            "cell": cell,
            "shape": float(report.shape[row]),
            **{name: float(report.column(name)[row]) for name in report.angles},
            "inverted": not report.valid[row],
            "centre": report.centre[row].tolist(),
        }
        if held is not None:
            found["held_corners"] = int(held[corners_of(mesh, cell)].sum())
            found["corners"] = len(corners_of(mesh, cell))
        rows.append(found)
    return rows


def worst_table(cells: Sequence[Mapping[str, Any]]) -> Table:
    """The answer of ``worst_cells`` as a table."""
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
    return table([*columns, *(["held corners"] if with_held else [])], rows)


def conformity(change: ConformityChange) -> Table:
    """How the mesh conforms to the metric, before and after: one row a figure."""
    before, after = (each.figures() for each in change)
    return table(["", "before", "after"], [[*one, other] for one, (_, other) in zip(before, after, strict=True)])


def stage_table(stages: Sequence[tuple[str, int, Sweep]], patches: bool, of: str = "1/q") -> Table:
    """What was done one after the other: its name, how many sweeps, and the mesh after it, or the patches of it.

    of: whose least and mean are told.
    """
    rows = [
        [
            name,
            f"{sweeps}",
            f"{sweep.min_shape:.4f}",
            f"{sweep.mean_shape:.4f}",
            "-" if math.isnan(sweep.qhat) else f"{sweep.qhat:.4f}",
        ]
        for name, sweeps, sweep in stages
    ]
    where = ", in the patches that are smoothed" if patches else ""
    return table([f"stage{where}", "sweeps", f"{of}, least", f"{of}, mean", "q-hat"], rows)


def corners_of(mesh: Mesh, cell: int) -> NDArray[np.int64]:
    """The corner nodes of a cell by its index among all cells of the mesh."""
    for block in mesh.cells:
        if cell < len(block.nodes):
            return block.nodes[cell, : block.corners]
        cell -= len(block.nodes)
    raise IndexError(cell)


def named_cells(report: QualityReport, rows: NDArray[np.int64], what: str) -> str:
    """The cells of these rows, the worst first, in words: how many are what, and the first of them by number."""
    named = ", ".join(str(cell) for cell in report.cell[rows[:NAMED]].tolist())
    more = ", …" if len(rows) > NAMED else ""
    return f"{amount(len(rows), 'cell')} {what} (numbers from 0, worst first: {named}{more})"


def _at(summary: Mapping[str, Any], path: Sequence[str]) -> Any:
    value: Any = summary
    for key in path:
        value = value.get(key) if isinstance(value, Mapping) else None
    return value


def _text(value: Any, decimals: int) -> str:
    if value is None:
        return "-"
    return f"{value:,}" if decimals == 0 else f"{value:.{decimals}f}"
