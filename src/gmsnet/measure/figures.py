"""The figures of a quality report that are shown, in words: one row each, however they are shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

FIGURES = (  # of QualityReport.summary(): label, path, number of decimals
    ("inverted cells", ("inverted",), 0),
    ("of these, with positive corners", ("invalid_inside",), 0),
    ("of these, undecided", ("undecided",), 0),
    ("1/q, least", ("shape", "min"), 4),
    ("1/q, 1st percentile", ("shape", "p1"), 4),
    ("1/q, mean", ("shape", "mean"), 4),
    ("cells with 1/q < 0.3", ("shape", "below_0.3"), 0),
    ("scaled Jacobian, least", ("scaled_jacobian", "min"), 4),
    ("scaled Jacobian, mean", ("scaled_jacobian", "mean"), 4),
    ("1/q_V, least", ("aspect", "min"), 4),
    ("1/q_V, mean", ("aspect", "mean"), 4),
    ("det J over its mean in curved cells, least", ("curved", "min"), 4),
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


class Figure(NamedTuple):
    """One row. path: of the figure in QualityReport.summary(). texts: one for each summary, "-" where it has none."""

    label: str
    path: tuple[str, ...]
    texts: list[str]


def figures_of(summaries: Sequence[Mapping[str, Any]]) -> list[Figure]:
    """The rows that any of some summaries has; of volumes, what stands for 1/q is η."""
    symbol = "η" if "min_dihedral" in summaries[0] else "1/q"
    rows = [
        Figure(label.replace("1/q", symbol), path, [_text(at(summary, path), decimals) for summary in summaries])
        for label, path, decimals in FIGURES
    ]
    return [row for row in rows if any(text != "-" for text in row.texts)]


def at(summary: Mapping[str, Any], path: Sequence[str]) -> Any:
    """The figure of a summary at a path; None where it has none."""
    value: Any = summary
    for key in path:
        value = value.get(key) if isinstance(value, Mapping) else None
    return value


def _text(value: Any, decimals: int) -> str:
    if value is None:
        return "-"
    return f"{value:,}" if decimals == 0 else f"{value:.{decimals}f}"
