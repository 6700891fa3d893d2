"""Is a method as good as converged optimisation, near the ceiling of the mesh, and done within so many sweeps?

    python benchmarks/auto.py [--method auto] [--variant V] [--objective O] [--nodes 1e3 1e4 1e5] [--seeds 0 1 2 3 4]
        [--guard worst] [--sweeps 100] [--repeats 5] [--leave-out] [--ceilings benchmarks/ceilings.json] [--json FILE]

On random squares, with the defaults of ``gmsnet.smooth`` but for what is named. Each mesh must come to q̂ and a least
1/q of at least those of whole-mesh L-BFGS on q, q² and q⁴ (reference.py), a mean 1/q of at most 0.004 less, and a q̂ at
most 0.005 below the mesh's ceiling; without an inverted cell. The references are read from a file, and computed and
kept there where it has none.

Time is that of the sweeps with their stop rules, on one thread: from the moment that topology, stars and first measures
are there to the moment that the run stops; and to the first look after which the mesh was good enough. L is a sweep of
SciPy's sparse averaging matrix over the coordinates in the same memory order: 20 of them in a row, over 20. Both are
seconds of the thread, so that other programs take none of them, and take turns; medians count. At 10,000 and 100,000
nodes at most 20 L are allowed, 12 are aimed at.

--leave-out: besides, ``auto`` without each of its phases in turn, its other rules as they are.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from statistics import median

from machine import describe
from reference import figures, stored
from sweeps import averaging_matrix

import gmsnet
from gmsnet.measure.report import measure
from gmsnet.methods import smoother
from gmsnet.methods.auto import Auto
from gmsnet.methods.phases import LARGE_PLAN, SMALL, SMALL_PLAN
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import outcome, rank_by
from gmsnet.run.run import Run, Start
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

LESS_MEAN, BELOW_CEILING = 0.004, 0.005
ROUNDING = 1e-9
MOST_L, AIM_L = 20.0, 12.0
ROW_OF_L = 20  # sweeps of L that are timed at once
KEYS = ("qhat", "min_shape", "mean_shape")


def checks(found, wanted):
    """Name → whether a mesh with these figures passes; wanted: its row of the file of references."""
    reference, ceiling = wanted["reference"], wanted["ceiling"]
    return {
        "q̂ ≥ reference": found["qhat"] >= reference["qhat"] - ROUNDING,
        "min 1/q ≥ reference": found["min_shape"] >= reference["min_shape"] - ROUNDING,
        f"mean ≥ reference − {LESS_MEAN}": found["mean_shape"] >= reference["mean_shape"] - LESS_MEAN,
        f"q̂ ≥ ceiling − {BELOW_CEILING}": found["qhat"] >= ceiling["qhat"] - BELOW_CEILING,
        "0 inverted": found["inverted"] == 0,
    }


class Timed:
    """Runs of one method on one mesh, beside L. create: makes a smoother for one run."""

    def __init__(self, mesh, create, guard, sweeps):
        self.mesh, self.create, self.guard, self.sweeps = mesh, create, guard, sweeps
        self.topology = Topology.of(mesh)
        self.topology.stars  # noqa: B018 (set-up: made when it is first asked for)
        self.matrix, self.points = averaging_matrix(self.topology), planar_points(mesh)[self.topology.memory]
        self.seconds, self.products, self.history, self.moments, self.best = [], [], [], [], None

    def turn(self):
        """One run, and a row of L."""
        moments = []
        options = SmoothOptions(
            max_sweeps=self.sweeps, guard=self.guard, callback=lambda sweep: moments.append(time.thread_time())
        )
        run = Run(Start.of(self.mesh, self.topology), self.create(), options)
        began = time.thread_time()
        run.to_the_end()
        self.seconds.append(time.thread_time() - began)
        self.history, self.moments = run.history, [*self.moments, [moment - began for moment in moments]]
        self.best = run.best
        points = self.points
        began = time.thread_time()
        for _ in range(ROW_OF_L):
            points = self.matrix @ points
        self.products.append((time.thread_time() - began) / ROW_OF_L)

    def to_the_end(self):
        """Seconds of the whole run, and of L: medians without the first turn."""
        return median(self.seconds[1:] or self.seconds), median(self.products[1:] or self.products)

    def until(self, wanted):
        """Seconds to the first look after which the mesh passes (median), or None."""
        for index, sweep in enumerate(self.history):
            found = {key: getattr(sweep, key) for key in (*KEYS, "inverted")}
            if all(checks(found, wanted).values()):
                return median(moments[index] for moments in self.moments[1:] or self.moments)
        return None


def study(mesh, wanted, create, guard, sweeps, repeats):
    """What a method makes of a mesh: figures, which checks it passes, and times."""
    timed = Timed(mesh, create, guard, sweeps)
    for _ in range(repeats + 1):
        timed.turn()
    seconds, product = timed.to_the_end()
    until = timed.until(wanted)
    points, _, _ = outcome(mesh, timed.topology, timed.best, measure(mesh, timed.topology), rank_by("shape"))
    found = figures(mesh.with_points(points))
    return {
        "found": found,
        "passed": checks(found, wanted),
        "sweeps": timed.history[-1].index,
        "seconds": seconds,
        "L": product,
        "in_L": seconds / product,
        "until_in_L": until / product if until is not None else None,
        "history": [{key: getattr(sweep, key) for key in KEYS} for sweep in timed.history],
    }


def table(rows, references):
    """The figures of each mesh beside reference and ceiling, what it fails, and its time."""
    print(
        "\n  nodes/seed   q̂ (reference, ceiling)    min 1/q (reference)  mean (reference)   sweeps    time  until good"
    )
    for name, row in rows.items():
        found, wanted = row["found"], references[name]
        low, top = wanted["reference"], wanted["ceiling"]
        until = f"{row['until_in_L']:8.1f} L" if row["until_in_L"] is not None else "     never"
        failed = [check for check, passed in row["passed"].items() if not passed]
        print(
            f"  {name:>10}  {found['qhat']:7.4f} ({low['qhat']:7.4f} {top['qhat']:7.4f})  {found['min_shape']:6.4f} "
            f"({low['min_shape']:6.4f})    {found['mean_shape']:6.4f} ({low['mean_shape']:6.4f})  {row['sweeps']:4}  "
            f"{row['in_L']:7.1f} L {until}  {'fails: ' + '; '.join(failed) if failed else 'ok'}"
        )


def summary(rows, sizes):
    """Median times by size; and whether all is as it must be."""
    good = all(all(row["passed"].values()) for row in rows.values())
    print()
    for nodes in sizes:
        here = [row for name, row in rows.items() if name.startswith(f"{nodes}/")]
        in_l = median(row["in_L"] for row in here)
        passed = sum(all(row["passed"].values()) for row in here)
        text = (
            "" if nodes < 10_000 else f": {'at most' if in_l <= MOST_L else 'NOT at most'} {MOST_L:g} (aim {AIM_L:g})"
        )
        good &= nodes < 10_000 or in_l <= MOST_L
        print(f"  {nodes:7,} nodes: {passed} of {len(here)} meshes pass; {in_l:.1f} L (median){text}")
    return good


def phase_table(rows, without, sizes):
    """What leaving a phase out does: medians over the meshes of a size, and how many pass."""
    for nodes in sizes:
        print(f"\n  {nodes:,} nodes{'':24} pass       q̂  min 1/q  mean 1/q    time")
        for label, found in {"all phases": rows, **{f"without {name}": each for name, each in without.items()}}.items():
            here = [row for name, row in found.items() if name.startswith(f"{nodes}/")]
            if not here:
                continue
            passed = sum(all(row["passed"].values()) for row in here)
            qhat, least, mean = (median(row["found"][key] for row in here) for key in KEYS)
            in_l = median(row["in_L"] for row in here)
            print(f"    {label:32} {passed} of {len(here)}  {qhat:7.4f}  {least:7.4f}  {mean:8.4f}  {in_l:6.1f} L")


def plan(nodes):
    """The phases of ``auto`` for a mesh of so many free nodes."""
    return SMALL_PLAN if nodes <= SMALL else LARGE_PLAN


def called(name, method, names, options):
    """The figures of what ``gmsnet.smooth`` makes of a mesh."""
    nodes, seed = map(int, name.split("/"))
    mesh = gmsnet.random_mesh(nodes, seed=seed)
    result = gmsnet.smooth(mesh, method, **names, guard=options.guard, max_sweeps=options.sweeps, threads=1)
    return figures(mesh.with_points(result.points))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", default="auto")
    parser.add_argument("--variant")
    parser.add_argument("--objective")
    parser.add_argument("--nodes", nargs="+", type=float, default=[1e3, 1e4, 1e5])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--guard", default="worst")
    parser.add_argument("--sweeps", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--leave-out", action="store_true")
    parser.add_argument("--ceilings", type=Path, default=Path(__file__).with_name("ceilings.json"))
    parser.add_argument("--json")
    options = parser.parse_args()
    sizes = [int(nodes) for nodes in options.nodes]
    names = {"variant": options.variant, "objective": options.objective}
    references = stored(options.ceilings, sizes, options.seeds)

    def studies(create, sizes):
        """Name → ``study``, of all meshes of these sizes. create: makes a smoother for a number of nodes."""
        return {
            f"{nodes}/{seed}": study(
                gmsnet.random_mesh(nodes, seed=seed), references[f"{nodes}/{seed}"],
                lambda nodes=nodes: create(nodes), options.guard,
                options.sweeps, options.repeats,
            )
            for nodes in sizes for seed in options.seeds
        }  # fmt: skip

    print(describe())
    print(f"{options.method}, one thread; medians of {options.repeats} runs in turns with L")
    rows = studies(lambda nodes: smoother(options.method, **names), sizes)
    differs = [name for name, row in rows.items() if row["found"] != called(name, options.method, names, options)]
    table(rows, references)
    good = summary(rows, sizes)
    if differs:
        raise SystemExit(f"gmsnet.smooth makes another mesh than the run that was timed, of {', '.join(differs)}")
    without = {}
    if options.leave_out:
        for name in dict.fromkeys(phase.name for nodes in sizes for phase in plan(nodes)):
            without[name] = studies(
                lambda nodes, name=name: Auto([phase for phase in plan(nodes) if phase.name != name]),
                [nodes for nodes in sizes if name in [phase.name for phase in plan(nodes)]],
            )
        phase_table(rows, without, sizes)
    if options.json:
        document = {
            "machine": describe(),
            "method": {"name": options.method, **names},
            "meshes": rows,
            "without": without,
        }
        Path(options.json).write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
