"""Step sizes of the Adam variant of ``optimize``: how near they come to the optimum of a star, and what they make.

    python benchmarks/tune_adam.py [--objective metric] [--squares 20] [--runs 3] [--sweeps 100]

The paper does not state a step size, so the one that serves its OptimSmoothing best is taken. Step sizes are relative
to the star's size, η_t = η · decay(t), t = 1 … 20. For random squares (1,000 nodes) and the paper's four cases:

- gain: of what the mean objective of the stars could fall by in one visit, the share that 20 steps achieve, each star
  for itself; in meshes as they come ("raw") and after five sweeps ("later"). What could be gained is measured by 1,000
  steps, linearly decaying from 0.05, or the best of the rows, whichever is better for a star.
- meshes: after at most so many sweeps, the best by q-hat in 1/q_V, as in the paper: means of the mean and the least
  1/q, of the mean and the least 1/q_V, of q-hat in 1/q_V, and of the least angle.
"""

from __future__ import annotations

import argparse

import numba
import numpy as np
from machine import describe

import gmsnet
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.methods import adam
from gmsnet.kernels.simplex.objectives import NAMES, OUT
from gmsnet.kernels.star import stars
from gmsnet.measure.report import measure
from gmsnet.methods.optimize import Adam
from gmsnet.paper.cases import CASES
from gmsnet.parallel.threads import serial
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import outcome, rank_by
from gmsnet.run.run import Run, Start
from gmsnet.topology.topology import Topology

RATES = (0.005, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.2)
STEPS = np.arange(adam.STEPS)
DECAYS = {
    "constant": np.ones(adam.STEPS),
    "linear": 1.0 - STEPS / adam.STEPS,
    "1/sqrt(t)": 1.0 / np.sqrt(STEPS + 1.0),
    "0.9^t": 0.9**STEPS,
    "0.8^t": 0.8**STEPS,
}
OPTIONS = SmoothOptions(best_by="aspect", guard="valid")
NONE, MANY = np.zeros(1), 0.05 * (1.0 - np.arange(1000) / 1000)


@numba.njit
def least_values(points, blocks, objective, sizes, out):
    """The least objective that so many steps find for each lane of each block."""
    workspace = stars.workspace_for(blocks.most)
    local, shift = np.empty(2 * blocks.most * LANES), np.empty(2 * LANES)
    state, sums = np.empty(adam.STATE * LANES), np.empty(OUT * LANES)
    for block in range(len(blocks.filled)):
        n = stars.fetch(points, blocks, block, workspace, local)
        adam.descend(objective, local, n, None, sizes, state, sums, shift)
        out[block * LANES : (block + 1) * LANES] = state[adam.BEST * LANES : (adam.BEST + 1) * LANES]


class Subject:
    """A mesh with its stars."""

    def __init__(self, mesh):
        self.mesh, self.topology = mesh, Topology.of(mesh)
        self.before = measure(mesh, self.topology)
        self.own = np.concatenate([np.arange(LANES) < filled for filled in self.topology.stars.blocks.filled])

    def points(self, objective, sweeps):
        """In memory order, after so many sweeps with the tuned step sizes."""
        run = Run(Start.of(self.mesh, self.topology), Adam(objective), OPTIONS)
        for _ in range(sweeps):
            run.smoother.sweep(run.field, serial, lambda: False)
        return run.field.points

    def values(self, points, objective, sizes):
        out = np.empty(len(self.own))
        least_values(points, self.topology.stars.blocks, NAMES.index(objective), sizes, out)
        return out[self.own]

    def smoothed(self, objective, sizes, sweeps):
        run = Run(Start.of(self.mesh, self.topology), Adam(objective, sizes), OPTIONS)
        run.to_the_end(sweeps)
        return outcome(self.mesh, self.topology, run.best, self.before, rank_by("aspect"))[2]


def gains(subjects, objective, sweeps, rows):
    """Row → the share of the possible gain, and the values that the stars start from and could come to."""
    points = [subject.points(objective, sweeps) for subject in subjects]

    def values(sizes):
        return np.concatenate([s.values(p, objective, sizes) for s, p in zip(subjects, points, strict=True)])

    start, best = values(NONE), values(MANY)
    valid = np.isfinite(start)  # a barrier has no value where a star is tangled
    reached = {row: values(sizes) for row, sizes in rows.items()}
    for found in reached.values():
        best = np.minimum(best, found)
    shares = {row: (start - found)[valid].sum() / (start - best)[valid].sum() for row, found in reached.items()}
    return shares, start[valid].mean(), best[valid].mean()


def meshes(subjects, objective, sizes, sweeps):
    """Means over the meshes of the six columns."""
    reports = [subject.smoothed(objective, sizes, sweeps) for subject in subjects]
    columns = [(r.shape.mean(), r.shape.min(), r.aspect.mean(), r.aspect.min(), r.qhat_aspect) for r in reports]
    return (*np.mean(columns, axis=0), np.mean([r.min_angle.min() for r in reports]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--objective", choices=NAMES, default=NAMES[0])
    parser.add_argument("--squares", type=int, default=20)
    parser.add_argument("--runs", type=int, default=3, help="of each case")
    parser.add_argument("--sweeps", type=int, default=100)
    options = parser.parse_args()
    groups = {
        "random squares": [Subject(gmsnet.random_mesh(1000, seed=seed)) for seed in range(options.squares)],
        "cases": [Subject(case.mesh(run)) for case in CASES.values() for run in range(options.runs)],
    }
    rows = {(decay, rate): rate * curve for decay, curve in DECAYS.items() for rate in RATES}
    print(describe())
    for group, subjects in groups.items():
        print(f"\n{options.objective}, {len(subjects)} {group}")
        shares = {}
        for sweeps in (0, 5):
            shares[sweeps], start, best = gains(subjects, options.objective, sweeps, rows)
            print(f"  after {sweeps} sweeps: stars at {start:.5f}, could come to {best:.5f} in a visit")
        print("  decay      step   gain raw  later    1/q mean    min    1/q_V mean    min    q-hat   least angle")
        for row, sizes in rows.items():
            mean, low, mean_v, low_v, qhat, angle = meshes(subjects, options.objective, sizes, options.sweeps)
            print(
                f"  {row[0]:9} {row[1]:6.3f}    {shares[0][row]:6.2%} {shares[5][row]:6.2%}      {mean:.4f} {low:.4f}"
                f"        {mean_v:.4f} {low_v:.4f}  {qhat:+.4f}        {angle:6.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
