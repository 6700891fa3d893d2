"""What is gained when nodes at random places along a boundary slide, what it costs, and is every promise kept?

    python benchmarks/sliding.py [--nodes 1e4] [--seeds 0 1 2 3 4] [--shapes square circle …] [--repeats 3]
        [--json FILE]

Random points in a square, a disc and an oblique quadrilateral, triangulated, with random spacing on the boundary as
well: some boundary edges are a thousand times shorter than others, and their cells cannot get better while the nodes
stand still. "quads" and "mixed" are squares whose triangles were joined to quads, all of them or most.

Each is smoothed with the defaults, without ``slide`` and with ``slide=True``: min and mean 1/q of all cells, q̂ (of
triangles alone), and seconds of the processor on one thread (medians; after a call on a small mesh). Then, of the slid
mesh, without asking gmsnet where its curves are:

- corners have not moved, and the nodes of each side, or of the circle, follow each other as before;
- nodes of a side along an axis keep the bits of that coordinate; of an oblique side they are within rounding of the
  line through its corners, measured in fractions;
- the radius of the circle changes by less than 0.001 of the mean boundary edge;
- the area changes by less than the sum over the input's boundary edges of 2/3·chord·sagitta, the segments cut off by
  circles through three nodes.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from statistics import median

import numpy as np
from corners import Corners
from machine import describe, others_use

import gmsnet
from gmsnet.generate import random_mesh, random_quad_mesh
from gmsnet.preserve.protection import LAYER

OBLIQUE = np.array([[0.1, 0.2], [1.3, -0.1], [1.0, 0.9], [-0.2, 1.1]])
SHAPES = ("square", "circle", "oblique", "quads", "mixed")
SMALL = 300  # nodes of the mesh to warm up with
DRIFT = 1e-3  # of the mean boundary edge
ROUNDING = 2.0**-52  # of the largest coordinate: half a unit of each of two coordinates, and room


def made(shape, nodes, seed):
    """A mesh of the benchmark."""
    if shape in ("quads", "mixed"):
        return random_quad_mesh(nodes, cells="quad" if shape == "quads" else shape, boundary="random", seed=seed)
    return random_mesh(nodes, [OBLIQUE] if shape == "oblique" else shape, boundary="random", seed=seed)


def loop(mesh):
    """The ids of the boundary's nodes, one after the other; its line cells are its edges."""
    lines = np.concatenate([block.nodes for block in mesh.cells if block.kind == "line"])
    beside = {}
    for a, b in lines.tolist():
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    order = [int(lines[0, 0]), int(lines[0, 1])]
    while len(order) < len(beside):
        order += [node for node in beside[order[-1]] if node != order[-2]]
    return np.array(order)


def sides(shape, mesh, around):
    """The nodes of each straight side in order, its two corners among them; none for a circle."""
    if shape == "circle":
        return []
    corners = OBLIQUE if shape == "oblique" else np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    at = sorted(int(np.abs(mesh.points[around] - corner).sum(axis=1).argmin()) for corner in corners)
    rolled = np.append(np.roll(around, -at[0]), around[at[0]])
    places = [k - at[0] for k in at] + [len(around)]
    return [rolled[low : high + 1] for low, high in pairwise(places)]


def area(points, around):
    """Of the polygon, from exact products, rounded once."""
    exact = [[Fraction(x), Fraction(y)] for x, y in points[around].tolist()]
    pairs = zip(exact, exact[1:] + exact[:1], strict=True)
    return float(abs(sum(px * qy - py * qx for (px, py), (qx, qy) in pairs)) / 2)


def segments(points, around):
    """The sum of 2/3·chord·sagitta over the edges, each with the sharper of the two circles through three nodes."""
    p = points[around]
    before, after = np.roll(p, 1, axis=0), np.roll(p, -1, axis=0)
    chord = np.linalg.norm(after - p, axis=1)
    double = (p - before)[:, 0] * (after - p)[:, 1] - (p - before)[:, 1] * (after - p)[:, 0]
    curvature = 2.0 * np.abs(double) / (np.roll(chord, 1) * chord * np.linalg.norm(after - before, axis=1))
    half = np.minimum(chord * np.maximum(curvature, np.roll(curvature, -1)) / 2.0, 1.0)
    return float((2.0 / 3.0 * chord * (chord / 2.0 * half / (1.0 + np.sqrt(1.0 - half * half)))).sum())


def off_line(points, side):
    """The largest distance of a side's nodes from the line through its ends."""
    (ax, ay), (bx, by) = ([Fraction(v) for v in points[node].tolist()] for node in side[[0, -1]])
    cross = [abs((bx - ax) * (Fraction(y) - ay) - (by - ay) * (Fraction(x) - ax)) for x, y in points[side].tolist()]
    return float(max(cross)) / math.hypot(float(bx - ax), float(by - ay))


