"""Adapted meshes and graded ones: how near do nodes that were thrown come to the metric, or to the sizes, again?

    python benchmarks/metric.py [--meshes 60] [--seed 0] [--parts adapted size even] [--json FILE]

*adapted*: so many meshes made for a metric with a bent front inside (``gmsnet.generate.Front``: aspects of 2 to 50, 300
to 3,000 nodes), turned by any angle. Free nodes are thrown by up to half their shortest edge; every sixth mesh is left
as it was made. Each is smoothed with ``preserve="metric"``, with the metric as a function and as values at the thrown
nodes, and, to compare, with the defaults and with ``preserve="none"``. All are judged by the metric that the mesh was
made for: the share of edges that are within ±20 % of 1 long in it, the least quality of shape and size
(kernels/metric/quality.py), the least 1/q of shape alone. A mesh passes if no cell is inverted, and the share and the
least quality are not below those of its input.

*size*: squares for lengths h of edges that vary ten times, four functions. Nodes start as they were made, thrown by 0.4
edges, each at the mean of its neighbours (Tutte), turned about the middle, or anywhere (tangled). Told is the share of
edges within ±20 % of h. It passes with 95 % and without an inverted cell.

*even*: meshes of even cells smoothed towards the same h. Neither their connectivity nor their boundary is made for it,
so that most edges cannot have it: what comes of it is told, and nothing is asked for.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np
from machine import describe
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import spsolve

import gmsnet
from gmsnet.errors import InputError
from gmsnet.generate import Curve, Front, disturb, good_mesh, random_mesh, settle, sheared_mesh
from gmsnet.topology.topology import Topology

NEAR = 0.95
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
SIDES = [Curve(CORNERS[[k, (k + 1) % 4]], name) for k, name in enumerate(("bottom", "right", "top", "left"))]
SIZES = {
    "left to right, by one factor": lambda p: 0.01 * 10.0 ** p[:, 0],
    "left to right, linear": lambda p: 0.008 + 0.072 * p[:, 0],
    "from a point": lambda p: 0.008 + 0.072 * np.minimum(1.0, 2.0 * np.hypot(p[:, 0] - 0.5, p[:, 1] - 0.5)),
    "from a bent front": lambda p: (
        0.008 + 0.072 * np.minimum(1.0, 2.5 * np.abs(p[:, 0] - 0.5 - 0.1 * np.sin(2.0 * math.pi * p[:, 1])))
    ),
}


def drawn(number, seed):
    """A mesh as it was made, as it was thrown, its metric, and what makes it."""
    rng = np.random.default_rng([seed, number])
    while True:
        aspect, nodes = math.exp(rng.uniform(math.log(2.0), math.log(50.0))), math.exp(rng.uniform(5.7, 8.0))
        width, bend = rng.uniform(0.04, 0.15), rng.uniform(0.0, 0.1)
        front = Front(0.1, aspect, width, bend)
        try:
            front = Front(min(0.2, math.sqrt(front.length / (0.866 * nodes))), aspect, width, bend)
            made = front.mesh()
            break
        except InputError:  # such cells cannot follow such a front
            continue
    angle = rng.uniform(0.0, math.pi)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def metric(points):
        a, b, c = front.metric(points @ turn).T
        tensors = turn @ np.array([[a, b], [b, c]]).transpose(2, 0, 1) @ turn.T
        return np.column_stack([tensors[:, 0, 0], tensors[:, 0, 1], tensors[:, 1, 1]])

    made = made.with_points(made.points @ turn.T)
    jitter = 0.0 if number % 6 == 0 else rng.uniform(0.1, 0.5)
    thrown = disturb(made, Topology.of(made).free, jitter, seed=number, edge="shortest") if jitter else made
    return made, thrown, metric, f"aspect {aspect:4.1f}, {len(made.points):5,} nodes, thrown by {jitter:.2f}"


def judged(mesh, metric):
    """By the metric that the mesh was made for: share of edges within 20 % of 1, least quality, least 1/q of shape
    alone, mean quality, and share of quasi-unit edges."""
    found = gmsnet.smooth(mesh, metric=metric, max_sweeps=0).conformity.before
    corners = mesh.points[mesh.cells[0].nodes]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    m11, m12, m22 = metric(corners.mean(axis=1)).T
    total = sum(m11 * e[:, 0] ** 2 + 2.0 * m12 * e[:, 0] * e[:, 1] + m22 * e[:, 1] ** 2 for e in (a, b, b - a))
    shape = 2.0 * math.sqrt(3.0) * np.sqrt(m11 * m22 - m12**2) * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / total
    return found.near_one, found.least, float(shape.min()), found.mean, found.quasi_unit


def adapted(options):
    """The part of this name."""
    ways = {
        "preserve='metric'": lambda metric, points: {"preserve": "metric"},
        "metric, a function": lambda metric, points: {"metric": metric},
        "metric at nodes": lambda metric, points: {"metric": metric(points)},
        "defaults": lambda metric, points: {},
        "preserve='none'": lambda metric, points: {"preserve": "none"},
    }
    rows = []
    for number in range(options.meshes):
        made, thrown, metric, what = drawn(number, options.seed)
        row = {"what": what, "made": judged(made, metric), "input": judged(thrown, metric)}
        for name, way in ways.items():
            began = time.process_time()
            result = gmsnet.smooth(thrown, **way(metric, thrown.points), threads=1)
            seconds = time.process_time() - began
            figures = judged(result.mesh, metric)
            better = [a >= b for a, b in zip(figures, row["input"], strict=True)]
            passes = [not result.after.inverted and better[1] and better[k] for k in (0, 4)]
            row[name] = [*figures, *passes, seconds, int(result.after.inverted)]
        rows.append(row)
        shown = "   ".join(f"{name} {row[name][0]:.3f} {row[name][1]:.3f}" for name in ("made", "input", *ways))
        print(f"{number:4} {what}: {shown}", flush=True)
    for kind, chosen in (("as made", 0), ("thrown", 1)):
        some = [row for k, row in enumerate(rows) if (k % 6 != 0) == bool(chosen)]
        print(
            f"\n{len(some)} meshes {kind}, means (least): edges near 1, least quality, least 1/q in it, mean quality, "
            "quasi-unit edges; how many are no worse, with these edges, with those"
        )
        for name in ("made", "input", *ways):
            figures = np.array([row[name][:5] for row in some])
            text = "   ".join(f"{figures[:, k].mean():.3f} ({figures[:, k].min():.3f})" for k in range(5))
            if name in ways:
                near, unit, seconds, inverted = (sum(row[name][k] for row in some) for k in range(5, 9))
                text += (
                    f"   {near:2} and {unit:2} of {len(some)}, {inverted} inverted, {seconds / len(some):.2f} s each"
                )
            print(f"  {name:20} {text}")
    return rows


def harmonic(mesh, topology):
    """Each free node at the mean of its neighbours."""
    ends = np.concatenate([topology.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    ends = np.concatenate([ends, ends[:, ::-1]])
    count = len(mesh.points)
    graph = csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    graph.data[:] = 1.0
    laplacian = (diags_array(graph.sum(axis=1)) - graph).tocsr()
    free, points = topology.free, mesh.points.copy()
    held = np.setdiff1d(np.arange(count), free)
    points[free] = spsolve(laplacian[free][:, free].tocsc(), -laplacian[free][:, held] @ points[held])
    return mesh.with_points(points)


def starts(mesh, topology):
    """Where nodes start."""
    yield "as made", mesh
    yield "thrown", disturb(mesh, topology.free, 0.4, seed=1)
    yield "harmonic", harmonic(mesh, topology)
    away = mesh.points - 0.5
    turned = 2.0 * np.clip(1.0 - 2.0 * np.hypot(*away.T), 0.0, 1.0)
    cosine, sine = np.cos(turned), np.sin(turned)
    places = np.column_stack([cosine * away[:, 0] - sine * away[:, 1], sine * away[:, 0] + cosine * away[:, 1]]) + 0.5
    yield "turned", mesh.with_points(places)
    points = mesh.points.copy()
    points[topology.free] = np.random.default_rng(0).random((len(topology.free), 2))
    yield "anywhere", mesh.with_points(points)


def smoothed_towards(name, start, mesh, size, *, slide=False):
    """One line, and its figures."""
    began = time.process_time()
    result = gmsnet.smooth(mesh, size=size, threads=1, slide=slide or None)
    seconds = time.process_time() - began
    before, after = result.conformity
    passes = after.near_one >= NEAR and not result.after.inverted
    shape = result.after.shape.min()
    inverted = f"{result.before.inverted:,} → {result.after.inverted}"
    print(
        f"  {name:30} {start:12} {len(mesh.points):6,} nodes: edges near h "
        f"{before.near_one:.3f} → {after.near_one:.3f}, near their mean {after.near_mean:.3f}, "
        f"least quality {before.least:.3f} → {after.least:.3f}, "
        f"least 1/q {shape:.3f}, inverted {inverted}, {seconds:.2f} s",
        flush=True,
    )
    return {"name": name, "start": start, "near": after.near_one, "passes": passes, "seconds": seconds}


def size(options):
    """The part of this name."""
    rows = []
    for name, length in SIZES.items():
        mesh = good_mesh([SIDES], length)
        topology = Topology.of(mesh)
        rows += [smoothed_towards(name, start, each, length) for start, each in starts(mesh, topology)]
    print(f"  {sum(row['passes'] for row in rows)} of {len(rows)} pass")
    return rows


def even(options):
    """The part of this name."""
    meshes = {
        "even": good_mesh([SIDES], 0.03),
        "grid": sheared_mesh(40, amplitude=0.0),
        "random": settle(random_mesh(1500, seed=options.seed), 3),
    }
    return [
        smoothed_towards(name, start + (", slid" if slide else ""), mesh, length, slide=slide)
        for name, length in SIZES.items()
        for start, mesh in meshes.items()
        for slide in (False, True)
    ]


PARTS = {"adapted": adapted, "size": size, "even": even}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--meshes", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print(describe())
    found = {}
    for part in options.parts:
        print(f"\n{part}")
        found[part] = PARTS[part](options)
    if options.json is not None:
        options.json.write_text(json.dumps(found, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
