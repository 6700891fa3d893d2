"""Tables of the command line about the quality of a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.table import Table

from gmsnet.cli.output import table
from gmsnet.measure.figures import figures_of
from gmsnet.measure.worst import worst_rows

if TYPE_CHECKING:
    from gmsnet.measure.overview import Overview
    from gmsnet.measure.report import QualityReport
    from gmsnet.metric.conformity import ConformityChange


def figures(reports: Mapping[str, QualityReport | Overview]) -> Table:
    """One row for each figure of quality, one column for each report."""
    rows = figures_of([report.summary() for report in reports.values()])
    return table(["", *reports], [[row.label, *row.texts] for row in rows])


def worst_table(cells: Sequence[Mapping[str, Any]]) -> Table:
    """The answer of ``worst_cells`` as a table."""
    head, *rows = worst_rows(cells)
    return table(head, rows)


def conformity(change: ConformityChange) -> Table:
    """How the mesh conforms to the metric, before and after: one row a figure."""
    return table(["", "before", "after"], change.rows())
