"""The cells with a free node, by which meshes are compared: what they are like before and after."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from gmsnet.measure.totals import Totals


class Judged(NamedTuple):
    """Means and extremes over the cells with a free node; None where there are none."""

    before: Totals | None
    after: Totals | None

    def note(self, before: Totals | None, after: Totals | None, symbol: str) -> list[str]:
        """A sentence on them where a cell without a free node is the worst, else none.

        before, after: of all cells. symbol: how their shape is called.
        """
        first, last = self
        if first is None or last is None or before is None or after is None:
            return []
        if not (_held_is_worst(first, before) or _held_is_worst(last, after)):
            return []
        rows = [
            f"{symbol}, least {_change(first.shape_min, last.shape_min)}",
            f"mean {_change(first.shape_mean, last.shape_mean)}",
        ]
        if not math.isnan(first.qhat):
            rows.append(f"q-hat {_change(first.qhat, last.qhat)}")
        return [f"of the cells with a free node: {', '.join(rows)}; all nodes of a worse cell are held"]

    def price(self, symbol: str) -> list[str]:
        """A sentence on the mean where that of a valid mesh has fallen by more than DEAR for the least, else none."""
        first, last = self
        if first is None or last is None or first.inverted or last.shape_min <= first.shape_min:
            return []
        if last.shape_mean > first.shape_mean - DEAR:
            return []
        paid = f"the mean {symbol} fell from {first.shape_mean:.4f} to {last.shape_mean:.4f}"
        gained = f"for the least, {_change(first.shape_min, last.shape_min)}"
        return [f"{paid} {gained}; with target_quality only cells that miss it, and those around them, are smoothed"]

    def summary(self) -> dict[str, Any]:
        """Plain numbers, ready for JSON."""
        return {name: None if totals is None else _plain(totals) for name, totals in self._asdict().items()}


UNKNOWN = Judged(None, None)
DEAR = 0.02
ROUNDING = 1e-9  # in a 1/q: so far two ways to measure it may be apart


def _held_is_worst(free: Totals, every: Totals) -> bool:
    """Is a cell without a free node worse than all that have one?"""
    return free.shape_min > every.shape_min + ROUNDING


def _change(before: float, after: float) -> str:
    return f"{before:.4f} before, {after:.4f} after"


def _plain(totals: Totals) -> dict[str, float | None]:
    known = {"least": totals.shape_min, "mean": totals.shape_mean, "qhat": totals.qhat}
    return {name: None if math.isnan(value) else value for name, value in known.items()}
