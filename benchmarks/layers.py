"""What smoothing with the defaults does near walls, and to disturbed cells away from them.

    GMSNET_MESHES=FOLDER python benchmarks/layers.py [--preserve shape] [--method auto] [--meshes NAME …] [--json FILE]

On the airfoil of ``mesh_NACA0012_inv.su2`` and on a generated one with 20 layers of aspects up to 1,000, halved to
triangles; on the same layers as quads, with triangles outside and with quads up to the far field; on the two real
airfoils with layers of quads. Each as it is and with the nodes further than 2 % of the chord from the wall, and outside
of the layers, thrown by up to half an edge, or half of the shortest where there are quads.

Told are, relative to the undisturbed mesh, the largest change of an area within 2 % of the chord, and of a spacing
normal to the wall: between all rows of the layers, 20 at most; of the first mesh, the heights of the cells on the wall.
Of layers of quads also the largest change of an area in the first two rows. It, or that near the wall, must be at most
10 %, and that of a spacing 2 %. And, as for two other real meshes, the six columns of the measures before and after.
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
from gmsnet.generate.layered import CELLS
from gmsnet.topology.topology import Topology

NEAR, THROW = 0.02, 0.5
LAYERS, AROUND = 20, 120
ROWS = 20  # of quads, at most, that are followed from a wall
MOST_SPACING, MOST_AREA = 0.02, 0.1
WALLS = {  # name → cells of ``layered_mesh``, or a file
    "NACA 0012": "mesh_NACA0012_inv.su2",
    "20 layers": "triangle",
    "20 layers of quads": "mixed",
    "20 layers, quads alone": "quad",
    "NACA 0012, hybrid": "mesh_NACA0012_lam_hybrid_v1.su2",
    "NACA 0012, quads": "n0012_113-33.su2",
}
OTHERS = ("osteonT1_11.mesh", "japan_sea.msh")
COLUMNS = ("min angle mean", "min", "max angle mean", "max", "1/q mean", "min")


def faces(mesh, report):
    """(F, 4) the corners of the cells in the order of a report; the last one of a triangle twice."""
    rows = [row for block in mesh.cells for row in (
        np.column_stack([block.nodes, block.nodes[:, -1]]) if block.kind == "triangle"
        else block.nodes if block.kind == "quad" else np.full((len(block.nodes), 4), -1)
    )]  # fmt: skip
    return np.array(rows)[report.cell]


def middles(mesh, report):
    """(F, 2) the means of the corners of the cells in the order of a report."""
    means = [mesh.points[block.nodes, :2].mean(axis=1) for block in mesh.cells]
    return np.concatenate(means)[report.cell]


def doubles(points, corners):
    """Twice the areas."""
    a, b, c, d = (points[corners[:, k], :2] for k in range(4))
    return np.abs((c - a)[:, 0] * (d - b)[:, 1] - (c - a)[:, 1] * (d - b)[:, 0])


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


def strips(mesh):
    """Of each wall edge the quads on it, one after the other: rows of quads (k, 4), a wall edge or the like first."""
    quads = [block.nodes for block in mesh.cells if block.kind == "quad"]
    of_edge = {}
    for quad in np.concatenate(quads).tolist() if quads else []:
        for k in range(4):
            of_edge.setdefault(frozenset((quad[k], quad[k - 3])), []).append(quad[k:] + quad[:k])
    rows, edges, seen = [], wall_edges(mesh).tolist(), set()
    while edges and len(rows) < ROWS:
        row = [quad for edge in edges for quad in of_edge.get(frozenset(edge), ()) if frozenset(quad) not in seen]
        seen |= {frozenset(quad) for quad in row}
        edges = [(c, d) for _, _, c, d in row]
        rows += [np.array(row)] if row else []
    return rows


def spacings(points, mesh, corners, layered):
    """Normal to the wall: between the rows of layers, or the heights of the cells on the wall."""
    if layered:
        rows = points[: (LAYERS + 1) * AROUND].reshape(LAYERS + 1, AROUND, 2)
        return np.linalg.norm(np.diff(rows, axis=0), axis=-1).ravel()
    if rows := strips(mesh):
        rungs = np.concatenate([row[:, [[0, 3], [1, 2]]].reshape(-1, 2) for row in rows])
        return np.linalg.norm(np.diff(points[rungs][:, :, :2], axis=1)[:, 0], axis=1)
    edges, of_edge = wall_edges(mesh), {}
    for row, (i, j, k, _) in enumerate(corners.tolist()):
        of_edge |= {frozenset((i, j)): row, frozenset((j, k)): row, frozenset((k, i)): row}
    length = np.linalg.norm(np.diff(points[edges][:, :, :2], axis=1)[:, 0], axis=1)
    return doubles(points, corners[[of_edge[frozenset(edge)] for edge in edges.tolist()]]) / length


def thrown_outside(mesh, layered):
    """The free nodes of which all cells are away from wall and layers thrown about, valid."""
    topology, report, rows = Topology.of(mesh), gmsnet.quality(mesh), strips(mesh)
    corners, near = faces(mesh, report), distance(middles(mesh, report), mesh) <= NEAR
    touched = np.zeros(len(mesh.points), dtype=bool)
    touched[: (LAYERS + 1) * AROUND if layered else 0] = True
    touched[corners[near]] = True
    for row in rows:
        touched[row] = True
    edge = "shortest" if rows else "mean"
    return disturb(mesh, topology.free[~touched[topology.free]], THROW, seed=1, edge=edge)


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
        corners, rows = faces(reference, result.before), strips(reference)
        near = distance(middles(reference, result.before), reference) <= NEAR
        change = np.abs(doubles(result.points, corners) / doubles(reference.points, corners) - 1.0)
        space = spacings(result.points, reference, corners, layered)
        space = np.abs(space / spacings(reference.points, reference, corners, layered) - 1.0)
        of_layers = np.isin(corners, np.concatenate([row.ravel() for row in rows])).all(axis=1) if rows else near
        if layered:
            of_layers = (corners < (LAYERS + 1) * AROUND).all(axis=1)
        outside = np.flatnonzero(~near & ~of_layers)
        for label, report in (("outside, before", result.before), ("outside, after", result.after)):
            figures[label] = columns(report, outside)
            show(label, figures[label])
        figures |= {
            "cells near": int(near.sum()), "largest change of area near": float(change[near].max()),
            "cells near beyond 10 %": int((change[near] > 0.1 + 1e-9).sum()),
            "largest change of spacing": float(space.max()),
        }  # fmt: skip
        told, largest = "", change[near].max()
        if rows:
            first = np.concatenate(rows[:2])
            areas = np.abs(doubles(result.points, first) / doubles(reference.points, first) - 1.0)
            figures |= {"rows": len(rows), "largest change of area in two rows": float(areas.max())}
            told, largest = f" in {len(rows)} rows; areas in the first two by at most {areas.max():.1%}", areas.max()
        told += ": pass" if space.max() <= MOST_SPACING and largest <= MOST_AREA else ": FAIL"
        print(
            f"  within {NEAR:.0%} of the chord: {near.sum():,} cells, areas change by at most "
            f"{change[near].max():.1%} ({figures['cells near beyond 10 %']} cells beyond 10 %); "
            f"spacings normal to the wall by at most {figures['largest change of spacing']:.1%}{told}"
        )
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--preserve", default="shape")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--json")
    parser.add_argument("--meshes", nargs="+", choices=[*WALLS, *OTHERS], default=[*WALLS, *OTHERS])
    parser.add_argument("--slide", action="store_true")
    options = parser.parse_args()
    chosen = {"method": options.method, "preserve": options.preserve, "slide": options.slide or None}
    folder = Path(os.environ["GMSNET_MESHES"])
    print(describe())
    results = {}
    for name in options.meshes:
        if name in OTHERS:
            results[name] = measure(name, gmsnet.read(folder / name), chosen)
            continue
        what, rows = WALLS[name], name == "20 layers"
        mesh = layered_mesh(LAYERS, 1000.0, AROUND, cells=what) if what in CELLS else gmsnet.read(folder / what)
        results[name] = measure(name, mesh, chosen, mesh, rows)
        name += ", disturbed outside"
        results[name] = measure(name, thrown_outside(mesh, rows), chosen, mesh, rows)
    if options.json:
        Path(options.json).write_text(
            json.dumps({"machine": describe(), "options": chosen, "results": results}, indent=1)
        )


if __name__ == "__main__":
    main()
