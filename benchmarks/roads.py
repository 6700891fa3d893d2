"""Roads to a good mesh: which sweeps in which order, how good each ends, and what each stage costs in units of L.

    python benchmarks/roads.py [--nodes 1e4 1e5] [--meshes 5] [--repeats 5] [--guard valid|worst] [--road NAME …]

L is one product of the sparse averaging matrix with the coordinates (SciPy). Random squares; each road is timed stage
by stage on the first mesh, in turns with the others and with L, by the processor time of one thread; medians. Qualities
after each stage are means over the meshes: mean and least 1/q, q̂. ``ceiling`` is a long road to measure the others by.
"""

from __future__ import annotations

import argparse
import time
from statistics import median

import numpy as np
from machine import describe
from sweeps import averaging_matrix

import gmsnet
from gmsnet.kernels.star.guard import LEVELS, Precision
from gmsnet.measure.totals import totals_of
from gmsnet.methods import smoother
from gmsnet.methods.barrier import Barrier
from gmsnet.methods.base import Field
from gmsnet.methods.worst_first import CYCLES, Cycle, WorstFirst
from gmsnet.run.score import Score
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

LONG = tuple(
    Cycle(share, power, sweeps)
    for share, power, sweeps in (
        (0.003, 3, 6), (0.003, 3, 6), (0.003, 4, 6), (0.001, 4, 8), (0.001, 5, 8), (0.001, 5, 8), (0.0003, 5, 16),
        (0.0003, 6, 16), (0.0003, 6, 16), (0.0003, 7, 32), (0.0003, 7, 32), (0.0003, 8, 32), (0.0003, 8, 32),
    )
)  # fmt: skip


def smart(sweeps):
    return f"{sweeps} smart", lambda: smoother("laplacian", variant="smart"), sweeps


def newton(objective, sweeps, relaxation=1.6, means=0):
    return f"{sweeps} {objective}", lambda: Barrier(objective, relaxation, 100, means), sweeps


def finish(cycles=CYCLES):
    return "worst-first", lambda: WorstFirst(cycles, at_once=len(cycles)), 1


ROADS = {
    "2 smart, 2 q, finish": (smart(2), newton("q", 2), finish()),
    "2 smart, 4 q, finish": (smart(2), newton("q", 4), finish()),
    "3 q with means, finish": (newton("q", 3, means=1), finish()),
    "4 q with means, finish": (newton("q", 4, means=1), finish()),
    "5 q with means, finish": (newton("q", 5, means=1), finish()),
    "6 q with means, finish": (newton("q", 6, means=1), finish()),
    "8 q with means, finish": (newton("q", 8, means=1), finish()),
    "5 q without means, finish": (newton("q", 5), finish()),
    "5 q, not relaxed, finish": (newton("q", 5, 1.0, means=1), finish()),
    "5 q2 with means, finish": (newton("q2", 5, means=1), finish()),
    "5 q with means": (newton("q", 5, means=1),),
    "12 q4": (newton("q4", 12),),
    "12 q, finish": (newton("q", 12), finish()),
    "ceiling": (newton("q", 60), finish(LONG)),
}


class Case:
    """One mesh."""

    def __init__(self, nodes, seed):
        mesh = gmsnet.random_mesh(nodes, seed=seed)
        self.topology = Topology.of(mesh)
        self.start = planar_points(mesh)[self.topology.memory]
        self.matrix = averaging_matrix(self.topology)

    def unit(self):
        began = time.thread_time()
        self.matrix @ self.start
        return time.thread_time() - began

    def standing(self, points):
        return Score.of(totals_of(points, self.topology.near, self.topology.near_orientation), "shape")

    def travel(self, road, level):
        """Seconds of each stage, and how the mesh stands after it."""
        field = Field(self.start.copy(), self.topology, Precision(), LEVELS.index(level))
        seconds, standings = [], []
        for _, create, sweeps in road:
            chosen = create()
            began = time.thread_time()
            for _ in range(sweeps):
                chosen.sweep(field, lambda work, first, last: [work(first, last)], lambda: True)
            seconds.append(time.thread_time() - began)
            standings.append(self.standing(field.points))
        return seconds, standings


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e4, 1e5])
    parser.add_argument("--meshes", type=int, default=5)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--guard", choices=LEVELS[:2], default="worst")
    parser.add_argument("--road", nargs="+", choices=ROADS, default=list(ROADS))
    options = parser.parse_args()
    print(describe())
    for nodes in map(int, options.nodes):
        cases = [Case(nodes, seed) for seed in range(options.meshes)]
        chosen = {name: ROADS[name] for name in options.road}
        ends = {name: [case.travel(road, options.guard)[1] for case in cases] for name, road in chosen.items()}
        seconds = {name: [] for name in chosen}
        units = []
        for _ in range(options.repeats):
            for name, road in chosen.items():
                units += [cases[0].unit() for _ in range(3)]
                if name != "ceiling" or not seconds[name]:
                    seconds[name].append(cases[0].travel(road, options.guard)[0])
        unit = median(units)
        print(
            f"\n{nodes:,} nodes, {options.meshes} meshes, guard {options.guard}; L = {unit / nodes * 1e9:.1f} ns a node"
        )
        for name, road in chosen.items():
            times = np.median(seconds[name], axis=0) / unit
            print(f"{name}: {times.sum():.1f} L")
            for k, (stage, _, _) in enumerate(road):
                after = np.mean([[s[k].mean_shape, s[k].min_shape, s[k].qhat] for s in ends[name]], axis=0)
                low = min(s[k].qhat for s in ends[name])
                print(f"  {stage:12} {times[k]:6.2f} L   mean 1/q {after[0]:.4f}  least {after[1]:.3f}"
                      f"  q-hat {after[2]:+.4f} (least {low:+.4f})")  # fmt: skip
            if "ceiling" in chosen and name != "ceiling":
                gaps = [a[-1].qhat - b[-1].qhat for a, b in zip(ends[name], ends["ceiling"], strict=True)]
                print(f"  to the ceiling of q-hat: mean {np.mean(gaps):+.4f}, worst {min(gaps):+.4f}")


if __name__ == "__main__":
    main()
