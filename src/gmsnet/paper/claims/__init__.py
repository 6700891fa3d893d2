"""The paper's claims, each with what this reproduction measured and whether it holds: computed, not written down."""

from __future__ import annotations

from collections.abc import Callable

from gmsnet.paper.claims import learning, quality
from gmsnet.paper.claims.base import FAILS, HOLDS, IN_PART, Claim, Document, verdict

JUDGES: tuple[tuple[str, Callable[[Document], Claim]], ...] = (  # the part of the document that is needed, who judges
    ("table1", learning.one_model),
    ("table1", learning.order),
    ("table2", quality.unseen),
    ("table2", quality.values),
    ("table2", quality.best_mean),
    ("table2", quality.close_to_optimum),
    ("table2", quality.heuristics),
    ("table2", quality.better_than_nn),
    ("table2", quality.speed),
    ("table2", quality.getme),
    ("study", learning.labels),
    ("study", learning.losses),
    ("study", learning.fast),
    ("table3", learning.similar_losses),
    ("raw_moves", learning.truncation),
)


def claims(document: Document) -> list[Claim]:
    """Those that the parts in the document can speak to."""
    return [judge(document) for part, judge in JUDGES if part in document]


__all__ = ["FAILS", "HOLDS", "IN_PART", "Claim", "claims", "verdict"]
