"""Share of tangled meshes that are mended, by how badly they are tangled; and the time, beside whole-mesh L-BFGS.

    GMSNET_MESHES=FOLDER python benchmarks/untangle.py [--bases 50] [--repeats 3] [--json FILE]

Each base mesh is valid, so a valid mesh with its connectivity and boundary exists. Its free nodes are thrown by up to
0.5, 1 and 3 mean lengths of their edges; in a fourth variant one in ten is put anywhere in the mesh's bounding box; in
three more all are folded: into one point, mirrored, or permuted.
L-BFGS is the same barrier over all free nodes from the start, by the same rule for ε, until all cells are certified.
Both are timed in turns, on one thread, set-up (Topology) apart; medians over the repeats.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections import Counter
from pathlib import Path
from statistics import median

import numpy as np
from machine import describe

import gmsnet
from gmsnet.generate import disturb
from gmsnet.kernels.star.guard import Precision
from gmsnet.measure.signs import exact_signs
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology
from gmsnet.untangle import untangle
from gmsnet.untangle.escalation import LAST_PATIENCE
from gmsnet.untangle.lbfgs import whole
from gmsnet.untangle.patch import Patch, in_order
from gmsnet.untangle.state import UntanglingState

REAL = (
    "mesh_NACA0012_inv.su2", "japan_sea.msh", "insulated.msh", "internal.msh", "helmholtz_apartment.vtk",
    "osteonT1_11.mesh", "square_triquad.mesh",
)  # fmt: skip
SCATTERED = ("0.5 edges", "1 edge", "3 edges")
FOLDED = ("one point", "mirrored", "permuted")
SEVERITIES = (*SCATTERED, "1 in 10 anywhere", *FOLDED)
SHAPES = ("square", "circle", "plate", "lshape")
SIZES = (200, 500, 1000, 2000, 5000, 10_000)


def base(number, folder):
    """The mesh of this number: the real ones first, then random and good ones of four shapes and many sizes."""
    names = [name for name in REAL if folder and (Path(folder) / name).exists()]
    if number < 2 * len(names):
        name = names[number % len(names)]
        return name, gmsnet.read(Path(folder) / name)
    number -= 2 * len(names)
    shape, nodes = SHAPES[number % len(SHAPES)], SIZES[number % len(SIZES)]
    return f"{shape} {nodes} #{number}", gmsnet.random_mesh(nodes, shape=shape, seed=number)


def tangled(mesh, topology, severity, seed):
    if severity in SCATTERED:
        return disturb(mesh, topology.free, float(severity.split()[0]), seed=seed, keep_valid=False)
    rng = np.random.default_rng(seed)
    if severity in FOLDED:
        return folded(mesh, topology.free, severity, rng)
    chosen = rng.choice(topology.free, max(1, len(topology.free) // 10), replace=False)
    plane = list(mesh.plane)
    corner, extent = mesh.points[:, plane].min(axis=0), np.ptp(mesh.points[:, plane], axis=0)
    points = mesh.points.copy()
    points[np.ix_(chosen, plane)] = corner + extent * rng.random((len(chosen), 2))
    return mesh.with_points(points)


def folded(mesh, free, how, rng):
    """All free nodes in one place, in each other's places, or where a mirror shows them."""
    points = mesh.points.copy()
    if how == "one point":
        points[free] = points[rng.choice(free)]
    elif how == "mirrored":
        along = mesh.plane[0]
        points[free, along] = points[:, along].min() + points[:, along].max() - points[free, along]
    else:
        points[free] = points[rng.permutation(free)]
    return mesh.with_points(points)


def by_lbfgs(points, topology, precision):
    """The cells that whole-mesh L-BFGS leaves inverted."""
    tangle = UntanglingState(points, topology, precision)
    whole(tangle, Patch.of(topology, in_order(topology, topology.near_colours >= 0)), LAST_PATIENCE)
    return tangle.look()


def timed(work):
    began = time.perf_counter()
    out = work()
    return time.perf_counter() - began, out


def one(name, mesh, severity, seed, repeats):
    topology = Topology.of(mesh)
    thrown = tangled(mesh, topology, severity, seed)
    precision = Precision.of(single=mesh.single, exponent=thrown.exponent)
    points = planar_points(thrown)[topology.memory]
    ours, theirs = [], []
    for _ in range(repeats):
        seconds, result = timed(lambda: untangle(points, topology, precision))
        ours.append(seconds)
        seconds, left = timed(lambda: by_lbfgs(points, topology, precision))
        theirs.append(seconds)
    before, after = (exact_signs(p, topology.near, topology.near_orientation) for p in (points, result.points))
    assert (after[before > 0] > 0).all()
    assert (result.points == points)[topology.near_colours < 0].all()
    return {
        "mesh": name, "severity": severity, "nodes": len(points), "free": len(topology.free), "before": result.before,
        "after": result.after, "taken": result.taken, "seconds": median(ours), "lbfgs_after": left,
        "lbfgs_seconds": median(theirs), "stages": [list(step) for step in result.steps],
        "reasons": Counter(row.reason for row in result.unmended),
        "places": [row.place for row in result.unmended[:3]],
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bases", type=int, default=50)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json")
    options = parser.parse_args()
    print(describe())
    folder = os.environ.get("GMSNET_MESHES")
    rows = []
    for number in range(options.bases):
        name, mesh = base(number, folder)
        for k, severity in enumerate(SEVERITIES):
            rows.append(row := one(name, mesh, severity, 1000 * k + number, options.repeats))
            if row["after"] or row["lbfgs_after"]:
                failed = "FAILED" if row["after"] else "L-BFGS failed"
                print(f"{failed}: {name}, {severity}: {row}", flush=True)
    heads = ("severity", "meshes", "mended", "share", "L-BFGS", "ms", "ms(L-BFGS)", "times", "inverted before")
    print(("{:>18}" + "{:>16}" * (len(heads) - 1)).format(*heads))
    for severity in (*SEVERITIES, "all"):
        chosen = [r for r in rows if severity in (r["severity"], "all") and r["before"]]
        mended, other = sum(r["after"] == 0 for r in chosen), sum(r["lbfgs_after"] == 0 for r in chosen)
        ours, theirs = (1e3 * median(r[key] for r in chosen) for key in ("seconds", "lbfgs_seconds"))
        ratio = median(r["lbfgs_seconds"] / r["seconds"] for r in chosen)
        print(
            f"{severity:>18}{len(chosen):16}{mended:16}{mended / len(chosen):16.1%}{other / len(chosen):16.1%}"
            f"{ours:16.2f}{theirs:16.2f}{ratio:16.1f}{median(r['before'] for r in chosen):16.0f}"
        )
    total = [sum(r[key] for r in rows) for key in ("seconds", "lbfgs_seconds")]
    print(f"all together {total[0]:.2f} s, L-BFGS {total[1]:.2f} s")
    print("last stage:", Counter(r["stages"][-1][0] for r in rows if r["before"]))
    if options.json:
        Path(options.json).write_text(json.dumps({"machine": describe(), "rows": rows}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
