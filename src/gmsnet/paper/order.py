"""In which order the methods stand, ours and the paper's side by side."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

from scipy.stats import kendalltau


@dataclass(frozen=True)
class Order:
    """ours, papers: names, the best first. tau: Kendall's rank correlation (τ_b, which minds ties), nan where one of
    the two has all methods equal. against: pairs (better here, worse here) that the paper has the other way round, of
    those that differ in what the paper prints."""

    ours: list[str]
    papers: list[str]
    tau: float
    against: list[tuple[str, str]]


def compare(ours: Mapping[str, float], papers: Mapping[str, float]) -> Order:
    """Two measures of the same methods, larger ones better."""
    names = list(papers)
    tau = float(kendalltau([ours[name] for name in names], [papers[name] for name in names]).statistic)
    against = []
    for a, b in itertools.combinations(names, 2):
        better, worse = (a, b) if ours[a] > ours[b] else (b, a)
        if ours[better] > ours[worse] and papers[better] < papers[worse]:
            against.append((better, worse))
    return Order(_ranked(ours, names), _ranked(papers, names), tau if math.isfinite(tau) else math.nan, against)


def _ranked(values: Mapping[str, float], names: list[str]) -> list[str]:
    return sorted(names, key=lambda name: -values[name])
