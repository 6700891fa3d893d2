"""What smoothing with the defaults does near walls, and to disturbed cells away from them.

    GMSNET_MESHES=FOLDER python benchmarks/layers.py [--preserve shape] [--method auto] [--json FILE]

On the airfoil of ``mesh_NACA0012_inv.su2`` and on a generated one with 20 layers of aspects up to 1,000, as they are
and with the nodes further than 2 % of the chord from the wall, and outside of the layers, thrown by up to half an edge:
the largest change of an area within 2 % of the chord and of a spacing normal to the wall (between all rows of the
layers; of the other mesh, the heights of the cells on the wall), both relative to the undisturbed mesh. And, as for two
other real meshes, the six columns of the measures before and after.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

import numpy as np
from machine import describe

import gmsnet
from gmsnet.generate import disturb, layered_mesh
from gmsnet.topology.topology import Topology

NEAR, THROW = 0.02, 0.5
LAYERS, AROUND = 20, 120
COLUMNS = ("min angle mean", "min", "max angle mean", "max", "1/q mean", "min")


def doubles(points, triangles):
    a, b, c = (points[triangles[:, k], :2] for k in range(3))
    return np.abs((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))


def wall_edges(mesh):
    """(k, 2) the line cells of the marker "airfoil"."""
    lines = np.concatenate([block.nodes for block in mesh.cells if block.kind == "line"])
    return lines[np.isin(lines, mesh.markers["airfoil"]).all(axis=1)]


def distance(points, mesh):
    """(n,) of points from the airfoil."""
    start, end = (mesh.points[wall_edges(mesh)[:, k], :2] for k in range(2))
    out = np.full(len(points), np.inf)
    for a, b in zip(start, end, strict=True):
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        out = np.minimum(out, np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
    return out


def spacings(points, mesh, layered):
    """Normal to the wall: between the rows of layers, or the heights of the cells on the wall."""
    if layered:
        rows = points[: (LAYERS + 1) * AROUND].reshape(LAYERS + 1, AROUND, 2)
        return np.linalg.norm(np.diff(rows, axis=0), axis=-1).ravel()
    triangles, edges = Topology.of(mesh).triangles, wall_edges(mesh)
    of_edge = {frozenset(edge): None for edge in edges.tolist()}
    for row, (i, j, k) in enumerate(triangles.tolist()):
        for edge in (frozenset((i, j)), frozenset((j, k)), frozenset((k, i))):
            if edge in of_edge:
                of_edge[edge] = row
    length = np.linalg.norm(np.diff(mesh.points[edges][:, :, :2], axis=1)[:, 0], axis=1)
    return doubles(points, triangles[[of_edge[frozenset(edge)] for edge in edges.tolist()]]) / length


def thrown_outside(mesh, near, layered):
    """The free nodes of which all cells are away from wall and layers thrown about, valid."""
    topology = Topology.of(mesh)
    touched = np.zeros(len(mesh.points), dtype=bool)
    touched[: (LAYERS + 1) * AROUND if layered else 0] = True
    touched[topology.triangles[near]] = True
    return disturb(mesh, topology.free[~touched[topology.free]], THROW, seed=1)


def columns(report, rows=slice(None)):
    low, high, shape = report.min_angle[rows], report.max_angle[rows], report.shape[rows]
    return [low.mean(), low.min(), high.mean(), high.max(), shape.mean(), shape.min()]


def show(label, values):
    print(f"  {label:16}" + "".join(f"{value:{width}.{digits}f}" for value, width, digits in
                                    zip(values, (15, 8, 15, 8, 9, 8), (2, 2, 2, 2, 4, 4), strict=True)))  # fmt: skip


def measure(name, mesh, options, reference=None, layered=False):
    """One mesh: prints, and returns the figures. reference: the undisturbed mesh of an airfoil."""
    result = gmsnet.smooth(mesh, **options)
    print(f"\n{name}: {len(mesh.points):,} nodes, {result.sweeps} sweeps, {result.stop_reason}, {result.seconds:.2f} s")
    for note in result.notes:
        print(f"  {note}")
    print(f"  {'':16}{COLUMNS[0]:>15}{COLUMNS[1]:>8}{COLUMNS[2]:>15}{COLUMNS[3]:>8}{COLUMNS[4]:>9}{COLUMNS[5]:>8}")
    figures = {"before": columns(result.before), "after": columns(result.after)}
    show("before", figures["before"])
    show("after", figures["after"])
    if reference is not None:
        triangles = Topology.of(reference).triangles
        near = distance(reference.points[triangles, :2].mean(axis=1), reference) <= NEAR
        change = np.abs(doubles(result.points, triangles) / doubles(reference.points, triangles) - 1.0)
        space = spacings(result.points, reference, layered) / spacings(reference.points, reference, layered)
        rows = np.flatnonzero(~near)
        outside = rows[(triangles[rows] >= (LAYERS + 1) * AROUND).any(axis=1)] if layered else rows
        for label, report in (("outside, before", result.before), ("outside, after", result.after)):
            figures[label] = columns(report, outside)
            show(label, figures[label])
        figures |= {
            "cells near": int(near.sum()), "largest change of area near": float(change[near].max()),
            "cells near beyond 10 %": int((change[near] > 0.1 + 1e-9).sum()),
            "largest change of spacing": float(np.abs(space - 1.0).max()),
        }  # fmt: skip
        print(
            f"  within {NEAR:.0%} of the chord: {near.sum():,} cells, areas change by at most "
            f"{change[near].max():.1%} ({figures['cells near beyond 10 %']} cells beyond 10 %); "
            f"spacings normal to the wall by at most {figures['largest change of spacing']:.1%}"
        )
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--preserve", default="shape")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--json")
    options = parser.parse_args()
    chosen = {"method": options.method, "preserve": options.preserve}
    folder = Path(os.environ["GMSNET_MESHES"])
    print(describe())
    airfoil, layered = gmsnet.read(folder / "mesh_NACA0012_inv.su2"), layered_mesh(LAYERS, 1000.0, AROUND)
    results = {}
    for name, mesh, rows in (("NACA 0012", airfoil, False), (f"{LAYERS} layers", layered, True)):
        near = distance(mesh.points[Topology.of(mesh).triangles, :2].mean(axis=1), mesh) <= NEAR
        results[name] = measure(name, mesh, chosen, mesh, rows)
        name += ", disturbed outside"
        results[name] = measure(name, thrown_outside(mesh, near, rows), chosen, mesh, rows)
    for name in ("osteonT1_11.mesh", "japan_sea.msh"):
        results[name] = measure(name, gmsnet.read(folder / name), chosen)
    if options.json:
        Path(options.json).write_text(
            json.dumps({"machine": describe(), "options": chosen, "results": results}, indent=1)
        )


if __name__ == "__main__":
    main()
