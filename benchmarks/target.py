"""How much sooner a run ends whose target is met already in 99 % of the cells than one that smooths all.

    python benchmarks/target.py [--method auto] [--variant V] [--objective O] [--nodes 1e4 1e5] [--seed 0] [--met 0.99]
        [--sweeps 2] [--repeats 7] [--json FILE]

Three meshes: a random square as it comes, and after some smart Laplacian sweeps, with the quantile of 1/q that so many
cells reach as the target; and the square as a full run leaves it, with nodes thrown out of place until only so many
cells reach 0.9 times the least 1/q of that run, the target here. Both runs are calls of ``gmsnet.smooth`` on one
thread; the smoothing itself is what it spends in the stage ``sweep``, apart from topology, stretched layers,
measures and result. A third call has a target that is met everywhere, and shows what those cost. Seconds of the thread;
all three take turns, medians count. A run with a target should take at most a fifth, smoothing alone.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np
from machine import describe

import gmsnet
from gmsnet.generate.disturb import disturb
from gmsnet.run import stages
from gmsnet.topology.topology import Topology

TIMES = 5.0


def meshes(nodes, seed, sweeps, smooth, met):
    """Name → mesh and target."""
    raw = gmsnet.random_mesh(nodes, seed=seed)
    smart = gmsnet.smooth(raw, "laplacian", variant="smart", max_sweeps=sweeps, threads=1).mesh
    made = {
        name: (mesh, float(np.quantile(gmsnet.quality(mesh).shape, 1.0 - met)))
        for name, mesh in (("as it comes", raw), (f"after {sweeps} smart Laplacian sweeps", smart))
    }
    good = smooth(raw)
    target = 0.9 * float(good.after.shape.min())
    order = np.random.default_rng(seed).permutation(Topology.of(raw).free)

    def missed(count):
        return (gmsnet.quality(disturb(good.mesh, order[:count], 1.0)).shape < target).mean()

    low, high = 0, len(order)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if missed(middle) <= 1.0 - met else (low, middle)
    made[f"smoothed, {low} nodes thrown"] = (disturb(good.mesh, order[:low], 1.0), target)
    return made


class Clock:
    """Seconds spent in the smoothing that ``gmsnet.smooth`` calls."""

    def __init__(self):
        self.seconds = 0.0
        stages.STAGES = tuple(partial(self, stage) if stage is stages.sweep else stage for stage in stages.STAGES)

    def __call__(self, work, *arguments, **options):
        began = time.thread_time()
        try:
            return work(*arguments, **options)
        finally:
            self.seconds += time.thread_time() - began


def study(mesh, target, smooth, repeats, clock):
    """Seconds of the three runs, and what the one with the target made of the mesh."""
    shape = gmsnet.quality(mesh).shape
    idle = 0.5 * float(shape.min())
    runs = {
        "full": lambda: smooth(mesh),
        "target": lambda: smooth(mesh, target_quality=target),
        "nothing": lambda: smooth(mesh, target_quality=idle),
    }
    seconds, inside = {name: [] for name in runs}, {name: [] for name in runs}
    results = {}
    for repeat in range(repeats + 1):  # the first time they are compiled, and not counted
        for name, run in runs.items():
            clock.seconds, began = 0.0, time.thread_time()
            results[name] = run()
            if repeat:
                seconds[name].append(time.thread_time() - began)
                inside[name].append(clock.seconds)
    if results["nothing"].moved.any():
        raise SystemExit("the run with nothing to do has moved nodes")
    taken = {name: median(each) for name, each in seconds.items()}
    alone = {name: median(each) for name, each in inside.items()}
    after = results["target"].after.shape
    return {
        "target": target,
        "below_before": int((shape < target).sum()),
        "below_after": int((after < target).sum()),
        "min_before": float(shape.min()),
        "min_after": float(after.min()),
        "min_full": float(results["full"].after.shape.min()),
        "moved": [int(results[name].moved.sum()) for name in ("full", "target")],
        "stop_reason": results["target"].stop_reason,
        "seconds": taken,
        "seconds_alone": alone,
        "times_total": taken["full"] / taken["target"],
        "times_alone": alone["full"] / alone["target"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", default="auto")
    parser.add_argument("--variant")
    parser.add_argument("--objective")
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e4, 1e5])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--met", type=float, default=0.99)
    parser.add_argument("--sweeps", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--json")
    options = parser.parse_args()
    names = {"variant": options.variant, "objective": options.objective}

    def smooth(mesh, **target):
        return gmsnet.smooth(mesh, options.method, **names, threads=1, **target)

    print(describe())
    rows, clock = {}, Clock()
    for nodes in map(int, options.nodes):
        for name, (mesh, target) in meshes(nodes, options.seed, options.sweeps, smooth, options.met).items():
            row = rows[f"{nodes}, {name}"] = study(mesh, target, smooth, options.repeats, clock)
            ms, alone = (
                {key: 1e3 * value for key, value in row[kind].items()} for kind in ("seconds", "seconds_alone")
            )
            print(
                f"\n{nodes:,} nodes, {name}: target 1/q {row['target']:.3f}, cells below it {row['below_before']} → "
                f"{row['below_after']} ({row['stop_reason']}), least 1/q {row['min_before']:.3f} → "
                f"{row['min_after']:.3f} (full run {row['min_full']:.3f}); nodes moved {row['moved'][1]} of "
                f"{row['moved'][0]}\n  full {ms['full']:.1f} ms, with target {ms['target']:.1f} ms, nothing to do "
                f"{ms['nothing']:.1f} ms: {row['times_total']:.1f} times\n  smoothing alone: full "
                f"{alone['full']:.1f} ms, with target {alone['target']:.1f} ms: {row['times_alone']:.1f} times",
                flush=True,
            )
    if options.json:
        document = {"machine": describe(), "method": {"name": options.method, **names}, "meshes": rows}
        Path(options.json).write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return 0 if all(row["times_alone"] >= TIMES for row in rows.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
