"""What the default does near refined walls, beside other choices of ``preserve``, and what bands of 10 % allow.

    GMSNET_MESHES=FOLDER python benchmarks/walls.py [--thrown 0 0.05 …] [--ceiling ROUNDS]

On the NACA 0012 and two plates refined towards a hole, of triangles and recombined to quads, as they are and with all
nodes thrown by so many edges: q̂ (of quads the mean 1/q) and the minimum 1/q after each call, and how much areas of
protected cells change, at most and in 95 % of them, and the heights of those on the wall.

``--ceiling``: how good the worst cell near the airfoil can be if each protected area stays within 10 %, by linear
programs with a trust region one after the other, from the mesh as it is. A lower bound of what is possible.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
import scipy.sparse
from machine import describe
from scipy.optimize import linprog

import gmsnet
from gmsnet.generate import Curve, disturb, good_mesh, recombine
from gmsnet.preserve.walls import near_walls
from gmsnet.topology.topology import Topology

THROWN = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
CHOICES = ("shape", "size", "none")
RINGS, BAND = 3, 0.1
LOW = 0.25  # of 1/q: cells this much better than the worst are not looked at in a round
PENALTY = 5.0  # of an area's way out of its band, beside 1/q
FIRST, LONGEST, SHORTEST = 0.1, 0.3, 1e-4  # of the mean length of a node's edges: trust region


def plate(radius, finest, growth, side):
    """A square with a round hole, refined towards it."""
    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    hole = Curve(radius * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    square = Curve(side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]), "square")
    return good_mesh([[square], [hole]], lambda x: finest + growth * np.abs(np.linalg.norm(x, axis=1) - radius))


def doubles(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def cells_of(topology):
    """The corners of the cells of each kind."""
    return [cells for cells in (topology.triangles, topology.quads) if len(cells)]


def areas(points, cells):
    """Of cells of one kind (C, 3 or 4)."""
    x, y = points[cells].transpose(2, 0, 1)
    return 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))


def on_walls(mesh, topology, kept):
    """The heights over the boundary, by points: of the other nodes of kept cells that have an edge of it.

    Of a quad, of the two that are next to the edge.
    """
    ends, above = [], []
    for cells in cells_of(topology):
        count = cells.shape[1]
        for k in range(count):
            edge = cells[:, [k, (k + 1) % count]]
            for other in {(k + 2) % count, (k - 1) % count}:
                ends.append(np.where(kept[cells].all(axis=1)[:, None], edge, -1))
                above.append(cells[:, other])
    ends, above = np.sort(np.concatenate(ends), axis=1), np.concatenate(above)
    wall = np.zeros(len(kept), dtype=bool)
    wall[topology.held["boundary"]] = True
    pairs = [np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2) for cells in cells_of(topology)]
    found, count = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0, return_counts=True)
    outer = {tuple(edge) for edge in found[count == 1].tolist()}
    chosen = np.array([tuple(edge) in outer for edge in ends.tolist()]) & ~wall[above]
    ends, above = ends[chosen], above[chosen]

    def heights(points):
        along, away = points[ends[:, 1]] - points[ends[:, 0]], points[above] - points[ends[:, 0]]
        return np.abs(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]) / np.linalg.norm(along, axis=1)

    return heights


def all_areas(points, kinds):
    return np.concatenate([areas(points, cells) for cells in kinds])


def upper(values):
    return np.quantile(values, 0.95)


def compare(name, mesh):
    """Prints a row."""
    topology, text = Topology.of(mesh), ""
    kept = near_walls(mesh, topology).kept.nodes
    banded = [cells[kept[cells].all(axis=1)] for cells in cells_of(topology)]
    before, heights = all_areas(mesh.points[:, :2], banded), on_walls(mesh, topology, kept)
    for choice in CHOICES:
        result = gmsnet.smooth(mesh, threads=1, preserve=choice)
        change = np.abs(all_areas(result.points[:, :2], banded) / before - 1.0)
        high = np.abs(heights(result.points[:, :2]) / heights(mesh.points[:, :2]) - 1.0)
        figures = [f"{part(values):8.1%}" for values in (change, high) if len(values) for part in (np.max, upper)]
        best = result.after.qhat if len(topology.quads) == 0 else result.after.shape.mean()
        text += f"{best:8.4f}{result.after.shape.min():7.3f}{''.join(figures):32} |"
    print(f"{name:24}{len(before):6}|{text}", flush=True)


class Program:
    """The linear programs of ``ceiling``."""

    def __init__(self, mesh):
        topology = Topology.of(mesh)
        self.points, triangles = mesh.points[:, :2].copy(), topology.triangles.copy()
        turned = topology.orientation < 0
        triangles[turned] = triangles[turned][:, [0, 2, 1]]
        kept = near_walls(mesh, topology).kept.nodes
        zone = kept.copy()
        for _ in range(RINGS):
            zone[triangles[zone[triangles].any(axis=1)]] = True
        self.nodes = topology.free[zone[topology.free]]
        self.number = np.full(len(kept), -1)
        self.number[self.nodes] = np.arange(len(self.nodes))
        self.cells = triangles[(self.number[triangles] >= 0).any(axis=1)]
        self.banded = np.flatnonzero(kept[self.cells].all(axis=1))
        self.start = doubles(self.points, self.cells)
        ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        length = np.linalg.norm(self.points[ends[:, 0]] - self.points[ends[:, 1]], axis=1)
        weight = np.bincount(ends.ravel(), np.repeat(length, 2), len(kept))
        self.size = (weight / np.bincount(ends.ravel(), minlength=len(kept)))[self.nodes]

    def derivatives(self, points):
        """D and 1/q of each cell, and their gradients (C, 3, 2) by its corners."""
        i, j, k = self.cells.T
        a, b = points[j] - points[i], points[k] - points[i]
        d, square = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * a + b * b - a * b).sum(axis=1) / np.sqrt(3.0)
        of_d = np.stack([np.column_stack([b[:, 1], -b[:, 0]]), np.column_stack([-a[:, 1], a[:, 0]])], axis=1)
        of_square = np.stack([2.0 * a - b, 2.0 * b - a], axis=1) / np.sqrt(3.0)
        of_d, of_square = (np.concatenate([-g.sum(axis=1, keepdims=True), g], axis=1) for g in (of_d, of_square))
        shape = d / square
        return d, shape, of_d, (of_d - shape[:, None, None] * of_square) / square[:, None, None]

    def matrix(self, gradient, rows, factor):
        """Of some cells, by the shifts of nodes over their sizes."""
        node = self.number[self.cells[rows]]
        row, corner = np.nonzero(node >= 0)
        value = gradient[rows][row, corner] * (factor[row] * self.size[node[row, corner]])[:, None]
        column = 2 * node[row, corner][:, None] + np.arange(2)
        shape = len(rows), 2 * len(self.nodes)
        return scipy.sparse.csr_matrix((value.ravel(), (np.repeat(row, 2), column.ravel())), shape=shape)

    def merit(self, points):
        """What is maximised, the minimum 1/q, and the largest change of an area."""
        d, shape, _, _ = self.derivatives(points)
        change = np.abs(d / self.start - 1.0)[self.banded]
        return shape.min() - PENALTY * np.maximum(change - BAND, 0.0).sum(), shape.min(), change.max()

    def step(self, points, trust):
        """Where the linear program leads from the points."""
        d, shape, of_d, of_shape = self.derivatives(points)
        low, count, all_nodes = np.flatnonzero(shape < shape.min() + LOW), len(self.banded), 2 * len(self.nodes)
        gains = self.matrix(of_shape, low, np.ones(len(low)))
        changes = self.matrix(of_d, self.banded, 1.0 / self.start[self.banded])
        now, one = d[self.banded] / self.start[self.banded], scipy.sparse.identity(count)
        none, column = scipy.sparse.csr_matrix((count, 1)), scipy.sparse.csr_matrix(np.ones((len(low), 1)))
        limits = scipy.sparse.vstack([
            scipy.sparse.hstack([-gains, column, scipy.sparse.csr_matrix((len(low), count))]),
            scipy.sparse.hstack([changes, none, -one]), scipy.sparse.hstack([-changes, none, -one]),
        ])  # fmt: skip
        found = linprog(
            np.concatenate([np.zeros(all_nodes), [-1.0], np.full(count, PENALTY)]), A_ub=limits.tocsr(),
            b_ub=np.concatenate([shape[low], 1.0 + BAND - now, now - 1.0 + BAND]),
            bounds=[(-trust, trust)] * all_nodes + [(None, None)] + [(0.0, None)] * count, method="highs-ipm",
        )  # fmt: skip
        there = points.copy()
        there[self.nodes] += self.size[:, None] * found.x[:all_nodes].reshape(-1, 2)
        return there


def ceiling(mesh, rounds):
    """Prints how far the worst cell near walls comes."""
    program, trust = Program(mesh), FIRST
    points = program.points
    best = program.merit(points)
    for _ in range(rounds):
        there = program.step(points, trust)
        merit = program.merit(there)
        if merit[0] > best[0]:
            points, best, trust = there, merit, min(LONGEST, 1.5 * trust)
        else:
            trust *= 0.4
        if trust < SHORTEST:
            break
    print(f"near walls: a minimum 1/q of {best[1]:.4f}, areas within {best[2]:.2%}, {len(program.nodes):,} nodes")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--thrown", nargs="+", type=float, default=list(THROWN))
    parser.add_argument("--ceiling", type=int, default=0, metavar="ROUNDS")
    options = parser.parse_args()
    print(describe())
    naca = gmsnet.read(Path(os.environ["GMSNET_MESHES"]) / "mesh_NACA0012_inv.su2")
    meshes = {"NACA 0012": naca, "plate": plate(0.5, 0.01, 0.25, 4.0), "finer hole": plate(0.15, 0.003, 0.2, 0.5)}
    meshes |= {f"{name}, quads": recombine(mesh) for name, mesh in meshes.items()}
    columns = f"{'least':>7}{'areas':>8}{'95 %':>8}{'heights':>8}{'95 %':>8} |"
    print(f"{'':24}{'cells':>6}|{''.join(f'{choice:>8}{columns}' for choice in CHOICES)}")
    for name, mesh in meshes.items():
        for amount in options.thrown:
            thrown = disturb(mesh, Topology.of(mesh).free, amount, seed=0) if amount else mesh
            compare(f"{name}, {amount:g}", thrown)
    if options.ceiling:
        ceiling(naca, options.ceiling)


if __name__ == "__main__":
    main()
