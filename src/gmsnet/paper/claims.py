"""The paper's claims, each with what this reproduction measured and whether it holds: computed, not written down."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from gmsnet.paper import printed
from gmsnet.paper.contenders import GETME, GMSNET, LAPLACIAN, NN, OPTIM

HOLDS, IN_PART, FAILS = "holds", "holds in part", "does not hold"
CLOSE = 0.01  # in mean 1/q_V
CLOSE_ANGLE = 1.5  # degrees
EXACT = 1e-4  # of the star's size: networks compute in single precision
HEURISTICS = (LAPLACIAN, "AngleSmoothing", "CVTSmoothing", GETME)
DISTURBED, RANDOM = ("airfoil", "pipe"), ("square", "circle")

Document = Mapping[str, Any]


@dataclass(frozen=True)
class Claim:
    """title: the claim. paper: what it says. measured: what we found. verdict: one of the three."""

    title: str
    paper: str
    measured: str
    verdict: str


def claims(document: Document) -> list[Claim]:
    """Those that the parts in the document can speak to."""
    found = []
    for needs, judge in _JUDGES:
        if all(part in document for part in needs):
            found.append(judge(document))
    return found


def verdict(held: int, of: int) -> str:
    """All, some or none."""
    return HOLDS if held == of else IN_PART if held else FAILS


def _one_model(document: Document) -> Claim:
    degrees = sorted({int(d) for counts in document["table1"]["degrees"].values() for d in counts})
    helped = {int(d): share for d, share in _table1(document, GMSNET)["helped"].items()}
    good = [d for d, share in helped.items() if share > 0.5]
    return Claim(
        "One model for all degrees",
        "GMSNet smooths nodes of any degree; NN-Smoothing needs a network for each, and Laplacian beyond degree 9.",
        f"The cases have free nodes of degree {degrees[0]} to {degrees[-1]}. One set of weights improved most of the "
        f"random stars of {len(good)} of {len(helped)} degrees from {min(helped)} to {max(helped)}"
        + (f" (not of {_list(set(helped) - set(good))})." if len(good) < len(helped) else "."),
        verdict(len(good), len(helped)),
    )


def _order(document: Document) -> Claim:
    ours, nn = _table1(document, GMSNET), _table1(document, NN)
    worst = max(ours["rotations"], ours["permutations"])
    return Claim(
        "Unaffected by the order of the input",
        "GMSNet's answer does not depend on the order of the neighbours; NN-Smoothing's does, hence its augmentation.",
        f"Over rotations and permutations of random rings GMSNet's answer changes by at most {worst:.1e} of the "
        f"star's size, NN-Smoothing's by up to {nn['rotations']:.2g} over rotations.",
        verdict(int(worst < EXACT) + int(nn["rotations"] > EXACT), 2),
    )


def _unseen(document: Document) -> Claim:
    parts, better = [], 0
    for case in ("circle", "airfoil", "pipe"):
        before, after = _value(document, case, printed.ORIGIN), _value(document, case, GMSNET)
        better += after > before
        parts.append(f"{case} {before:.3f} → {after:.3f}")
    return Claim(
        "Works on shapes not seen in training",
        "Trained on squares alone, GMSNet improves circle, airfoil and pipe.",
        f"Mean 1/q_V: {', '.join(parts)}.",
        verdict(better, 3),
    )


def _values(document: Document) -> Claim:
    parts, near = [], 0
    for case in RANDOM:
        columns = _row(document, case, GMSNET)["columns"]
        off = columns["inv_q_mean"]["difference"]
        angles = [columns[name]["difference"] for name in ("min_angle_mean", "max_angle_mean")]
        near += abs(off) <= CLOSE and max(map(abs, angles)) <= CLOSE_ANGLE
        parts.append(f"{case} {off:+.3f} in mean 1/q_V, {angles[0]:+.2f}° and {angles[1]:+.2f}° in the mean angles")
    return Claim(
        "GMSNet's figures on random meshes",
        "Mean 1/q_V 0.79 on the square and 0.78 on the circle.",
        f"Ours less the paper's: {'; '.join(parts)} (meant: within {CLOSE} and {CLOSE_ANGLE}°).",
        verdict(near, len(RANDOM)),
    )


def _best_mean(document: Document) -> Claim:
    parts, near = [], 0
    for case, rows in document["table2"]["rows"].items():
        means = {row["label"]: row["columns"]["inv_q_mean"]["mean"] for row in rows if row["label"] != printed.ORIGIN}
        best = max(means, key=lambda name: means[name])
        near += means[GMSNET] >= means[best] - CLOSE
        parts.append(f"{case} {means[GMSNET]:.3f} (best: {best} {means[best]:.3f})")
    return Claim(
        "Best or near-best mean 1/aspect ratio",
        "GMSNet is best on square, circle and airfoil and second on the pipe, 0.01 behind.",
        f"Mean 1/q_V: {'; '.join(parts)}; near-best means within {CLOSE}.",
        verdict(near, len(parts)),
    )


def _close_to_optimum(document: Document) -> Claim:
    cases = list(document["table2"]["rows"])
    gaps = {case: _value(document, case, OPTIM) - _value(document, case, GMSNET) for case in cases}
    return Claim(
        "Close to optimisation",
        "GMSNet's quality closely approximates that of OptimSmoothing.",
        "OptimSmoothing less GMSNet in mean 1/q_V: "
        + ", ".join(f"{case} {gap:+.4f}" for case, gap in gaps.items())
        + f"; close means at most {CLOSE}.",
        verdict(sum(gap <= CLOSE for gap in gaps.values()), len(gaps)),
    )


def _heuristics(document: Document) -> Claim:
    cases = list(document["table2"]["rows"])
    won = {
        name: sum(_value(document, case, GMSNET) >= _value(document, case, name) for case in cases)
        for name in HEURISTICS
    }
    beaten = [name for name, count in won.items() if count > len(cases) / 2]
    return Claim(
        "Better than most heuristic methods",
        "GMSNet outperforms most of Laplacian, angle-based, CVT and GETMe smoothing.",
        "At least as good a mean 1/q_V on so many of the cases: "
        + ", ".join(f"{name} {count} of {len(cases)}" for name, count in won.items())
        + ".",
        HOLDS if len(beaten) > len(HEURISTICS) / 2 else IN_PART if beaten else FAILS,
    )


def _better_than_nn(document: Document) -> Claim:
    cases = list(document["table2"]["rows"])
    pairs = {case: (_value(document, case, GMSNET), _value(document, case, NN)) for case in cases}
    share = document.get("table1", {}).get("parameters_share")
    size = "" if share is None else f" GMSNet has {share:.1%} of NN-Smoothing's parameters."
    held = [share <= printed.PARAMETERS_SHARE] if share is not None else []
    held += [ours >= nn for ours, nn in pairs.values()]
    return Claim(
        "Better than NN-Smoothing with 5% of its parameters",
        "GMSNet generally outperforms NN-Smoothing.",
        "Mean 1/q_V, GMSNet against NN-Smoothing: "
        + ", ".join(f"{case} {ours:.4f} : {nn:.4f}" for case, (ours, nn) in pairs.items())
        + f".{size}",
        verdict(sum(held), len(held)),
    )


def _speed(document: Document) -> Claim:
    plain, compiled = (document["table2"]["ratios"][name] for name in ("plain", "compiled"))
    ratios = ", ".join(f"{case} {value:.2f} ({printed.SPEED_RATIO[case]})" for case, value in plain["cases"].items())
    faster = sum(value > 1.0 for value in plain["cases"].values())
    return Claim(
        "13.56 times as fast as OptimSmoothing on average",
        f"On the four cases {', '.join(str(value) for value in printed.SPEED_RATIO.values())}, all in plain Python.",
        f"In the paper's setting {plain['mean']:.2f} on average; by case, with the paper's in brackets: {ratios}. "
        f"Compiled, on one thread: {compiled['mean']:.2f}.",
        HOLDS if plain["mean"] >= printed.MEAN_SPEED_RATIO else IN_PART if faster == len(plain["cases"]) else FAILS,
    )


def _getme(document: Document) -> Claim:
    parts, held = [], 0
    for case, rows in document["table2"]["rows"].items():
        angles = {row["label"]: row["columns"]["min_angle_min"]["mean"] for row in rows}
        angles.pop(printed.ORIGIN)
        ranked = sorted(angles, key=lambda name: -angles[name])
        held += (ranked[0] == GETME) == (case in DISTURBED)
        parts.append(
            f"{case} {angles[GETME]:.2f}° (place {ranked.index(GETME) + 1}, best {ranked[0]} {angles[ranked[0]]:.2f}°)"
        )
    return Claim(
        "GETMe best in the least angle where the connectivity is good, not where it is bad",
        "GETMe has the largest least angle on airfoil and pipe, but not on square and circle.",
        f"GETMe's least angle: {'; '.join(parts)}.",
        verdict(held, len(parts)),
    )


def _losses(document: Document) -> Claim:
    found = document["study"]["losses"]
    expected = {"metric": True, "cosine": True, "q": False, "min-max-angle": False}
    agree = sum((each["converged"] > each["trainings"] / 2) == expected[loss] for loss, each in found.items())
    return Claim(
        "MetricLoss and cosine converge, aspect ratio and min-max angle fail",
        "With min-max angle and aspect ratio the training fails in the first epochs or oscillates.",
        "Trainings that converge: "
        + ", ".join(f"{each['title']} {each['converged']} of {each['trainings']}" for each in found.values())
        + ". After the first epochs so many are worse than no move at all (median): "
        + ", ".join(f"{each['title']} {each['worse']:.0%}" for each in found.values() if each["worse"] is not None)
        + ".",
        verdict(agree, len(expected)),
    )


def _fast(document: Document) -> Claim:
    metric = document["study"]["losses"]["metric"]
    swings = {loss: each["swing"] for loss, each in document["study"]["losses"].items() if each["swing"] is not None}
    steadiest = min(swings, key=lambda loss: swings[loss])
    settled = "-" if metric["settled"] is None else f"{metric['settled']:.0f}"
    held = [metric["converged"] == metric["trainings"], steadiest == "metric"]
    return Claim(
        "Fast and stable convergence with MetricLoss",
        "The model converges within several iterations, and MetricLoss is remarkably stable.",
        f"{metric['converged']} of {metric['trainings']} trainings converge; 90% of the final gain are kept "
        f"from epoch {settled} on (median). Swing of the second half, as a share of the way to the optimum (median): "
        + ", ".join(f"{document['study']['losses'][loss]['title']} {swing:.1%}" for loss, swing in swings.items())
        + ".",
        verdict(sum(held), len(held)),
    )


def _similar_losses(document: Document) -> Claim:
    parts, near = [], 0
    for case, losses in document["table3"].items():
        columns = [losses[loss]["columns"] for loss in ("cosine", "metric")]
        if not all(columns):
            return Claim("Cosine loss and MetricLoss give similar models", "", "a loss has no finished training", FAILS)
        gap = columns[0]["inv_q_mean"]["mean"] - columns[1]["inv_q_mean"]["mean"]
        near += abs(gap) <= CLOSE
        parts.append(f"{case} {gap:+.4f}")
    return Claim(
        "Cosine loss and MetricLoss give similar models",
        "On pipe and square the two models perform alike (Table 3).",
        f"Cosine less MetricLoss in mean 1/q_V: {', '.join(parts)}.",
        verdict(near, len(parts)),
    )


def _truncation(document: Document) -> Claim:
    facts = document["raw_moves"]
    shares = {
        stage: sum(facts[kind][stage]["inverting"] for kind in facts)
        / sum(facts[kind][stage]["visits"] for kind in facts)
        for stage in facts["test"]
    }
    first, *_, last = shares
    held = [shares[first] > shares[last], 0.0 < shares[last] < 0.05]
    return Claim(
        "Truncation is needed; inversions become rare but remain",
        "Many raw shifts invert cells after the first epoch, fewer later, and now and then one does after training.",
        "Shifts that would leave a negative triangle: "
        + ", ".join(f"{share:.2%} {stage}" for stage, share in shares.items())
        + ".",
        verdict(sum(held), len(held)),
    )


_JUDGES: tuple[tuple[tuple[str, ...], Callable[[Document], Claim]], ...] = (
    (("table1",), _one_model),
    (("table1",), _order),
    (("table2",), _unseen),
    (("table2",), _values),
    (("table2",), _best_mean),
    (("table2",), _close_to_optimum),
    (("table2",), _heuristics),
    (("table2",), _better_than_nn),
    (("table2",), _speed),
    (("table2",), _getme),
    (("study",), _losses),
    (("study",), _fast),
    (("table3",), _similar_losses),
    (("raw_moves",), _truncation),
)


def _table1(document: Document, label: str) -> Mapping[str, Any]:
    row: Mapping[str, Any] = next(row for row in document["table1"]["rows"] if row["label"] == label)
    return row


def _row(document: Document, case: str, label: str) -> Mapping[str, Any]:
    row: Mapping[str, Any] = next(row for row in document["table2"]["rows"][case] if row["label"] == label)
    return row


def _value(document: Document, case: str, label: str, column: str = "inv_q_mean") -> float:
    return float(_row(document, case, label)["columns"][column]["mean"])


def _list(values: Any) -> str:
    return ", ".join(str(value) for value in sorted(values))
