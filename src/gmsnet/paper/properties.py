"""What Table 1 says of OptimSmoothing, NN-Smoothing and GMSNet, measured: degrees, input order, parameters."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

from gmsnet import weights
from gmsnet.paper import plain, timing
from gmsnet.paper.cases import CASES
from gmsnet.paper.contenders import GMSNET, NN, OPTIM, papers
from gmsnet.paper.plain import Move, Point
from gmsnet.paper.store import Result, Store
from gmsnet.paper.units import Context, Unit
from gmsnet.topology.topology import Topology

SHOWN = (OPTIM, NN, GMSNET)
DEGREES = (*range(3, 13), 20, 50, 100)
STARS = 10  # random ones of each degree
PERMUTATIONS = 50  # of each star's ring
UNIT = "properties"
SAME = 1e-4  # of the star's size: a larger change is more than single precision


def units() -> list[Unit]:
    """The one unit."""
    return [Unit(UNIT, measure)]


def measure(context: Context) -> Result:
    """Each method on random stars: how its answer changes with the order of the ring, and at which degrees it helps."""
    moves = timing.moves()
    values: dict[str, Any] = {}
    for name in SHOWN:
        move = moves[name]()
        turned: dict[int, float] = {}
        shuffled: dict[int, float] = {}
        helped: dict[int, float] = {}
        for degree in DEGREES:
            context.go_on()
            stars = [_star(degree, context.plan.seed + k) for k in range(1 if context.plan.quick else STARS)]
            turned[degree] = max(_change(move, x, ring, _rotations(ring)) for x, ring in stars)
            if name != OPTIM:  # which needs the triangles, and they follow from the order around the node
                shuffled[degree] = max(_change(move, x, ring, _permutations(ring)) for x, ring in stars)
            helped[degree] = sum(_helps(move, x, ring) for x, ring in stars) / len(stars)
        values[name] = {"rotations": turned, "permutations": shuffled, "helped": helped}
    values["parameters"] = {NN: weights.load(model="nn").parameters, GMSNET: weights.load().parameters}
    values["degrees"] = _degrees(context)
    return Result(values)


def _star(degree: int, seed: int) -> tuple[Point, list[Point]]:
    """A ring, counter-clockwise, and a free node well off its middle, from which the whole rim is seen."""
    rng = np.random.default_rng([seed, degree])
    around = (np.arange(degree) + rng.uniform(-0.2, 0.2, degree)) * 2.0 * math.pi / degree
    radius = rng.uniform(0.5, 1.5, degree)
    ring = [(float(r * math.cos(a)), float(r * math.sin(a))) for r, a in zip(radius, around, strict=True)]
    direction, reach = rng.uniform(0.0, 2.0 * math.pi), 1.0
    while True:  # no gap reaches half a turn, so from the middle all of the rim is seen, and this ends
        x = (reach * math.cos(direction), reach * math.sin(direction))
        if all(plain.area(x, a, b) > 0.0 for a, b in plain.edges(ring)):
            return x, ring
        reach *= 0.8


def _rotations(ring: list[Point]) -> Iterable[list[Point]]:
    return (ring[k:] + ring[:k] for k in range(1, len(ring)))


def _permutations(ring: list[Point]) -> Iterable[list[Point]]:
    rng = np.random.default_rng(len(ring))
    return ([ring[k] for k in rng.permutation(len(ring))] for _ in range(PERMUTATIONS))


def _change(move: Move, x: Point, ring: list[Point], others: Iterable[list[Point]]) -> float:
    """The largest distance between the answers to a ring in its order and in others, in sizes of the star."""
    first = move(x, ring)
    size = float(np.ptp([x, *ring], axis=0).max())
    return max(math.dist(first, move(x, other)) for other in others) / size


def _helps(move: Move, x: Point, ring: list[Point]) -> bool:
    """Is the star better after the truncated move?"""
    return plain.star_shape(plain.truncated(x, move(x, ring), ring), ring) > plain.star_shape(x, ring)


def _degrees(context: Context) -> dict[str, dict[int, int]]:
    """Case → degree → how many free nodes have it."""
    counted = {}
    for case in CASES:
        start, _ = Topology.of(CASES[case].mesh(0, context.plan.seed)).patches
        counted[case] = dict(sorted(Counter(np.diff(start).tolist()).items()))
    return counted


def document(store: Store) -> dict[str, Any]:
    """Table 1 as plain values."""
    found = store.load(UNIT)
    seconds = {case: timing.per_node(store, case) for case in CASES}
    keys = {each.printed: each.key for each in papers()}
    rows = []
    for name in SHOWN:
        plain_seconds = [seconds[case][keys[name]]["plain"] for case in CASES]
        compiled_seconds = [seconds[case][keys[name]]["compiled"] for case in CASES]
        rows.append(
            {
                "label": name,
                "seconds_plain": _mean(plain_seconds),
                "seconds_compiled": _mean(compiled_seconds),
                "parameters": found["parameters"].get(name),
                "rotations": max(found[name]["rotations"].values()),
                "permutations": max(found[name]["permutations"].values(), default=None),
                "helped": found[name]["helped"],
            }
        )
    share = found["parameters"][GMSNET] / found["parameters"][NN]
    return {"rows": rows, "degrees": found["degrees"], "parameters_share": share, "stars": STARS}


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return math.fsum(known) / len(known) if len(known) == len(values) else None
