"""The arithmetic: what a tool needs for a figure, and how many times as fast another one is there.

A record is what worker.py writes of a tool on a mesh: its ``levels`` with ascending efforts, the last of which gave its
final state. A level has ``seconds``, and ``units``, the same in L.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SHARE = 0.99  # of a tool's final figure, that counts as reaching it
MEAN, MIN, QHAT = "mean", "min", "qhat"

Record = Mapping[str, Any]


def usable(record: Record | None) -> bool:
    """Whether a tool was measured, and left the mesh as one with the same nodes."""
    return record is not None and record["status"] == "measured" and final(record) is not None


def final(record: Record) -> Mapping[str, float] | None:
    """The figures of the final state."""
    figures: Mapping[str, float] | None = record["levels"][-1]["figures"]
    return figures


def goal(record: Record, key: str, before: Mapping[str, float]) -> float | None:
    """The figure that counts as this tool's, or None where it does not better the input.

    Of mean and least 1/q it is SHARE of the final one, of q̂, which may be negative, the final one itself. A least 1/q
    that is not positive is not taken for bettered.
    """
    reached = (final(record) or {})[key]
    if reached <= before[key] or (key != QHAT and reached <= 0.0):
        return None
    return reached if key == QHAT else SHARE * reached


def level_to(record: Record, key: str, value: float) -> Mapping[str, Any] | None:
    """The level with the least effort that brings the figure to the value; None if none does."""
    for level in record["levels"]:
        if level["figures"] is not None and level["figures"][key] >= value:
            return dict(level)
    return None


def pair(theirs: Record, ours: Record, before: Mapping[str, float]) -> dict[str, dict[str, Any]]:
    """One tool against one of ours on a mesh: for each figure the goal, the seconds of both to it, and ratios.

    Ratios are of times in L, each beside its own runs. times: to the goal, both. times_whole: all that the tool did,
    to its final state, against ours to the goal.
    """
    whole = theirs["levels"][-1]
    found: dict[str, dict[str, Any]] = {}
    for key in (MEAN, MIN, QHAT):
        wanted = goal(theirs, key, before)
        if wanted is None:
            found[key] = {"goal": None, "times": None}
            continue
        its, mine = level_to(theirs, key, wanted), level_to(ours, key, wanted)
        found[key] = {
            "goal": wanted,
            "in_input": before[key] >= wanted,
            "theirs": its and its["seconds"],
            "ours": mine and mine["seconds"],
            "times": its and mine and its["units"] / mine["units"],
            "times_whole": mine and whole["units"] / mine["units"],
        }
    return found


def better(ours: Record, theirs: Record) -> dict[str, bool]:
    """Whether our final least 1/q and q̂ are better than the tool's."""
    mine, its = final(ours) or {}, final(theirs) or {}
    return {key: mine[key] > its[key] for key in (MIN, QHAT)}
