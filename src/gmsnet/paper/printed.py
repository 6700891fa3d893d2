"""What the paper prints: the figures of Tables 2 and 3, and those of its text, as data to compare with.

The quality columns of its tables fit 1/q_V, the inverse of Verdict's aspect ratio (QualityReport.aspect), and not the
1/q of its own loss.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

ORIGIN = "Origin"
COLUMNS = (  # of Tables 2 and 3, in their order; then seconds per node
    "min_angle_min", "min_angle_mean", "max_angle_max", "max_angle_mean", "inv_q_min", "inv_q_mean"
)  # fmt: skip
SPEED_RATIO = {"square": 14.51, "circle": 13.34, "airfoil": 12.52, "pipe": 13.93}  # OptimSmoothing / GMSNet
MEAN_SPEED_RATIO = 13.56
PARAMETERS_SHARE = 0.05  # of GMSNet's parameters in those of NN-Smoothing


@dataclass(frozen=True)
class Row:
    """One row of a printed table. case: as in ``cases.CASES``. values: by the names in COLUMNS."""

    case: str
    name: str
    values: dict[str, float]
    seconds_per_node: float | None = None


@cache
def table2() -> dict[tuple[str, str], Row]:
    """(case, name of the method in the paper) → row."""
    return _rows("printed_table2.csv", "method")


@cache
def table3() -> dict[tuple[str, str], Row]:
    """(case, "metric" or "cosine") → row."""
    losses = {"MetricLoss": "metric", "cosine": "cosine"}
    return {(case, losses[name]): row for (case, name), row in _rows("printed_table3.csv", "loss").items()}


def _rows(file: str, key: str) -> dict[tuple[str, str], Row]:
    text = files(__package__).joinpath(file).read_text(encoding="utf-8")
    rows = {}
    for line in csv.DictReader(text.splitlines()):
        seconds = line.get("seconds_per_node")
        case, values = line["mesh"].lower(), {name: float(line[name]) for name in COLUMNS}
        rows[case, line[key]] = Row(case, line[key], values, float(seconds) if seconds else None)
    return rows
