"""What the defaults do to layers that Gmsh's field BoundaryLayer made.

    pip install gmsh
    python benchmarks/gmsh_layers.py [--meshes 40] [--seed 0]

Airfoils, circles and squares in a square, with 6 to 20 rows, triangles or quads, drawn at random. Half of the meshes
are disturbed: free nodes outside of the layers are thrown by up to half of their shortest edge, or by up to two of
their mean edges, so that cells are inverted. Told are the largest change of a spacing normal to the wall (of edges of
the layers that lead away from it) and of an area in the first two rows. They may be 2 and 10 %. Rows count whose cells
are at least twice as long as thick in the median. And the least and mean 1/q of the cells with a free node before and
after.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import gmsh
import numpy as np
from layers import MOST_AREA, MOST_SPACING
from machine import describe
from scipy.spatial import cKDTree

import gmsnet
from gmsnet.generate import disturb
from gmsnet.topology.topology import Topology

THROWN = {"as made": 0.0, "thrown": 0.5, "tangled": 2.0}  # of the shortest edge; of the mean one, if tangled
WHAT = ("as made", "thrown", "as made", "tangled")
AWAY = 0.95  # of its length an edge must lead away from the wall
ASPECT = 2.0
OFF = 0.05  # of a row: so far from its place a node may be
OVER = 1.01  # of a thickness: rounding of places, and bends of the wall


def airfoil(count):
    """(count, 2) around a NACA 0012, tail first."""
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    x = 0.5 * (1.0 + np.cos(turn))
    thick = 0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4
    return np.column_stack([x, np.where(turn <= np.pi, 1.0, -1.0) * 0.6 * thick])


def circle(count):
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return 0.5 * np.column_stack([1.0 + np.cos(turn), np.sin(turn)])


def square(count):
    side = np.linspace(0.0, 1.0, count // 4, endpoint=False)
    zero = np.zeros_like(side)
    sides = ((side, zero - 0.5), (zero + 1.0, side - 0.5), (1.0 - side, zero + 0.5), (zero, 0.5 - side))
    return np.concatenate([np.column_stack(pair) for pair in sides])


BODIES = {"airfoil": (airfoil, (0,)), "circle": (circle, ()), "square": (square, (0, 1, 2, 3))}


def made(body, around, first, growth, rows, quads, path):
    """Writes a mesh. Corners of the wall have fans of cells around them."""
    outline, corners = BODIES[body]
    points = outline(around)
    thickness = first * (growth**rows - 1.0) / (growth - 1.0)
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    tags = [geo.addPoint(x, y, 0.0, 2.5 / around) for x, y in points]
    wall = [geo.addLine(a, b) for a, b in zip(tags, tags[1:] + tags[:1], strict=True)]
    far = [geo.addPoint(x, y, 0.0, 0.8) for x, y in ((-4, -4), (5, -4), (5, 4), (-4, 4))]
    box = [geo.addLine(a, b) for a, b in zip(far, far[1:] + far[:1], strict=True)]
    geo.addPlaneSurface([geo.addCurveLoop(box), geo.addCurveLoop(wall)])
    geo.synchronize()
    field = gmsh.model.mesh.field
    field.add("BoundaryLayer", 1)
    field.setNumbers(1, "CurvesList", wall)
    field.setNumber(1, "Size", first)
    field.setNumber(1, "Ratio", growth)
    field.setNumber(1, "Thickness", thickness)
    field.setNumber(1, "Quads", int(quads))
    if corners:
        field.setNumbers(1, "FanPointsList", [tags[k * around // len(corners)] for k in corners])
    field.setAsBoundaryLayer(1)
    for line in wall:
        gmsh.model.mesh.setTransfiniteCurve(line, 2)
    gmsh.model.addPhysicalGroup(1, wall, name="wall")
    gmsh.model.addPhysicalGroup(1, box, name="far")
    gmsh.model.addPhysicalGroup(2, [1], name="domain")
    gmsh.model.mesh.generate(2)
    gmsh.write(str(path))
    gmsh.finalize()
    return points, thickness


def distance(points, outline):
    """(n,) from a closed polygon."""
    start, end = outline, np.roll(outline, -1, axis=0)
    _, near = cKDTree(0.5 * (start + end)).query(points, k=min(12, len(start)))
    a, along = start[near], (end - start)[near]
    away = points[:, None] - a
    share = np.clip((away * along).sum(axis=2) / (along * along).sum(axis=2), 0.0, 1.0)
    return np.linalg.norm(away - share[:, :, None] * along, axis=2).min(axis=1)


def areas(points, cells):
    """(n,) of cells (n, 3 or 4)."""
    x, y = points[cells, 0], points[cells, 1]
    return 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))


def rungs(points, blocks, away, first, growth):
    """(k, 2) the edges that lead away from the wall, of rows whose cells are ASPECT times as long as thick or more."""
    edges, flat = [], []
    for cells in blocks:
        ends = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2)
        length = np.linalg.norm(points[ends[:, :, 1]] - points[ends[:, :, 0]], axis=2)
        rise = np.abs(away[ends[:, :, 1]] - away[ends[:, :, 0]])
        up = rise >= AWAY * length
        edges.append(np.sort(ends[up], axis=1))
        flat.append((length.max(axis=1)[:, None] >= np.hypot(ASPECT, 1.0) * rise)[up])
    edges, flat = np.concatenate(edges), np.concatenate(flat)
    place = np.log1p(away[edges] * (growth - 1.0) / first) / np.log(growth)  # 1 on the first row, and so on
    row = np.rint(place.max(axis=1)).astype(int)
    made = (abs(place - np.rint(place)) <= OFF).all(axis=1)  # rows end before a thickness that is too large for them
    counts = 2 * np.bincount(row, flat) > np.bincount(row)
    return np.unique(edges[counts[row] & made], axis=0)


def measure(mesh, outline, first, growth, thickness, what, seed):
    """How many cells are inverted in the end, how much spacings and areas change, and the least and mean 1/q of the
    cells with a free node before and after."""
    away = distance(mesh.points[:, :2], outline)
    blocks = [block.nodes for block in mesh.cells if block.kind in ("triangle", "quad")]
    layer = away <= OVER * thickness
    edges = rungs(mesh.points, [b[layer[b].all(axis=1)] for b in blocks], away, first, growth)
    rise = np.abs(away[edges[:, 1]] - away[edges[:, 0]])
    free = Topology.of(mesh).free
    valid, outside = what != "tangled", free[~layer[free]]
    edge = "shortest" if valid else "mean"
    given = disturb(mesh, outside, THROWN[what], seed=seed, keep_valid=valid, edge=edge) if THROWN[what] else mesh
    result = gmsnet.smooth(given)
    now = distance(result.points[:, :2], outline)
    changes = np.abs(np.abs(now[edges[:, 1]] - now[edges[:, 0]]) / rise - 1.0)
    two = [b[(away[b] <= OVER * first * (1.0 + growth)).all(axis=1)] for b in blocks]
    pairs = [(areas(mesh.points, cells), areas(result.points, cells)) for cells in two]
    of_areas = np.concatenate([np.abs(after / before - 1.0) for before, after in pairs])
    left = result.after.inverted
    return left, changes, of_areas, [(totals.shape_min, totals.shape_mean) for totals in result.judged]


def drawn(number, draw, path):
    """Makes and measures a mesh. Whether it passes, and what to say."""
    body, quads, what = list(BODIES)[number % 3], bool(number // 3 % 2), WHAT[number // 6 % 4]
    around, rows = 4 * int(draw.integers(15, 41)), int(draw.integers(6, 21))
    first, growth = 10 ** draw.uniform(-4.0, -2.3), draw.uniform(1.1, 1.35)
    outline, thickness = made(body, around, first, growth, rows, quads, path)
    mesh = gmsnet.read(path)
    left, changes, of_areas, shapes = measure(mesh, outline, first, growth, thickness, what, number)
    return not left and changes.max() <= MOST_SPACING and of_areas.max() <= MOST_AREA, (
        f"{body:8}{'quads' if quads else 'triangles':10}{what:8}"
        f"{around:4} around, {rows:2} rows, first {first:.1e}, growth {growth:.2f}: "
        f"{len(mesh.points):5,} nodes, {len(changes):5,} spacings by {changes.max():.1%}, "
        f"{len(of_areas):5,} areas by {of_areas.max():.1%}; "
        f"1/q {shapes[0][0]:.3f} {shapes[0][1]:.3f} → {shapes[1][0]:.3f} {shapes[1][1]:.3f}"
    )


def run(title, meshes, of_each, goal):
    """Reads the options, prints a line for each mesh, and how many pass. meshes: how many by default."""
    parser = argparse.ArgumentParser(description=title)
    parser.add_argument("--meshes", type=int, default=meshes)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(describe(), f"gmsh {gmsh.__version__}")
    good = 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(options.meshes):
            draw = np.random.default_rng([options.seed, number])
            passed, text = of_each(number, draw, Path(folder) / f"{number}.msh")
            good += passed
            print(f"{number:3} {text}; {'pass' if passed else 'FAIL'}", flush=True)
    print(f"{good} of {options.meshes} {goal}")


if __name__ == "__main__":
    goal = f"keep spacings within {MOST_SPACING:.0%} and areas within {MOST_AREA:.0%}, without an inverted cell"
    run(__doc__.splitlines()[0], 40, drawn, goal)
