"""The tables as CSV files, one figure a line."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

FIGURES = ("mean", "deviation", "least", "most", "paper", "difference")


def sheets(document: Mapping[str, Any]) -> dict[str, bytes]:
    """File → its content, for the tables that are in the document."""
    made = {}
    keys: tuple[str, ...]
    if "table1" in document:
        keys = ("label", "seconds_plain", "seconds_compiled", "parameters", "rotations", "permutations")
        made["table1.csv"] = _csv(keys, ([row[key] for key in keys] for row in document["table1"]["rows"]))
    if "table2" in document:
        made["table2.csv"] = _csv(("case", "method", "column", *FIGURES), _second(document["table2"]))
        made["timing.csv"] = _csv(
            ("case", "method", "setting", "seconds_per_node", "paper"), _seconds(document["table2"])
        )
    if "table3" in document:
        made["table3.csv"] = _csv(("case", "loss", "column", *FIGURES), _third(document["table3"]))
    if "study" in document:
        keys = ("epochs", "end", "gain", "swings")
        rows = (
            [loss, k, *(each[key][k] for key in keys)]
            for loss, each in document["study"]["losses"].items()
            for k in range(each["trainings"])
        )
        made["loss-study.csv"] = _csv(("loss", "training", "epochs", "metric_loss", "gain", "swing"), rows)
    if "claims" in document:
        keys = ("title", "paper", "measured", "verdict")
        made["claims.csv"] = _csv(keys, ([claim[key] for key in keys] for claim in document["claims"]))
    return made


def _second(table: Mapping[str, Any]) -> Iterable[list[Any]]:
    for case, rows in table["rows"].items():
        for row in (*rows, *table["beyond"][case][1:]):  # the origin is the same
            for column, figures in row["columns"].items():
                yield [case, row["label"], column, *(figures.get(name) for name in FIGURES)]
            if row["sweeps"] is not None:
                yield [case, row["label"], "sweeps", *(row["sweeps"].get(name) for name in FIGURES)]


def _seconds(table: Mapping[str, Any]) -> Iterable[list[Any]]:
    for case, rows in table["rows"].items():
        for row in (*rows, *table["beyond"][case]):
            for setting, seconds in row["seconds_per_node"].items():
                paper = row["papers_seconds_per_node"] if setting == "plain" else None
                if seconds is not None:
                    yield [case, row["label"], setting, seconds, paper]


def _third(table: Mapping[str, Any]) -> Iterable[list[Any]]:
    for case, losses in table.items():
        for loss, found in losses.items():
            for column, figures in found["columns"].items():
                yield [case, loss, column, *(figures.get(name) for name in FIGURES)]


def _csv(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> bytes:
    """None becomes an empty field."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue().encode()
