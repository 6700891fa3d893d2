"""Verdicts follow from the figures: each claim holds on figures made so, and fails on others."""

from __future__ import annotations

import copy

import pytest

pytest.importorskip("torch")
pytest.importorskip("matplotlib")

from gmsnet.paper.claims import FAILS, HOLDS, IN_PART, claims, verdict

CASES = ("square", "circle", "airfoil", "pipe")
METHODS = {  # label → mean 1/q_V, least angle on the random cases, on the disturbed ones
    "Origin": (0.60, 1.0, 1.0),
    "LaplacianSmoothing": (0.77, 5.0, 20.0),
    "AngleSmoothing": (0.75, 6.0, 21.0),
    "CVTSmoothing": (0.74, 4.0, 22.0),
    "GETMeSmoothing": (0.70, 3.0, 40.0),
    "OptimSmoothing": (0.80, 9.0, 30.0),
    "NN-Smoothing": (0.78, 7.0, 25.0),
    "GMSNet": (0.795, 8.0, 26.0),
}


def row(label: str, case: str) -> dict:
    mean, random, disturbed = METHODS[label]
    columns = {"inv_q_mean": {"mean": mean, "difference": 0.005}}
    columns["min_angle_min"] = {"mean": random if case in CASES[:2] else disturbed}
    columns |= {name: {"mean": 0.0, "difference": 1.0} for name in ("min_angle_mean", "max_angle_mean")}
    return {"label": label, "columns": columns}


def loss(title: str, converged: int, swing: float) -> dict:
    return {
        "title": title, "trainings": 5, "converged": converged, "gain": [0.8] * 5, "swing": swing, "settled": 20.0,
        "worse": 0.0,
    }  # fmt: skip


@pytest.fixture
def document() -> dict:
    """Figures as the paper has them."""
    table1 = {"rotations": 1e-7, "permutations": 1e-7, "helped": {"3": 1.0, "50": 0.9}}
    raw = {
        "after 1 epoch": {"inverting": 300, "visits": 1000},
        "after the full training": {"inverting": 2, "visits": 1000},
    }
    return {
        "table1": {
            "rows": [{"label": "GMSNet", **table1}, {"label": "NN-Smoothing", **table1, "rotations": 0.02}],
            "degrees": {case: {"3": 1, "11": 2} for case in CASES},
            "parameters_share": 0.043,
        },
        "table2": {
            "rows": {case: [row(label, case) for label in METHODS] for case in CASES},
            "ratios": {
                "plain": {"cases": dict.fromkeys(CASES, 14.0), "mean": 14.0},
                "compiled": {"cases": dict.fromkeys(CASES, 5.0), "mean": 5.0},
            },
        },
        "table3": {
            case: {
                "cosine": {"columns": {"inv_q_mean": {"mean": 0.95}}},
                "metric": {"columns": {"inv_q_mean": {"mean": 0.955}}},
            }
            for case in ("pipe", "square")
        },
        "study": {
            "losses": {
                "metric": loss("MetricLoss", 5, 0.01),
                "q": loss("aspect ratio", 0, 0.9),
                "cosine": loss("cosine", 5, 0.02),
                "min-max-angle": loss("min-max angle", 1, 0.5),
            }
        },
        "raw_moves": {"training": raw, "test": raw},
    }  # fmt: skip


def verdicts(document) -> dict[str, str]:
    return {claim.title: claim.verdict for claim in claims(document)}


def changed(document, path, value) -> dict:
    other = copy.deepcopy(document)
    place = other
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return other


def test_on_the_papers_own_figures_every_claim_holds(document):
    found = verdicts(document)
    assert len(found) == 15
    assert set(found.values()) == {HOLDS}
    for claim in claims(document):
        assert claim.measured
        assert claim.paper


MEAN = ("columns", "inv_q_mean", "mean")
ROWS = ("table2", "rows")
LOSSES = ("study", "losses")
OPTIM, NN, GMSNET, GETME = 5, 6, 7, 4  # rows


@pytest.mark.parametrize(
    ("path", "value", "title", "expected"),
    [
        (("table1", "rows", 0, "helped"), {"3": 0.1, "50": 0.9}, "One model for all degrees", IN_PART),
        (("table1", "rows", 0, "permutations"), 0.1, "Unaffected by the order", IN_PART),
        ((*ROWS, "pipe", GMSNET, *MEAN), 0.5, "Works on shapes not seen", IN_PART),
        ((*ROWS, "square", GMSNET, "columns", "inv_q_mean", "difference"), 0.02, "GMSNet's figures", IN_PART),
        ((*ROWS, "square", OPTIM, *MEAN), 0.9, "Best or near-best mean", IN_PART),
        ((*ROWS, "square", OPTIM, *MEAN), 0.9, "Close to optimisation", IN_PART),
        ((*ROWS, "square", NN, *MEAN), 0.9, "Better than NN-Smoothing", IN_PART),
        (("table2", "ratios", "plain", "mean"), 10.0, "13.56 times as fast", IN_PART),
        (("table2", "ratios", "plain"), {"cases": dict.fromkeys(CASES, 0.9), "mean": 0.9}, "13.56 times", FAILS),
        ((*ROWS, "pipe", GETME, "columns", "min_angle_min", "mean"), 5.0, "GETMe best in the least angle", IN_PART),
        ((*LOSSES, "min-max-angle", "converged"), 5, "MetricLoss and cosine converge", IN_PART),
        ((*LOSSES, "metric", "swing"), 0.3, "Fast and stable convergence", IN_PART),
        ((*LOSSES, "metric", "converged"), 0, "No labels needed", FAILS),
        (("table3", "pipe", "cosine", "columns"), {}, "Cosine loss and MetricLoss give similar models", FAILS),
        (("raw_moves", "test", "after the full training", "inverting"), 900, "Truncation is needed", FAILS),
        (("raw_moves", "test", "after the full training", "inverting"), 0, "Truncation is needed", IN_PART),
    ],
)
def test_other_figures_give_other_verdicts(document, path, value, title, expected):
    found = [each for name, each in verdicts(changed(document, path, value)).items() if name.startswith(title)]
    assert found == [expected]


def test_heuristics_that_win(document):
    for case in CASES:
        for k in (1, 2, 3):
            document["table2"]["rows"][case][k]["columns"]["inv_q_mean"]["mean"] = 0.9
    assert verdicts(document)["Better than most heuristic methods"] == IN_PART


def test_only_claims_whose_figures_are_there(document):
    assert claims({}) == []
    assert len(claims({"table3": document["table3"]})) == 1


def test_all_some_none():
    assert [verdict(k, 3) for k in (3, 2, 0)] == [HOLDS, IN_PART, FAILS]
