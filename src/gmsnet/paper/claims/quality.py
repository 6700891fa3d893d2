"""The claims on quality and speed: Table 2."""

from __future__ import annotations

from gmsnet.paper import printed
from gmsnet.paper.claims.base import CLOSE, FAILS, HOLDS, IN_PART, Claim, Document, row, value, verdict
from gmsnet.paper.contenders import GETME, GMSNET, LAPLACIAN, NN, OPTIM

CLOSE_ANGLE = 1.5  # degrees
HEURISTICS = (LAPLACIAN, "AngleSmoothing", "CVTSmoothing", GETME)
DISTURBED, RANDOM = ("airfoil", "pipe"), ("square", "circle")


def unseen(document: Document) -> Claim:
    """Circle, airfoil and pipe."""
    parts, better = [], 0
    for case in ("circle", "airfoil", "pipe"):
        before, after = value(document, case, printed.ORIGIN), value(document, case, GMSNET)
        better += after > before
        parts.append(f"{case} {before:.3f} → {after:.3f}")
    return Claim(
        "Works on shapes not seen in training",
        "Trained on squares alone, GMSNet improves circle, airfoil and pipe.",
        f"Mean 1/q_V: {', '.join(parts)}.",
        verdict(better, 3),
    )


def values(document: Document) -> Claim:
    """The printed means of the random cases."""
    parts, near = [], 0
    for case in RANDOM:
        columns = row(document, case, GMSNET)["columns"]
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


def best_mean(document: Document) -> Claim:
    """Against the best of all methods."""
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


def close_to_optimum(document: Document) -> Claim:
    """Against OptimSmoothing."""
    cases = list(document["table2"]["rows"])
    gaps = {case: value(document, case, OPTIM) - value(document, case, GMSNET) for case in cases}
    return Claim(
        "Close to optimisation",
        "GMSNet's quality closely approximates that of OptimSmoothing.",
        "OptimSmoothing less GMSNet in mean 1/q_V: "
        + ", ".join(f"{case} {gap:+.4f}" for case, gap in gaps.items())
        + f"; close means at most {CLOSE}.",
        verdict(sum(gap <= CLOSE for gap in gaps.values()), len(gaps)),
    )


def heuristics(document: Document) -> Claim:
    """Against the four classical methods."""
    cases = list(document["table2"]["rows"])
    won = {
        name: sum(value(document, case, GMSNET) >= value(document, case, name) for case in cases) for name in HEURISTICS
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


def better_than_nn(document: Document) -> Claim:
    """Quality and parameters."""
    cases = list(document["table2"]["rows"])
    pairs = {case: (value(document, case, GMSNET), value(document, case, NN)) for case in cases}
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


def speed(document: Document) -> Claim:
    """Seconds per node."""
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


def getme(document: Document) -> Claim:
    """Its least angle on good and on bad connectivity."""
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
