"""The table in docs/reproduction.md is that of the committed run."""

from __future__ import annotations

import csv
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
COLUMNS = ("min_angle_min", "min_angle_mean", "max_angle_max", "max_angle_mean", "inv_q_min", "inv_q_mean")


def test_table_2_of_the_reading_is_that_of_the_run():
    with open(DOCS / "reproduction" / "table2.csv", encoding="utf-8") as file:
        run = {(row["case"], row["method"], row["column"]): row for row in csv.DictReader(file)}
    text = (DOCS / "reproduction.md").read_text(encoding="utf-8").split("## Table 2")[1]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| ")]
    table = [row for row in rows if len(row) == 2 + len(COLUMNS) and row[0] != "case"]
    assert len(table) == 4 * 11
    for case, method, *cells in table:
        for column, cell in zip(COLUMNS, cells, strict=True):
            ours, _, printed = cell.partition(" (")
            row = run[case, method, column]
            assert abs(float(row["mean"]) - float(ours)) <= (0.0005001 if column.startswith("inv") else 0.005001)
            assert bool(printed) == bool(row["paper"])
            assert not printed or float(printed.rstrip(")")) == float(row["paper"])
