"""What is computed from results: orders, spreads, verdicts about trainings, and the paper's own figures."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.stats import kendalltau

from gmsnet.paper import order, printed


def test_the_papers_tables_are_whole():
    table = printed.table2()
    assert len(table) == 4 * 8
    names = {name for _, name in table}
    assert all((case, name) in table for case in printed.SPEED_RATIO for name in names)
    assert table["square", "GMSNet"].values["inv_q_mean"] == 0.79
    assert table["pipe", "GETMeSmoothing"].values["max_angle_max"] == 93.51
    assert table["airfoil", "Origin"].seconds_per_node is None
    third = printed.table3()
    assert sorted(third) == sorted(itertools.product(("pipe", "square"), ("cosine", "metric")))
    assert third["square", "cosine"].values["min_angle_min"] == 11.04


def test_the_papers_ratios_are_those_of_its_seconds():
    table = printed.table2()
    for case, ratio in printed.SPEED_RATIO.items():
        slow, fast = (table[case, name].seconds_per_node for name in ("OptimSmoothing", "GMSNet"))
        assert slow / fast == pytest.approx(ratio, abs=0.01)
    assert np.mean(list(printed.SPEED_RATIO.values())) == pytest.approx(printed.MEAN_SPEED_RATIO, abs=0.02)


def test_orders_that_agree():
    found = order.compare({"a": 3.0, "b": 2.0, "c": 1.0}, {"a": 0.9, "b": 0.8, "c": 0.7})
    assert found.ours == found.papers == ["a", "b", "c"]
    assert found.tau == pytest.approx(1)
    assert found.against == []


def test_pairs_that_disagree_are_named_and_ties_are_not():
    found = order.compare({"a": 3.0, "b": 2.0, "c": 1.0}, {"a": 0.8, "b": 0.8, "c": 0.9})
    assert found.papers == ["c", "a", "b"]
    assert found.against == [("a", "c"), ("b", "c")]
    assert found.tau < 0


def test_tau_against_its_definition_without_ties():
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = rng.permutation(6), rng.permutation(6)
        names = [str(k) for k in range(6)]
        found = order.compare(dict(zip(names, a, strict=True)), dict(zip(names, b, strict=True)))
        assert found.tau == pytest.approx(1 - 2 * len(found.against) / 15)
        assert found.tau == pytest.approx(kendalltau(a, b).statistic)
    assert math.isnan(order.compare({"a": 1.0, "b": 2.0}, {"a": 1.0, "b": 1.0}).tau)
