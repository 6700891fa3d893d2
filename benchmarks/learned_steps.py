"""Learns how far each Newton sweep of the barrier should go: a factor for each of the first sweeps, and nothing else.

    python benchmarks/learned_steps.py [--objective q4] [--seed 0] [--generations 10]

A node goes ω_k times its Newton step in sweep k, and in the first sweep to ``stretch`` times the way to the mean of its
ring where its objective falls by that (methods/barrier.py); the last ω stays. Differential evolution over these
parameters, started at the shipped ones, on three random and three graded squares; what is minimised is ¼ log mean q⁴
after each of the first eight sweeps, on the average. Both schedules are then compared on squares it has not seen.
"""

from __future__ import annotations

import argparse
from statistics import mean

import numpy as np
from learned import KINDS, alone
from machine import describe
from scipy.optimize import differential_evolution

from gmsnet.kernels.methods import barrier as kernels
from gmsnet.kernels.star.guard import WORST, Precision
from gmsnet.measure.report import measure
from gmsnet.methods.barrier import RELAXATION, STRETCH, Barrier
from gmsnet.methods.base import Field
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

SWEEPS, STEPS = 8, 5
BOUNDS = [(0.0, 1.5), *[(0.8, 2.2)] * STEPS]
SHIPPED = [STRETCH, *[RELAXATION] * STEPS]


class Stepped(Barrier):
    """parameters: the stretch of the first sweep, and ω of each sweep."""

    def __init__(self, objective, parameters):
        super().__init__(objective)
        self.stretch, *self.omegas = map(float, parameters)

    def visit(self, points, blocks, first, last, guard, tally):
        omega = self.omegas[min(self.sweeps, STEPS - 1)]
        stretch = 0.0 if self.sweeps else self.stretch
        kernels.sweep(points, blocks, first, last, guard, self.power, omega, stretch, tally)


class Case:
    """A mesh to learn from, or to compare on."""

    def __init__(self, kind, nodes, seed):
        self.mesh = KINDS[kind](nodes, seed=seed)
        self.topology = Topology.of(self.mesh)
        self.start = planar_points(self.mesh)[self.topology.memory]

    def points(self, smoother, sweeps):
        """The points after each sweep, in memory order."""
        field = Field(self.start.copy(), self.topology, Precision(), WORST)
        for _ in range(sweeps):
            smoother.sweep(field, alone, lambda: False)
            yield field.points

    def report(self, points):
        moved = self.mesh.points.copy()
        moved[self.topology.memory] = points
        return measure(self.mesh.with_points(moved), self.topology)

    def loss(self, smoother):
        """¼ log mean q⁴ after each of the sweeps, on the average."""
        shapes = (self.report(points).shape for points in self.points(smoother, SWEEPS))
        return mean(float(np.log(np.mean(shape**-4.0))) / 4 for shape in shapes)

    def gains(self, smoother, sweeps):
        """q̂ after each sweep."""
        return [self.report(points).qhat for points in self.points(smoother, sweeps)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objective", default="q4")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--generations", type=int, default=10)
    options = parser.parse_args()
    print(describe())
    cases = [Case(kind, 2000, seed) for kind in KINDS for seed in range(3)]

    def loss(parameters):
        return mean(case.loss(Stepped(options.objective, parameters)) for case in cases)

    print(f"shipped {np.round(SHIPPED, 3)}: loss {loss(SHIPPED):.4f}", flush=True)
    found = differential_evolution(
        loss, BOUNDS, x0=SHIPPED, popsize=5, maxiter=options.generations, seed=options.seed, polish=False
    )
    print(f"learned {np.round(found.x, 3)}: loss {found.fun:.4f} ({found.nfev} evaluations)")
    for kind in KINDS:
        fresh = [Case(kind, 20_000, seed) for seed in range(100, 105)]
        for name, parameters in (("shipped", SHIPPED), ("learned", found.x)):
            rows = np.array([case.gains(Stepped(options.objective, parameters), 12) for case in fresh])
            told = " ".join(f"{value:+.3f}" for value in rows.mean(axis=0)[[0, 1, 2, 3, 4, 5, 7, 9, 11]])
            print(f"{kind}, {name}: q̂ after 1 2 3 4 5 6 8 10 12 sweeps {told}", flush=True)


if __name__ == "__main__":
    main()
