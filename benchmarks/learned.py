"""What learning brings: every trial of GMSNet 2 as one row, and q̂ by sweep and by time beside plain methods.

    python benchmarks/learned.py [--nodes 20000] [--seeds 100 101 102 103 104] [--repeats 3] [--folder build/learned]
        [--references FILE] [--json docs/learned.json] [--picture docs/learned.png]

On random squares and on graded ones (density varying by 100) that no training has seen. A row has the parameters, the
multiply–adds of the layers for a star of degree 6, the time of a sweep in L, q̂ after 1, 3, 5, 10 and 20 sweeps and mean
and least 1/q after 10, all on random squares, q̂ after 10 on graded ones, and the least and largest q̂ after 10 (mean
over the meshes) of the trainings with different seeds. The guard is the default (worst) and on one thread. Trainings
that the folder does not have are left out (learned_trials.py makes them); rows that the file has are not made again.

The reference is whole-mesh L-BFGS on the mean of q and from there on that of q⁴ (reference.py), from the mesh after
five smart Laplacian sweeps; it is computed once and kept. L is a product of SciPy's sparse averaging matrix with the
coordinates in the same memory order. Times are seconds of the thread, medians over the repeats, in turns.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from statistics import mean, median

import learned_trials
import numpy as np
from machine import describe
from reference import Plane, continuation, starts
from sweeps import averaging_matrix

import gmsnet
from gmsnet import weights
from gmsnet.generate.graded import graded_mesh
from gmsnet.methods import smoother
from gmsnet.methods.base import Smoother
from gmsnet.parallel.threads import serial
from gmsnet.plot.figure import new_figure, png_bytes
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import Run, Start
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

KINDS = {"random": gmsnet.random_mesh, "graded": graded_mesh}
SWEEPS, SHOWN = 20, (1, 3, 5, 10, 20)
MOST_L = 60  # of the picture
TIMED = 3  # sweeps for L per sweep
PRODUCTS = 20  # that are timed at once for L
PLAIN = {
    "Laplacian, smart": {"name": "laplacian", "variant": "smart"},
    "gmsnet (the paper's)": {"name": "gmsnet"},
    "optimize newton, q²": {"name": "optimize", "variant": "newton", "objective": "q2"},
    "barrier, q²": {"name": "barrier", "objective": "q2"},
    "barrier, q⁴": {"name": "barrier", "objective": "q4"},
    "auto": {"name": "auto"},
}
CURVES = (
    "Laplacian, smart",
    "gmsnet (the paper's)",
    "optimize newton, q²",
    "barrier, q²",
    "auto",
    "H=8",
    "H=8 ×2, barrier q²",
)


class Then(Smoother):
    """So many sweeps of one method, then another one."""

    def __init__(self, first, sweeps, second):
        self.first, self.left, self.second = first, sweeps, second

    def sweep(self, field, share, test):
        self.left -= 1
        return (self.first if self.left >= 0 else self.second).sweep(field, share, test)


def makers(folder):
    """Name → (how a smoother for one run is made, the weights of the learned one or None), seed 0."""
    made = {name: (lambda chosen=chosen: smoother(**chosen), None) for name, chosen in PLAIN.items()}
    for name in learned_trials.TRIALS:
        path = learned_trials.weights_of(folder, name, 0)
        if path.exists():
            made[name] = (lambda path=path: smoother("gmsnet2", weights=path), weights.load(path, model="gmsnet2"))
    path = learned_trials.weights_of(folder, "H=8", 0)
    hybrids = ((1, "q2", "²"), (2, "q2", "²"), (3, "q4", "⁴")) if path.exists() else ()
    for count, objective, power in hybrids:

        def both(path=path, count=count, objective=objective):
            return Then(smoother("gmsnet2", weights=path), count, smoother("barrier", objective=objective))

        made[f"H=8 ×{count}, barrier q{power}"] = (both, None)
    return made


class Mesh:
    """A mesh with what is made of it once."""

    def __init__(self, kind, nodes, seed):
        self.name, self.mesh = f"{kind}/{nodes}/{seed}", KINDS[kind](nodes, seed=seed)
        self.topology = Topology.of(self.mesh)
        self.topology.stars  # noqa: B018 (set-up: made when it is first asked for)
        self.matrix, self.points = averaging_matrix(self.topology), planar_points(self.mesh)[self.topology.memory]

    def product(self):
        """Seconds of one L."""
        points, began = self.points, time.thread_time()
        for _ in range(PRODUCTS):
            points = self.matrix @ points
        return (time.thread_time() - began) / PRODUCTS

    def course(self, create, sweeps=SWEEPS):
        """(seconds so far, standing) before the first and after each sweep, until the method has settled."""
        run = Run(Start.of(self.mesh, self.topology), create(), SmoothOptions())
        chosen, seconds = run.smoother, 0.0
        states = [(0.0, run.best_score)]
        for _ in range(sweeps):
            began = time.thread_time()
            chosen.sweep(run.field, serial, lambda: False)
            seconds += time.thread_time() - began
            standing = run._score()
            states.append((seconds, standing))
            if chosen.converged:
                break
        return states

    def reference(self):
        """q̂ of the input and of the reference."""
        plane = Plane.of(self.mesh)
        end = continuation(plane, starts(plane)["laplacian"], (1, 4))[-1].points
        return {"input": plane.figures(plane.start)["qhat"], "reference": plane.figures(end)["qhat"]}


def stored(path, mesh):
    """The reference of a mesh, out of the file or into it."""
    known = json.loads(path.read_text()) if path.exists() else {}
    if mesh.name not in known:
        known[mesh.name] = mesh.reference()
        path.write_text(json.dumps(known, indent=1) + "\n")
    return known[mesh.name]


def at(states, sweep):
    """The standing after so many sweeps, the last one where there were fewer."""
    return states[min(sweep, len(states) - 1)][1]


def multiply_adds(hidden, degree=6):
    """Of the layers, for one star."""
    return degree * (5 * hidden + hidden * hidden + 3 * hidden) + 3 * hidden * hidden


def study(meshes, made, folder, repeats, rows):
    """Adds to ``rows`` those of the methods that it lacks, name → row; yields after each."""
    first = meshes["random"][0]
    for name, (create, trained) in made.items():
        if name in rows:
            continue
        products, times = [], []
        for _ in range(repeats + 1):  # the first one compiles
            times.append(first.course(create, TIMED)[-1][0] / TIMED)
            products.append(first.product())
        unit = median(products)
        courses = {kind: [mesh.course(create) for mesh in those] for kind, those in meshes.items()}
        random = courses["random"]
        rows[name] = {
            "parameters": trained and trained.parameters,
            "multiply_adds": trained and multiply_adds(trained.hidden),
            "L": median(times[1:]) / unit,
            "seconds_of_L": unit,
            "qhat": [mean(at(states, k).qhat for states in random) for k in range(SWEEPS + 1)],
            "graded": [mean(at(states, k).qhat for states in courses["graded"]) for k in range(SWEEPS + 1)],
            "time_in_L": [
                median(states[min(k, len(states) - 1)][0] for states in random) / unit for k in range(SWEEPS + 1)
            ],
            "mean_shape": mean(at(states, 10).mean_shape for states in random),
            "min_shape": mean(at(states, 10).min_shape for states in random),
            "inverted": sum(at(states, 10).inverted for those in courses.values() for states in those),
            "each": {kind: [at(states, 10).qhat for states in those] for kind, those in courses.items()},
        }
        if trained:
            rows[name]["trainings"] = [rows[name]["qhat"][10], *others(meshes["random"], folder, name)]
        print(line(name, rows[name]), flush=True)
        yield name


def others(meshes, folder, name):
    """q̂ after 10 sweeps, mean over the meshes, of the other trainings of a trial."""
    paths = [learned_trials.weights_of(folder, name, seed) for seed in (1, 2)]
    found = []
    for path in filter(Path.exists, paths):
        create = lambda path=path: smoother("gmsnet2", weights=path)  # noqa: E731
        found.append(mean(at(mesh.course(create, 10), 10).qhat for mesh in meshes))
    return found


HEAD = (
    "| method | parameters | multiply–adds | L per sweep | q̂ after 1 | 3 | 5 | 10 | 20 | mean 1/q | min 1/q | "
    "graded, q̂ after 10 | trainings: q̂ after 10 |\n|---|" + 12 * "---:|"
)


def line(name, row):
    """A row of the table in Markdown."""
    count = [f"{row[key]:,}" if row[key] else "–" for key in ("parameters", "multiply_adds")]
    qhat = [f"{row['qhat'][k]:+.3f}" for k in SHOWN]
    spread = row.get("trainings", [])
    told = f"{min(spread):+.3f} … {max(spread):+.3f} ({len(spread)})" if len(spread) > 1 else "–"
    cells = [name, *count, f"{row['L']:.1f}", *qhat, f"{row['mean_shape']:.3f}", f"{row['min_shape']:.3f}"]
    return "| " + " | ".join([*cells, f"{row['graded'][10]:+.3f}", told]) + " |"


def picture(rows, reference):
    """q̂ by sweep and by time, means over the random squares, as a PNG."""
    figure = new_figure(10.5, 4.6)
    for axes, key, title in zip(
        figure.subplots(1, 2, sharey=True), ("sweep", "L"), ("sweeps", "time in L"), strict=True
    ):
        for k, name in enumerate(name for name in CURVES if name in rows):
            curve = rows[name]
            x = np.arange(len(curve["qhat"])) if key == "sweep" else curve["time_in_L"]
            label = name.replace("H=8", "gmsnet2") if key == "sweep" else None
            axes.plot(x, curve["qhat"], color=f"C{k}", marker=".", markersize=4, linewidth=1.2, label=label)
        axes.axhline(
            reference, color="black", linewidth=0.8, linestyle="--", label="L-BFGS on q⁴" if key == "sweep" else None
        )
        axes.set_xlabel(title)
        axes.grid(alpha=0.3)
    figure.axes[0].set_xticks(range(0, SWEEPS + 1, 2))
    axes.set_xlim(0, MOST_L)
    figure.axes[0].set_ylabel("q̂")
    figure.legend(loc="outside upper center", ncols=4, frameon=False, fontsize="small")
    return png_bytes(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=20_000)
    parser.add_argument("--seeds", nargs="+", type=int, default=[100, 101, 102, 103, 104])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--folder", type=Path, default=learned_trials.FOLDER)
    parser.add_argument("--references", type=Path, default=Path("benchmarks/learned_references.json"))
    parser.add_argument("--json", type=Path, default=Path("docs/learned.json"))
    parser.add_argument("--picture", type=Path, default=Path("docs/learned.png"))
    options = parser.parse_args()
    print(describe(), HEAD, sep="\n\n")
    found = json.loads(options.json.read_text(encoding="utf-8")) if options.json.exists() else {"rows": {}}
    meshes = {kind: [Mesh(kind, options.nodes, seed) for seed in options.seeds] for kind in KINDS}
    references = {kind: [stored(options.references, mesh) for mesh in those] for kind, those in meshes.items()}
    found |= {"machine": describe(), "nodes": options.nodes, "seeds": options.seeds, "references": references}
    for _ in study(meshes, makers(options.folder), options.folder, options.repeats, found["rows"]):
        options.json.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    for kind, those in references.items():
        for name, row in found["rows"].items():
            shares = [
                (qhat - known["input"]) / (known["reference"] - known["input"])
                for qhat, known in zip(row["each"][kind], those, strict=True)
            ]
            row.setdefault("share_of_gain", {})[kind] = shares
            told = ", ".join(f"{share:.0%}" for share in shares)
            print(f"{kind}, {name}: {mean(shares):.1%} of the gain of L-BFGS after 10 sweeps ({told})")
    options.json.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    options.picture.write_bytes(picture(found["rows"], mean(known["reference"] for known in references["random"])))


if __name__ == "__main__":
    main()
