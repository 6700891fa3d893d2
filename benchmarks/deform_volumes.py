"""Boundaries of volumes that move: ``gmsnet.deform`` beside linear elasticity, a Laplacian and radial basis functions.

    python benchmarks/deform_volumes.py [--cases TEXT …] [--size CELLS] [--json FILE]

A sphere in a part is moved and turned; a side of a random cube is pushed in; a beam of a lattice is bent by 90° and
twisted; a wall with layers of thin tetrahedra bulges. Told are cells inverted, the least and mean η of those with a
free node, with layers of those outside of them; the largest relative change of a spacing of the layers' first half; and
CPU seconds of the whole call, the lesser of two, for gmsnet with the smoothing that follows.
"""

from __future__ import annotations

import argparse
import json
import math
import time

import numpy as np
from machine import describe
from movers import MOVERS

import gmsnet
from gmsnet.generate import lattice_volume, layered_volume, part_volume, random_volume

BEAM = 4.0  # its length over its height
ROWS = 8


def bent(points):
    """Points of the beam when its middle line is a quarter of a circle."""
    angle = math.pi / 2.0
    radius, turn = BEAM / angle, points[:, 0] / BEAM * angle
    way = radius - (points[:, 2] - 0.5)
    return np.column_stack([way * np.sin(turn), points[:, 1], radius + 0.5 - way * np.cos(turn)])


def twisted(points, degrees=180.0):
    """Points of the beam when its end has turned about the middle line."""
    turn = np.radians(degrees) * points[:, 0] / BEAM
    y, z = points[:, 1] - 0.5, points[:, 2] - 0.5
    return np.column_stack([
        points[:, 0], np.cos(turn) * y - np.sin(turn) * z + 0.5, np.sin(turn) * y + np.cos(turn) * z + 0.5,
    ])  # fmt: skip


def bump(points, height):
    """Points of a face across z that bulges."""
    x, y = points[:, 0], points[:, 1]
    shift = height * (np.sin(np.pi * x) * np.sin(np.pi * y)) ** 2
    return points + shift[:, None] * [0.0, 0.0, 1.0]


def turned(points, degrees, centre=(0.65, 0.65, 0.5)):
    """Points turned about an axis across."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(np.radians(degrees) * np.ones(3) / math.sqrt(3.0))
    return turn.apply(points - centre) + centre


def cases(size):
    """name → (mesh, ids that are moved, their places, nodes of a level of the layers or None)."""
    part = part_volume(size)
    sphere = part.markers["sphere"]
    at = part.points[sphere]
    yield "sphere moved", part, sphere, at + np.array([0.12, -0.12, 0.1]), None
    yield "sphere turned", part, sphere, turned(at, 60.0), None
    cube = random_volume(size**3, seed=1)
    top = cube.markers["top"]
    yield "side pushed in", cube, top, bump(cube.points[top], -0.4), None
    beam = lattice_volume(max(size // 2, 4))
    beam = beam.with_points(beam.points * [BEAM, 1.0, 1.0])
    skin = np.unique(np.concatenate([block.nodes.ravel() for block in beam.cells if block.dimension == 2]))
    yield "beam bent", beam, skin, bent(beam.points[skin]), None
    yield "beam twisted", beam, skin, twisted(beam.points[skin]), None
    layers = layered_volume(size, ROWS)
    wall = layers.markers["bottom"]
    for height in (0.1, 0.2):
        yield f"wall bulges by {height}", layers, wall, bump(layers.points[wall], height), (size + 1) ** 2


def figures(mesh, points, level):
    """What is told of a result."""
    report = gmsnet.quality(mesh.with_points(points))
    tetrahedra = next(block.nodes for block in mesh.cells if block.kind == "tetra")
    skin = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.cells if block.dimension == 2]))
    chosen, spacing = ~np.isin(tetrahedra, skin).all(axis=1), 0.0
    if level:
        chosen &= (tetrahedra >= level * (ROWS + 1)).any(axis=1)
        rows = [
            np.linalg.norm(np.diff(each[: level * (ROWS // 2 + 1)].reshape(-1, level, 3), axis=0), axis=-1)
            for each in (mesh.points, points)
        ]
        spacing = float(np.abs(rows[1] / rows[0] - 1.0).max())
    shape = report.shape[chosen]
    return {"inverted": report.inverted, "least": float(shape.min()), "mean": float(shape.mean()), "spacing": spacing}


def best_of_two(work):
    """What it returns, and the lesser CPU seconds."""
    seconds = []
    for _ in range(2):
        begin = time.process_time()
        found = work()
        seconds.append(time.process_time() - begin)
    return found, min(seconds)


def compared(name, mesh, ids, places, level):
    """Prints one case; a row for each mover."""
    skin = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.cells if block.dimension == 2]))
    tetrahedra = next(block.nodes for block in mesh.cells if block.kind == "tetra")
    known, wanted = np.isin(np.arange(len(mesh.points)), skin), mesh.points.copy()
    wanted[ids] = places
    gmsnet.deform(mesh, places=places, nodes=ids)  # compiles
    result, seconds = best_of_two(lambda: gmsnet.deform(mesh, places=places, nodes=ids))
    print(f"\n{name}: {len(mesh.points):,} nodes; {result.verdict}, {result.sweeps} sweeps")
    print(f"  {'':22}{'inverted':>9}{'least':>9}{'mean':>8}{'spacing':>10}{'CPU s':>8}")
    found = {"as it was": (mesh.points, 0.0), "gmsnet": (result.points, seconds)}
    for mover, move in MOVERS.items():
        found[mover] = best_of_two(lambda move=move: move(mesh.points, [tetrahedra], known, wanted))
    rows = []
    for mover, (points, seconds) in found.items():
        row = figures(mesh, points, level)
        rows.append({"case": name, "mover": mover, **row, "seconds": seconds})
        told = f"{row['inverted']:9,}{row['least']:9.4f}{row['mean']:8.3f}{row['spacing']:10.2%}"
        print(f"  {mover:22}{told}{seconds:8.2f}", flush=True)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", default=[])
    parser.add_argument("--size", type=int, default=14)
    parser.add_argument("--json")
    given = parser.parse_args()
    print(describe())
    rows = []
    for name, *case in cases(given.size):
        if not given.cases or any(text in name for text in given.cases):
            rows += compared(name, *case)
    if given.json:
        with open(given.json, "w") as file:
            json.dump(rows, file, indent=1)


if __name__ == "__main__":
    main()
