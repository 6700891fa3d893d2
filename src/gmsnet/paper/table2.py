"""Table 2: all methods on the four cases, ours and the paper's, and in which order they stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from gmsnet.paper import order, printed, qualities, timing
from gmsnet.paper.cases import CASES
from gmsnet.paper.contenders import Contender, beyond, papers
from gmsnet.paper.plan import Plan
from gmsnet.paper.qualities import LOW_IS_GOOD, Row
from gmsnet.paper.store import Store

DECIMALS = {"min": 2, "max": 2, "inv": 3, "shape": 3, "qhat": 4, "inverted": 1}  # by the first word of a column
MARKED = (*printed.COLUMNS, "shape_min", "shape_mean", "qhat")
ORDERED = {"inv_q_mean": "mean 1/q_V", "min_angle_min": "least angle"}  # columns by which methods are ranked


def decimals(column: str) -> int:
    """How many are shown in a column."""
    return DECIMALS[column.split("_")[0]]


def document(plan: Plan, store: Store) -> dict[str, Any]:
    """The paper's methods, those beyond it, and the orders, as plain values."""
    return {
        "rows": _rows(plan, store, papers()),
        "beyond": _rows(plan, store, beyond()),
        "orders": _orders(plan, store),
    }


def _rows(plan: Plan, store: Store, among: Sequence[Contender]) -> dict[str, list[dict[str, Any]]]:
    """Case → a row for the origin and for each method."""
    found = qualities.rows(plan, store, among)
    made: dict[str, list[dict[str, Any]]] = {}
    for case in CASES:
        rows = [row for row in found if row.case == case]
        marks = {column: _marks(rows[1:], column) for column in MARKED}
        seconds = timing.per_node(store, case)
        by_label = {each.label: each for each in among}
        made[case] = []
        for row in rows:
            contender = by_label.get(row.label)
            columns = {
                name: {
                    **asdict(spread),
                    "mark": marks.get(name, {}).get(row.label, ""),
                    **_papers(row, name, spread.mean),
                }
                for name, spread in row.columns.items()
            }
            made[case].append(
                {
                    "label": row.label,
                    "method": None if contender is None else contender.key,
                    "columns": columns,
                    "sweeps": None if row.sweeps is None else asdict(row.sweeps),
                    "free_nodes": None if row.free is None else row.free.mean,
                    "seconds_per_node": {} if contender is None else seconds[contender.key],
                    "papers_seconds_per_node": _papers_seconds(case, row.label),
                }
            )
    return made


def _papers(row: Row, column: str, ours: float) -> dict[str, float]:
    if column not in row.printed:
        return {}
    return {"paper": row.printed[column], "difference": ours - row.printed[column]}


def _papers_seconds(case: str, label: str) -> float | None:
    row = printed.table2().get((case, label))
    return None if row is None else row.seconds_per_node


def _marks(rows: Sequence[Row], column: str) -> dict[str, str]:
    """Label → "best" or "second", as far as the figures differ in the decimals that are shown."""
    shown = {row.label: round(row.columns[column].mean, decimals(column)) for row in rows}
    ranked = sorted(set(shown.values()), reverse=column not in LOW_IS_GOOD)
    names = dict(zip(ranked, ("best", "second"), strict=False))
    return {label: names[value] for label, value in shown.items() if value in names}


def _orders(plan: Plan, store: Store) -> dict[str, dict[str, Any]]:
    """Column → case → the two orders of the paper's methods."""
    rows = [row for row in qualities.rows(plan, store, papers()) if row.printed and row.label != printed.ORIGIN]
    made: dict[str, dict[str, Any]] = {}
    for column in ORDERED:
        made[column] = {}
        for case in CASES:
            here = [row for row in rows if row.case == case]
            ours: Mapping[str, float] = {row.label: row.columns[column].mean for row in here}
            theirs = {row.label: row.printed[column] for row in here}
            found = order.compare(ours, theirs)
            against = [
                {"better": a, "worse": b, "ours": [ours[a], ours[b]], "paper": [theirs[a], theirs[b]]}
                for a, b in found.against
            ]
            made[column][case] = {"ours": found.ours, "papers": found.papers, "tau": found.tau, "against": against}
    return made
