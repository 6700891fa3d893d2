"""Boundaries that move: ``gmsnet.deform`` beside linear elasticity, a Laplacian and radial basis functions.

    GMSNET_MESHES=FOLDER python benchmarks/deform.py [--cases TEXT …] [--json FILE] [--pictures FOLDER]

Airfoils without and with layers are pitched by 30°, heaved by two chords, and both; a hole in a plate of ten radii is
moved by three radii, sideways and towards a corner; a beam with layers on both sides is bent by 90°. Real meshes:
``mesh_NACA0012_inv.su2``, the airfoil with quads and triangles, and the one of quads alone.

Told are: cells inverted; the least and mean 1/q, of all cells and of those that lie outside of layers; the largest
relative change of a spacing normal to a wall that moves; the largest relative change of the area of a cell on it; CPU
seconds of the whole call (all threads, the lesser of two), for gmsnet with the smoothing that follows.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from pathlib import Path

import numpy as np
from layers import strips
from machine import describe
from movers import MOVERS
from scipy.optimize import brentq
from scipy.spatial import cKDTree

import gmsnet
from gmsnet.generate import Curve, good_mesh, layered_mesh
from gmsnet.generate.marked import marked
from gmsnet.generate.structured import SIDES, grid_outline, grid_quads
from gmsnet.measure.report import measure
from gmsnet.topology.topology import Topology

LAYERS, AROUND, ASPECT = 20, 120, 1000.0
PITCH, HEAVE, CHORDS, RADII = -30.0, 2.0, 10.0, 3.0
BEAM_LENGTH, BEAM_COLUMNS, BEAM_ROWS, BEAM_FIRST = 8.0, 100, 12, 0.01


def naca_mesh(edge=0.02):
    """A NACA 0012 with a closed tail in a far field ten chords away; good triangles, no layers."""
    x = (1.0 - np.cos(np.linspace(0.0, math.pi, 200))) / 2.0
    y = 0.6 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    ring = np.concatenate([np.column_stack([x, y])[::-1], np.column_stack([x, -y])[1:]])
    ring[-1] = ring[0]
    tree = cKDTree(ring)
    far = Curve([0.5, 0.0] + CHORDS * circle(400), "farfield")
    return good_mesh([[far], [Curve(ring, "airfoil")]], lambda points: edge + 0.25 * tree.query(points)[0])


def circle(count):
    turn = np.linspace(0.0, 2.0 * math.pi, count)
    turn[-1] = 0.0
    return np.column_stack([np.cos(turn), np.sin(turn)])


def plate_mesh(side=10.0, edge=0.35):
    """A square plate of ten radii with a round hole in its middle."""
    corners = side * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    ends = zip(corners, np.roll(corners, -1, axis=0), SIDES, strict=True)
    sides = [Curve(np.array([a, b]), name) for a, b, name in ends]
    return good_mesh([sides, [Curve(side / 2.0 + circle(241), "hole")]], edge)


def beam_mesh(cells):
    """A beam whose rows of cells grow from both long sides: triangles or quads."""
    growth = brentq(lambda g: BEAM_FIRST * (g**BEAM_ROWS - 1.0) / (g - 1.0) - 0.5, 1.0001, 5.0)
    half = np.append(0.0, np.cumsum(BEAM_FIRST * growth ** np.arange(BEAM_ROWS)))
    half *= 0.5 / half[-1]
    y = np.concatenate([half, 1.0 - half[-2::-1]])
    x, y = np.meshgrid(np.linspace(0.0, BEAM_LENGTH, BEAM_COLUMNS + 1), y)
    node = np.arange(x.size).reshape(x.shape)
    quads, (segments, side) = grid_quads(node), grid_outline(node)
    halves = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    faces = {"quad": quads} if cells == "quad" else {"triangle": halves}
    return marked(np.column_stack([x.ravel(), y.ravel()]), faces, segments, side, SIDES)


def bent(points, angle=math.pi / 2.0):
    """Points of the beam when its middle line is an arc."""
    radius, turn = BEAM_LENGTH / angle, points[:, 0] / BEAM_LENGTH * angle
    way = radius - (points[:, 1] - 0.5)
    return np.column_stack([way * np.sin(turn), radius + 0.5 - way * np.cos(turn)])


def turned(points, degrees, centre=(0.25, 0.0)):
    z = points @ [1.0, 1.0j] - complex(*centre)
    z = complex(*centre) + np.exp(1j * math.radians(degrees)) * z
    return np.column_stack([z.real, z.imag])


def cases(wanted):
    """name → (mesh, ids that are moved, their places, shape of rows of nodes in front, marker of the wall)."""
    folder = Path(os.environ["GMSNET_MESHES"])
    rows = (LAYERS + 1, AROUND)
    airfoils = {
        "NACA": (naca_mesh, None),
        "NACA, SU2's": (lambda: gmsnet.read(folder / "mesh_NACA0012_inv.su2"), None),
        "layers": (lambda: layered_mesh(LAYERS, ASPECT, AROUND), rows),
        "layers of quads": (lambda: layered_mesh(LAYERS, ASPECT, AROUND, cells="mixed"), rows),
        "quads alone": (lambda: layered_mesh(LAYERS, ASPECT, AROUND, cells="quad"), rows),
        "hybrid": (lambda: gmsnet.read(folder / "mesh_NACA0012_lam_hybrid_v1.su2"), None),
        "n0012 quads": (lambda: gmsnet.read(folder / "n0012_113-33.su2"), None),
    }
    found = {}

    def add(name, *case):
        if not wanted or any(text in name for text in wanted):
            found[name] = case

    for name, (make, front) in airfoils.items():
        if wanted and not any(text in name or name in text for text in wanted):
            continue
        mesh = make()
        ids = mesh.markers["airfoil"]
        at = mesh.points[ids, :2]
        pitched = turned(at, PITCH)
        up = np.array([0.0, HEAVE])
        for what, places in (("pitch", pitched), ("heave", at + up), ("both", pitched + up)):
            add(f"{name}: {what}", mesh, ids, places, front, "airfoil")
    plate = plate_mesh()
    ids = plate.markers["hole"]
    for what, way in (("sideways", [RADII, 0.0]), ("to a corner", [RADII / math.sqrt(2.0)] * 2)):
        add(f"hole: {what}", plate, ids, plate.points[ids, :2] + way, None, "hole")
    for cells in ("triangle", "quad"):
        beam = beam_mesh(cells)
        ids = np.unique(np.concatenate([beam.markers[side] for side in SIDES]))
        places = bent(beam.points[ids, :2])
        add(f"beam, {cells}s", beam, ids, places, (2 * BEAM_ROWS + 1, BEAM_COLUMNS + 1), "bottom")
    return found


def wall_cells(mesh, marker):
    """Rows of ``corners`` of the cells with an edge on the wall, and these edges."""
    lines = np.concatenate([block.nodes for block in mesh.cells if block.kind == "line"])
    lines = lines[np.isin(lines, mesh.markers[marker]).all(axis=1)]
    on_wall = {frozenset(edge) for edge in lines.tolist()}
    cells, edges, at = [], [], 0
    for block in mesh.cells:
        if block.kind in ("triangle", "quad"):
            near = np.flatnonzero(np.isin(block.nodes, lines).sum(axis=1) >= 2)
            for row in near.tolist():
                nodes = block.nodes[row].tolist()
                for a, b in zip(nodes, nodes[1:] + nodes[:1], strict=True):
                    if frozenset((a, b)) in on_wall:
                        cells.append(np.array(nodes))
                        edges.append((a, b))
        at += len(block.nodes)
    return cells, np.array(edges)


def area(points, nodes):
    x, y = points[nodes].T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def spacings(mesh, points, front, marker):
    """Normal to the wall: between rows of nodes in front of it; of quads; else the heights of the cells on it."""
    if front:
        rows = points[: front[0] * front[1]].reshape(*front, 2)
        return np.linalg.norm(np.diff(rows, axis=0), axis=-1).ravel()
    if marker == "airfoil" and (rows := strips(mesh)):
        rungs = np.concatenate([row[:, [[0, 3], [1, 2]]].reshape(-1, 2) for row in rows])
        return np.linalg.norm(np.diff(points[rungs], axis=1)[:, 0], axis=1)
    cells, edges = wall_cells(mesh, marker)
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    return 2.0 * np.array([area(points, nodes) for nodes in cells]) / length


def in_layers(mesh, report, front, marker):
    """Which cells of a report have all nodes in layers: of the rows in front, or of the strips of quads on the wall."""
    inside = np.zeros(len(mesh.points), dtype=bool)
    if front:
        inside[: front[0] * front[1]] = True
    elif marker == "airfoil" and (rows := strips(mesh)):
        inside[np.concatenate([row.ravel() for row in rows])] = True
    all_in = np.concatenate([inside[block.nodes].all(axis=1) for block in mesh.cells])
    return all_in[report.cell]


def figures(case, topology, points, seconds):
    mesh, _, _, front, marker = case
    full = mesh.points.copy()
    full[:, :2] = points
    report = measure(mesh.with_points(full), topology)
    outside = ~in_layers(mesh, report, front, marker)
    change = spacings(mesh, points, front, marker) / spacings(mesh, mesh.points[:, :2], front, marker) - 1.0
    cells, _ = wall_cells(mesh, marker)
    areas = [area(points, nodes) / area(mesh.points[:, :2], nodes) - 1.0 for nodes in cells]
    return {
        "inverted": report.inverted, "least": float(report.shape.min()), "mean": float(report.shape.mean()),
        "least outside": float(report.shape[outside].min()) if outside.any() else math.nan,
        "spacing": float(np.abs(change).max()), "wall areas": float(np.abs(areas).max()), "seconds": seconds,
    }  # fmt: skip


def timed(job):
    """What a job returns, and the lesser of the CPU seconds of two runs."""
    seconds = math.inf
    for _ in range(2):
        began = time.process_time()
        done = job()
        seconds = min(seconds, time.process_time() - began)
    return done, seconds


def compare(name, case, pictures):
    mesh, ids, places, _, _ = case
    topology = Topology.of(mesh)
    start = mesh.points[:, :2]
    known = np.zeros(len(start), dtype=bool)
    for held in topology.held.values():
        known[held] = True
    known[ids] = True
    target = start.copy()
    target[ids] = places
    cells = [
        np.concatenate([np.empty((0, n), dtype=int), *(b.nodes for b in mesh.cells if b.kind == kind)])
        for kind, n in (("triangle", 3), ("quad", 4))
    ]
    found = {"as it was": figures(case, topology, start, 0.0)}
    result, seconds = timed(lambda: gmsnet.deform(mesh, places=places, nodes=ids))
    found["gmsnet"] = figures(case, topology, result.points[:, :2], seconds) | {
        "fraction": result.fraction, "steps": result.steps, "sweeps": result.sweeps,
        "exact": bool((result.points[ids, :2] == places).all()),
    }  # fmt: skip
    for mover, move in MOVERS.items():
        points, seconds = timed(lambda move=move: move(start, cells, known, target))
        found[mover] = figures(case, topology, points, seconds)
    show(name, mesh, found)
    if pictures:
        from gmsnet.plot import plot_smoothing

        plot_smoothing(mesh, result.mesh, Path(pictures) / f"{name.replace(': ', '-').replace(' ', '-')}.png")
    return found


def show(name, mesh, found):
    gmsnet_s = found["gmsnet"]
    way = f"{gmsnet_s['fraction']:.4g} of the way in {gmsnet_s['steps']} steps, {gmsnet_s['sweeps']} sweeps"
    print(f"\n{name}: {len(mesh.points):,} nodes; gmsnet: {way}, exact places: {gmsnet_s['exact']}")
    print(f"  {'':22}{'inverted':>9}{'least':>9}{'outside':>9}{'mean':>8}{'spacing':>10}{'areas':>10}{'CPU s':>8}")
    for mover, row in found.items():
        print(
            f"  {mover:22}{row['inverted']:9d}{row['least']:9.4f}{row['least outside']:9.4f}{row['mean']:8.3f}"
            f"{row['spacing']:10.2%}{row['wall areas']:10.2%}{row['seconds']:8.2f}",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", default=[])
    parser.add_argument("--json")
    parser.add_argument("--pictures")
    options = parser.parse_args()
    print(describe())
    results = {name: compare(name, case, options.pictures) for name, case in cases(options.cases).items()}
    if options.json:
        Path(options.json).write_text(json.dumps({"machine": describe(), "results": results}, indent=1))


if __name__ == "__main__":
    main()