def kept(shape, mesh, points):
    """Figures, and name → whether a promise is kept, of the slid mesh with these points."""
    around = loop(mesh)
    edge = float(np.linalg.norm(np.diff(mesh.points[around], axis=0), axis=1).mean())
    change, figures, passed = area(points, around) - area(mesh.points, around), {}, {}
    if shape == "circle":
        angle = np.unwrap(np.arctan2(*(points[around] - 0.5).T[::-1]))
        steps = np.diff(np.append(angle, angle[0] + math.copysign(2.0 * np.pi, angle[-1] - angle[0])))
        figures["drift"] = float(np.abs(np.linalg.norm(points[around] - 0.5, axis=1) - 0.5).max() / edge)
        bound = segments(mesh.points, around)
        passed |= {
            "order": bool((np.sign(steps) == np.sign(steps[0])).all()),
            "radius": figures["drift"] < DRIFT,
            "area": abs(change) < bound,
        }
        figures |= {"area bound": bound}
    else:
        strips = sides(shape, mesh, around)
        corners, away, order, bits = [side[0] for side in strips], 0.0, True, True
        for side in strips:
            a, b = points[side[[0, -1]]]
            order &= bool((np.diff((points[side] - a) @ (b - a)) > 0.0).all())
            away = max(away, off_line(points, side) / np.abs(points).max())
            same = (mesh.points[side] == mesh.points[side[0]]).all(axis=0)
            bits &= bool((points[side][:, same] == mesh.points[side[0], same]).all()) and same.any() == (a == b).any()
        figures["off line"] = away
        passed |= {
            "corners": bool((points[corners] == mesh.points[corners]).all()),
            "order": order,
            "bits": bits,
            "line": away <= ROUNDING,
            "area": abs(change) <= ROUNDING * len(around),
        }
    return {**figures, "area change": change}, passed


def study(shape, mesh, repeats):
    """The figures with and without sliding, and which promises are kept."""
    figures, seconds = {}, {False: [], True: []}
    for _ in range(repeats):
        for slide in seconds:
            began = time.process_time()
            result = gmsnet.smooth(mesh, slide=slide or None, threads=1)
            seconds[slide].append(time.process_time() - began)
            report = result.after
            figures["slid" if slide else "held"] = {
                "min": float(report.shape.min()), "mean": float(report.shape.mean()), "qhat": float(report.qhat),
                "inverted": int(report.inverted), "sweeps": result.sweeps, "notes": result.notes,
                "layer": len(result.held.get(LAYER, ())),
            }  # fmt: skip
    around, before = loop(mesh), result.before
    figures["input"] = {
        "min": float(before.shape.min()), "mean": float(before.shape.mean()), "qhat": float(before.qhat)
    }  # fmt: skip
    told, passed = kept(shape, mesh, result.points)
    stood = np.ones(len(mesh.points), dtype=bool)
    stood[around] = False
    passed |= {
        "no worse": figures["slid"]["min"] >= figures["held"]["min"],
        "0 invalid": Corners.of(mesh).figures(result.points)["invalid"] == 0,
    }
    return {
        **figures, **told, "nodes": len(mesh.points), "boundary": len(around), "slid nodes": int(
            (result.points[around] != mesh.points[around]).any(axis=1).sum()
        ), "seconds": {name: median(seconds[slide]) for name, slide in (("held", False), ("slid", True))},
        "passed": {check: bool(good) for check, good in passed.items()},
    }  # fmt: skip


def show(name, row):
    def three(key, digits):
        return " ".join(f"{row[k][key]:8.{digits}f}" for k in ("input", "held", "slid"))

    failed = [check for check, passed in row["passed"].items() if not passed]
    layer = f", {row['slid']['layer']} nodes held as a layer" if row["slid"]["layer"] else ""
    told = f"drift {row['drift']:.1e}" if "drift" in row else f"off line {row['off line']:.1e}"
    print(f"  {name:10} {row['nodes']:6,} {row['slid nodes']:4}/{row['boundary']:<4} {three('min', 4)}  "
          f"{three('mean', 4)}  {three('qhat', 4)}  {row['seconds']['held']:6.2f} {row['seconds']['slid']:6.2f}  "
          f"{told}, area {row['area change']:+.1e}" + (f" of {row['area bound']:.1e}" if "area bound" in row else "")
          + layer + ("  pass" if not failed else f"  FAIL: {', '.join(failed)}"), flush=True)  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=float, default=1e4)
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--shapes", nargs="+", choices=SHAPES, default=list(SHAPES))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print(describe())
    _, load = others_use(lambda: time.sleep(1.0))
    print(f"other processes use {load:.0%} of the processors")
    columns = "  ".join(f"{name:>8} {'held':>8} {'slid':>8}" for name in ("min 1/q", "mean", "q̂"))
    print(f"\n  {'':10} {'nodes':>6} {'slid':>9} {columns}   s held   slid")
    rows = {}
    for shape in options.shapes:
        for slide in (None, True):
            gmsnet.smooth(made(shape, SMALL, 0), slide=slide, threads=1)
        for seed in options.seeds:
            name = f"{shape}/{seed}"
            rows[name] = study(shape, made(shape, int(options.nodes), seed), options.repeats)
            show(name, rows[name])
    good = sum(all(row["passed"].values()) for row in rows.values())
    print(f"\n{good} of {len(rows)} pass; one thread, medians of {options.repeats}")
    if options.json:
        document = {"machine": describe(), "meshes": rows}
        options.json.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return 0 if good == len(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
