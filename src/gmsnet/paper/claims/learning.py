"""The claims on the network and its training: Tables 1 and 3, the losses, and truncation."""

from __future__ import annotations

from gmsnet.paper.claims.base import CLOSE, FAILS, Claim, Document, table1, verdict
from gmsnet.paper.contenders import GMSNET, NN

EXACT = 1e-4  # of the star's size: networks compute in single precision
RARE = 0.05  # of the shifts


def one_model(document: Document) -> Claim:
    """One set of weights for all degrees."""
    degrees = sorted({int(d) for counts in document["table1"]["degrees"].values() for d in counts})
    helped = {int(d): share for d, share in table1(document, GMSNET)["helped"].items()}
    good = [d for d, share in helped.items() if share > 0.5]
    others = ", ".join(str(d) for d in sorted(set(helped) - set(good)))
    return Claim(
        "One model for all degrees",
        "GMSNet smooths nodes of any degree; NN-Smoothing needs a network for each, and Laplacian beyond degree 9.",
        f"The cases have free nodes of degree {degrees[0]} to {degrees[-1]}. One set of weights improved most of the "
        f"random stars of {len(good)} of {len(helped)} degrees from {min(helped)} to {max(helped)}"
        + (f" (not of {others})." if len(good) < len(helped) else "."),
        verdict(len(good), len(helped)),
    )


def order(document: Document) -> Claim:
    """Rotations and permutations of the ring."""
    ours, nn = table1(document, GMSNET), table1(document, NN)
    worst = max(ours["rotations"], ours["permutations"])
    return Claim(
        "Unaffected by the order of the input",
        "GMSNet's answer does not depend on the order of the neighbours; NN-Smoothing's does, hence its augmentation.",
        f"Over rotations and permutations of random rings GMSNet's answer changes by at most {worst:.1e} of the "
        f"star's size, NN-Smoothing's by up to {nn['rotations']:.2g} over rotations.",
        verdict(int(worst < EXACT) + int(nn["rotations"] > EXACT), 2),
    )


def losses(document: Document) -> Claim:
    """Which of the four train."""
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


def fast(document: Document) -> Claim:
    """How soon and how steadily MetricLoss trains."""
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


def labels(document: Document) -> Claim:
    """Training by the metric alone."""
    metric = document["study"]["losses"]["metric"]
    gains = [gain for gain in metric["gain"] if gain is not None]
    return Claim(
        "No labels needed",
        "GMSNet learns from the quality metric alone; NN-Smoothing learns from meshes that OptimSmoothing made.",
        f"Without a label {metric['converged']} of {metric['trainings']} trainings converge, and go "
        f"{min(gains, default=0):.0%} to {max(gains, default=0):.0%} of the way from no move to each star's optimum.",
        verdict(metric["converged"], metric["trainings"]),
    )


def similar_losses(document: Document) -> Claim:
    """Table 3."""
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


def truncation(document: Document) -> Claim:
    """Raw shifts during and after training."""
    facts = document["raw_moves"]
    shares = {
        stage: sum(facts[kind][stage]["inverting"] for kind in facts)
        / sum(facts[kind][stage]["visits"] for kind in facts)
        for stage in facts["test"]
    }
    first, *_, last = shares
    held = [shares[first] > shares[last], 0.0 < shares[last] < RARE]
    return Claim(
        "Truncation is needed; inversions become rare but remain",
        "Many raw shifts invert cells after the first epoch, fewer later, and now and then one does after training.",
        "Shifts that would leave a negative triangle: "
        + ", ".join(f"{share:.2%} {stage}" for stage, share in shares.items())
        + ".",
        verdict(sum(held), len(held)),
    )
