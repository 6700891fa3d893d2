"""Is a mesh without layers smoothed as far as it goes, and is a mesh with layers left its layers?

    python benchmarks/intent.py [--meshes 200] [--seed 0] [--only N …] [--parts quality layers] [--json FILE]

*quality*: so many meshes whose cells nobody stretched on purpose: grids that were sheared, swirled, folded to zigzags,
or thrown about and stretched, of triangles and of quads; plates whose hole was moved or squashed; terrain; graded and
random squares; 1,000 to 5,000 nodes. Each is smoothed with the defaults and with ``preserve="none"``. The reference is
one run of whole-mesh L-BFGS (barrier.py) from the mesh as it is, with nothing held but the boundary, on the mean of q,
q², q⁴ or q⁸: that of the four which brings the best q̂. Where there are quads, for which there is no q̂, the least 1/q
and the mean are compared, and their sum tells the best of the four. Both are over the cells with a node that is not of
the boundary. It passes if the defaults end at most 0.02 below the reference in q̂ (in the mean) and 0.03 in the least
1/q, ``preserve="none"`` 0.01 and 0.02, both without an invalid cell.

*layers*: the same meshes, every fourth thrown by 1 to 3 edges so that it is tangled; and as many with layers
(``layered_mesh``, one in eight ``c_grid_mesh``: 10 to 30 rows, aspects of 5 to 1,000 at the wall), half of them with
the nodes outside of the layers thrown by up to half an edge, a quarter by one edge so that cells are inverted there.
Told is where layers are found and held. Of those that are there no spacing between rows may change by more than 2 %,
and no area in the first two rows by more than 10 %, after smoothing with the defaults. A row counts whose cells have
sides of a ratio of ASPECT or more.

Each mesh follows from the seed and its number, and is told as what makes it; ``--only`` takes some by their numbers.
Each has a line as soon as it is done, so that a run which is cut off leaves what it found.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import cache
from pathlib import Path

import numpy as np
from barrier import minimise
from corners import Corners
from machine import describe

import gmsnet
from gmsnet import CellBlock
from gmsnet.generate import (
    c_grid_mesh,
    disturb,
    graded_mesh,
    kershaw_mesh,
    layered_mesh,
    moved_hole_mesh,
    random_mesh,
    sheared_mesh,
    swirled_mesh,
    terrain_mesh,
    zigzag_mesh,
)
from gmsnet.generate.layered import BODIES, CELLS
from gmsnet.preserve.protection import LAYER, NONE
from gmsnet.topology.ordering import planar_points
from gmsnet.topology.topology import Topology

LESS = {"default": (0.02, 0.03), "none": (0.01, 0.02)}  # of q̂, or the mean where there are quads, and of the least 1/q
POWERS = (1, 2, 4, 8)
FEWEST, MOST = 1000, 5000  # nodes
ROUNDING = 1e-9
MOST_SPACING, MOST_AREA = 0.02, 0.1
ASPECT = 2.0  # of a row that counts
THROW, TANGLE = 0.5, 1.0  # edges, outside of layers
PARTS = ("quality", "layers")


def thrown(mesh, amount, seed):
    """Its inner nodes thrown about, kept valid."""
    return disturb(mesh, Topology.of(mesh).free, amount, seed=seed, edge="shortest")


def tangled(mesh, amount, seed):
    """Its inner nodes thrown by up to so many edges, wherever they land."""
    return disturb(mesh, Topology.of(mesh).free, amount, seed=seed, keep_valid=False)


def stretched(columns, rows, amount, factor, cells, seed):
    """A grid of squares thrown about, then stretched."""
    mesh = sheared_mesh(columns, rows, amplitude=0.0, cells=cells)
    mesh = mesh.with_points(mesh.points * (columns, rows))
    mesh = thrown(mesh, amount, seed)
    return mesh.with_points(mesh.points * (factor, 1.0))


MAKERS = {
    function.__name__: function
    for function in (c_grid_mesh, disturb, graded_mesh, kershaw_mesh, layered_mesh, moved_hole_mesh, random_mesh,
                     sheared_mesh, stretched, swirled_mesh, tangled, terrain_mesh, thrown, zigzag_mesh)
}  # fmt: skip
MAKERS["moved_hole_mesh"] = cache(moved_hole_mesh)  # it takes seconds


def grid(draw):
    """Columns and rows."""
    nodes, ratio = draw.uniform(FEWEST, MOST), draw.uniform(0.5, 2.0)
    return f"{round((nodes * ratio) ** 0.5)}, {round((nodes / ratio) ** 0.5)}"


def sheared(draw, cells="triangle"):
    return (f"sheared_mesh({grid(draw)}, amplitude={draw.uniform(0.2, 0.95):.3f}, "
            f"waves={draw.uniform(0.5, 4.0):.2f}, cells={cells!r})")  # fmt: skip


def swirled(draw, cells="triangle"):
    return f"swirled_mesh({grid(draw)}, angle={draw.uniform(0.4, 1.8):.3f}, cells={cells!r})"


def zigzag(draw, cells="triangle"):
    return f"zigzag_mesh({grid(draw)}, height={draw.uniform(0.05, 0.44):.3f}, cells={cells!r})"


def stretched_grid(draw, cells="triangle"):
    return (f"stretched({grid(draw)}, {draw.uniform(0.1, 0.5):.3f}, {draw.uniform(1.5, 6.0):.3f}, {cells!r}, "
            f"{seed(draw)})")  # fmt: skip


def seed(draw):
    return int(draw.integers(1000))


def hole(draw, moved):
    edge = draw.uniform(0.018, 0.034)
    way = f"shift={draw.uniform(0.3, 1.4):.3f}" if moved else f"shift=0.0, squash={draw.uniform(0.1, 0.8):.3f}"
    return f"moved_hole_mesh({edge:.4f}, {way}, turn={draw.uniform(0.0, 6.28):.2f})"


def terrain(draw):
    nodes, ratio = draw.uniform(1200, 4200), draw.uniform(1.5, 6.0)  # 2.3·lines²·ratio nodes, give or take a third
    return f"terrain_mesh({round((nodes / (2.3 * ratio)) ** 0.5)}, ratio={ratio:.2f}, seed={seed(draw)})"


def size(draw, most=MOST):
    return int(draw.integers(FEWEST, most))


# kind → from a generator of random numbers to what makes a mesh, as text.
KINDS = {
    "sheared": sheared,
    "swirled": swirled,
    "zigzag": zigzag,
    "stretched": stretched_grid,
    "hole moved": lambda draw: hole(draw, moved=True),
    "hole squashed": lambda draw: hole(draw, moved=False),
    "terrain": terrain,
    "graded": lambda draw: f"graded_mesh({size(draw)}, {10 ** draw.uniform(0.5, 3):.1f}, seed={seed(draw)})",
    "random": lambda draw: f"random_mesh({size(draw, 4000)}, seed={seed(draw)})",
    "sheared, thrown": lambda draw: f"thrown({sheared(draw)}, {draw.uniform(0.1, 0.4):.3f}, {seed(draw)})",
    "Kershaw quads": lambda draw: f"kershaw_mesh({grid(draw)}, flatness={10 ** draw.uniform(-1.3, -0.2):.3f})",
    "sheared quads": lambda draw: sheared(draw, "quad"),
    "swirled quads": lambda draw: swirled(draw, "quad"),
    "stretched quads": lambda draw: stretched_grid(draw, "quad"),
}


def plan(count, begin):
    """Kind and text of each mesh without layers."""
    kinds = list(KINDS)
    for number in range(count):
        kind = kinds[number % len(kinds)]
        yield kind, KINDS[kind](np.random.default_rng([begin, number]))


def made(text):
    """The mesh, of a text that this module has written."""
    return eval(text, {"__builtins__": {}}, MAKERS)


def figures(corners, points, *, triangles):
    """What is compared: q̂ where there are triangles only, least and mean 1/q, invalid cells; and q̂ over all cells."""
    found, mesh, score, every = corners.figures(points), corners.mesh.with_points(points), None, None
    if triangles:
        every = gmsnet.quality(mesh).qhat
        blocks = [
            (block, corners.problem.free[block.nodes].any(axis=1)) for block in mesh.cells if block.dimension == 2
        ]
        some = tuple(CellBlock(block.kind, block.nodes[chosen], block.regions[chosen]) for block, chosen in blocks)
        score = gmsnet.quality(gmsnet.Mesh(mesh.points, tuple(some))).qhat
    return {
        "score": found["min"] + found["mean"] if score is None else score, "least": found["min"],
        "mean": found["mean"], "invalid": found["invalid"], "qhat_of_all": every,
    }  # fmt: skip


def reference(corners, *, triangles):
    """The figures of the best of POWERS, with its power; and the score for each."""
    start, best, scores = planar_points(corners.mesh), None, {}
    for power in POWERS:
        found = minimise(corners.problem, start, power)
        there = figures(corners, corners.written(found.points), triangles=triangles)
        scores[power] = there["score"]
        if best is None or there["score"] > best["score"]:
            best = {**there, "power": power, "converged": found.converged}
    return {**best, "scores": scores}


def study(mesh):
    """One mesh without layers: what it is as it is, after both calls, and the reference; and what it falls short."""
    corners = Corners.of(mesh)
    triangles = not corners.problem.right.any()
    row = {"nodes": len(mesh.points), "before": figures(corners, mesh.points, triangles=triangles)}
    if row["before"]["invalid"]:
        return {**row, "skipped": True}
    best = row["reference"] = reference(corners, triangles=triangles)
    mean = "score" if triangles else "mean"
    row["passed"] = True
    for name, options in (("default", {}), ("none", {"preserve": NONE})):
        result = gmsnet.smooth(mesh, threads=1, **options)
        found = figures(corners, result.points, triangles=triangles)
        short = {"mean": best[mean] - found[mean], "least": best["least"] - found["least"]}
        good = [value <= most + ROUNDING for value, most in zip(short.values(), LESS[name], strict=True)]
        row[name] = {**found, **told(mesh, result), "short": short, "passed": all(good) and not found["invalid"]}
        row["passed"] &= row[name]["passed"]
    return row


def told(mesh, result):
    """The share of the nodes that are held as layers, what was done, and why it ended."""
    free, layers = len(Topology.of(mesh).free), len(result.held.get(LAYER, ()))
    stages = [sweep.stage for sweep in result.history]
    return {
        "held": layers / max(free, 1), "sweeps": result.sweeps, "stop": result.stop_reason, "notes": result.notes,
        "stages": [stage for k, stage in enumerate(stages) if k == 0 or stage != stages[k - 1]],
        "seconds": result.seconds,
    }  # fmt: skip


def quality(options):
    """Prints and returns the first part."""
    rows = {}
    for number, (kind, text) in enumerate(plan(options.meshes, options.seed)):
        if not options.only or number in options.only:
            row = rows[number] = {"kind": kind, "text": text, **study(made(text))}
            print(f"{number:4} {kind}: {in_short(row)}", flush=True)
    skipped = [row for row in rows.values() if row.get("skipped")]
    good = {number: row for number, row in rows.items() if not row.get("skipped")}
    print(f"\n{'':17}{'':>7}{'':>8}{'default falls short by':^25}{'none falls short by':^22}{'held by':>9}")
    print(f"{'':17}{'meshes':>7}{'passed':>8}" + 2 * f"{'q̂ (mean)':>13}{'least':>9}" + f"{'default':>10}")
    for kind in KINDS:
        table_row(kind, [row for row in good.values() if row["kind"] == kind])
    table_row("all", list(good.values()))
    print(f"{len(skipped)} more have inverted cells to begin with" if skipped else "")
    for number, row in good.items():
        if row["passed"]:
            continue
        print(f"FAIL {number}: {row['text']}; {row['nodes']:,} nodes")
        for name in ("before", "reference", "default", "none"):
            each = row[name]
            print(f"    {name:10} score {each['score']:8.4f}  least {each['least']:7.4f}  mean {each['mean']:7.4f}  "
                  f"{each['invalid']} invalid  {remark(name, each)}")  # fmt: skip
    return rows


def in_short(row):
    """How far both calls fall short, in one line."""
    if row.get("skipped"):
        return "has inverted cells to begin with"
    each = (f"{name} {row[name]['short']['mean']:.4f} {row[name]['short']['least']:.4f}" for name in LESS)
    return f"falls short by {', '.join(each)}" + ("" if row["passed"] else "  FAIL")


def remark(name, row):
    if name == "before":
        return ""
    if name == "reference":
        return f"L-BFGS on q^{row['power']}" + ("" if row["converged"] else ", not converged")
    done = f"{row['sweeps']} sweeps, {row['held']:.1%} held: {', '.join(row['stages'])}"
    return done if row["passed"] else f"FAIL, {done}"


def table_row(kind, rows):
    if not rows:
        return
    short = [[row[name]["short"] for row in rows] for name in LESS]
    worst = "".join(f"{max(s['mean'] for s in each):13.4f}{max(s['least'] for s in each):9.4f}" for each in short)
    held = np.mean([row["default"]["held"] for row in rows])
    print(f"{kind:17}{len(rows):7}{sum(row['passed'] for row in rows):8}{worst}{held:10.1%}")


def layered_plan(count, begin):
    """Text, rows, nodes around, aspect, and what is done outside of the layers, for each mesh with layers."""
    for number in range(count):
        draw = np.random.default_rng([begin, 1, number])
        layers, around = int(draw.integers(10, 31)), int(draw.integers(60, 161))
        aspect = float(f"{10 ** draw.uniform(np.log10(5.0), 3.0):.1f}")
        cells, body = CELLS[number % 3], BODIES[draw.integers(len(BODIES))]
        if number % 8 == 7:
            text = (
                f"c_grid_mesh({layers}, {aspect}, {around // 2 * 2}, cells={('quad', 'triangle')[number // 8 % 2]!r})"
            )
        else:
            text = f"layered_mesh({layers}, {aspect}, {around}, cells={cells!r}, body={body!r})"
        yield text, layers, around, aspect, ("disturbed", "as it is", "disturbed", "tangled")[number // 3 % 4]


def layered(text, layers, around, aspect, what, number):
    """One mesh with layers, after smoothing with the defaults."""
    mesh = made(text)
    nodes = rows_of_c_grid(mesh, layers) if text.startswith("c_grid") else rows_of_o_grid(layers, around)
    outside, given = np.setdiff1d(Topology.of(mesh).free, nodes), mesh
    if what != "as it is":
        amount, valid = (THROW, True) if what == "disturbed" else (TANGLE, False)
        edge = "shortest" if valid else "mean"
        given = disturb(mesh, outside, amount, seed=number, keep_valid=valid, edge=edge)
    result = gmsnet.smooth(given, threads=1)
    axes = list(mesh.plane)
    was, now = (points[:, axes][nodes] for points in (mesh.points, result.points))
    space = np.abs(spacing(now) / spacing(was) - 1.0).max(axis=1)
    counts = aspect ** (1.0 - np.arange(layers) / layers) >= ASPECT
    row = {
        "spacing": float(space[counts].max()), "spacing of all rows": float(space.max()),
        "area": float(np.abs(areas(now[:3]) / areas(was[:3]) - 1.0).max()),
        "invalid before": result.before.inverted, "invalid": result.after.inverted, **told(given, result),
    }  # fmt: skip
    row["kept"] = row["spacing"] <= MOST_SPACING and row["area"] <= MOST_AREA
    return row


def rows_of_o_grid(layers, around):
    """(layers + 1, around + 1) the nodes of the rows; the last is the first."""
    rows = np.arange((layers + 1) * around).reshape(-1, around)
    return np.hstack([rows, rows[:, :1]])


def rows_of_c_grid(mesh, layers):
    """(layers + 1, K) the nodes of the rows, from one side of the outlet to the other."""
    quads = mesh.cells[0].nodes
    if quads.shape[1] == 3:
        one, two = np.split(quads, 2)
        quads = np.hstack([one, two[:, 2:]])
    columns = 1 + int(np.argmax(quads[1:, 0] == quads[0, 3]))
    quads = quads.reshape(-1, columns, 4)[:layers]
    below, above = np.hstack([quads[:, :, 0], quads[:, -1:, 1]]), np.append(quads[-1, :, 3], quads[-1, -1, 2])
    return np.vstack([below, above])


def spacing(rows):
    return np.linalg.norm(np.diff(rows, axis=0), axis=-1)


def areas(rows):
    """Of the quads between rows of nodes (n, m, 2)."""
    a, b, c, d = rows[:-1, :-1], rows[:-1, 1:], rows[1:, 1:], rows[1:, :-1]
    one, two = c - a, d - b
    return 0.5 * np.abs(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0])


def layers(options):
    """Prints and returns the second part."""
    without, having = {}, {}
    for number, (kind, text) in enumerate(plan(options.meshes, options.seed)):
        if options.only and number not in options.only:
            continue
        tangle = number % 4 == 3
        if tangle:
            draw = np.random.default_rng([options.seed, 2, number])
            text = f"tangled({text}, {draw.uniform(1.0, 3.0):.2f}, {seed(draw)})"
        mesh = made(text)
        result = gmsnet.smooth(mesh, threads=1)
        row = {"invalid before": result.before.inverted, "invalid": result.after.inverted, **told(mesh, result)}
        without[number] = {"kind": kind, "text": text, "what": "tangled" if tangle else "as it is", **row}
        print(f"{number:4} no layers, {kind}: {row['held']:.1%} held, {row['invalid']} inverted", flush=True)
    for number, (text, *rest) in enumerate(layered_plan(options.meshes, options.seed)):
        if not options.only or number in options.only:
            row = having[number] = {"text": text, "what": rest[-1], **layered(text, *rest, number)}
            print(f"{number:4} layers, {rest[-1]}: {row['held']:.1%} held, spacings by {row['spacing']:.1%}, "
                  f"areas {row['area']:.1%}, {row['invalid']} inverted", flush=True)  # fmt: skip
    confusion(without, having)
    return {"without": without, "with": having}


def confusion(without, having):
    print(f"\n{'':28}{'meshes':>7}{'held':>7}{'nothing held':>14}   of these with inverted cells before, after")
    groups = [("no layers", without, what) for what in ("as it is", "tangled")]
    groups += [("layers", having, what) for what in ("as it is", "disturbed", "tangled")]
    for name, rows, what in groups:
        own = [row for row in rows.values() if row["what"] == what]
        found = sum(row["held"] > 0.0 for row in own)
        before, after = (sum(row[key] > 0 for row in own) for key in ("invalid before", "invalid"))
        print(f"{name + ', ' + what:28}{len(own):7}{found:7}{len(own) - found:14}   {before}, {after}")
    kept = sum(row["kept"] for row in having.values())
    print(f"layers kept: {kept} of {len(having)} (spacings within {MOST_SPACING:.0%}, areas within {MOST_AREA:.0%})")
    for number, row in without.items():
        if row["held"] or row["invalid"]:
            print(f"FAIL {number}: {row['text']}: {row['held']:.1%} of the nodes held, {row['invalid']} cells inverted")
    for number, row in having.items():
        if not row["held"] or not row["kept"] or row["invalid"]:
            print(f"FAIL {number}: {row['text']}, {row['what']} outside: {row['held']:.1%} held, spacings by up to "
                  f"{row['spacing']:.1%} (all rows: {row['spacing of all rows']:.1%}), areas {row['area']:.1%}, "
                  f"{row['invalid']} cells inverted (of {row['invalid before']})")  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--meshes", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", type=int, help="numbers of meshes")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print(describe())
    began, document = time.perf_counter(), {"machine": describe(), "seed": options.seed}
    for part, run in (("quality", quality), ("layers", layers)):
        if part in options.parts:
            document[part] = run(options)
    print(f"\n{time.perf_counter() - began:.0f} s")
    if options.json:
        options.json.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
