"""What a claim is, and how its figures are found in the document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

HOLDS, IN_PART, FAILS = "holds", "holds in part", "does not hold"
CLOSE = 0.01  # in mean 1/q_V

Document = Mapping[str, Any]


@dataclass(frozen=True)
class Claim:
    """title: the claim. paper: what it says. measured: what we found. verdict: one of the three."""

    title: str
    paper: str
    measured: str
    verdict: str


def verdict(held: int, of: int) -> str:
    """All, some or none."""
    return HOLDS if held == of else IN_PART if held else FAILS


def table1(document: Document, label: str) -> Mapping[str, Any]:
    """A row by its method."""
    row: Mapping[str, Any] = next(row for row in document["table1"]["rows"] if row["label"] == label)
    return row


def row(document: Document, case: str, label: str) -> Mapping[str, Any]:
    """A row by its method."""
    row: Mapping[str, Any] = next(row for row in document["table2"]["rows"][case] if row["label"] == label)
    return row


def value(document: Document, case: str, label: str, column: str = "inv_q_mean") -> float:
    """A mean over the runs in Table 2."""
    return float(row(document, case, label)["columns"][column]["mean"])
