"""Second-order meshes for tests, as the tables that kernels take."""

from __future__ import annotations

import numpy as np

from gmsnet.generate import random_mesh
from gmsnet.generate.curved import disc_of_quads, on_circle, second_order, throw, waved
from gmsnet.kernels.curved.stars import curved_mesh
from gmsnet.kernels.simplex.bernstein import NAMES, WIDEST
from gmsnet.measure.curved import judge_curved
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh


def cell_table(mesh):
    """(cells (C, 9), kinds (C,), held (N,)): held are the nodes of line cells."""
    cells, kinds, held = [], [], np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.cells:
        if block.kind in NAMES:
            rows = np.full((len(block.nodes), WIDEST), -1, dtype=np.int32)
            rows[:, : block.nodes.shape[1]] = block.nodes
            cells.append(rows)
            kinds.append(np.full(len(rows), NAMES.index(block.kind), dtype=np.int8))
        else:
            held[block.nodes] = True
    return np.concatenate(cells), np.concatenate(kinds), held


def tables(mesh):
    """(points, CurvedMesh, free): what kernels take; points are a copy."""
    cells, kinds, held = cell_table(mesh)
    points = np.array(mesh.points)
    return points, curved_mesh(points, cells, kinds, held), ~held


def judged(mesh):
    """Signs and qualities of the second-order cells."""
    cells, kinds, _ = cell_table(mesh)
    return judge_curved(np.array(mesh.points), cells, kinds)


def quad_grid(side, power=1.0):
    """A unit square of side² quads; a power above 1 makes rows thin at the bottom."""
    across = np.linspace(0, 1, side + 1)
    points = np.stack(np.meshgrid(across, across**power), axis=-1).reshape(-1, 2)
    grid = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1).reshape(-1, 4)
    rim = np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])
    lines = np.stack([rim, np.roll(rim, -1)], axis=-1)
    blocks = (
        CellBlock("quad", quads, np.zeros(len(quads), dtype=int)),
        CellBlock("line", lines, np.ones(len(lines), dtype=int)),
    )
    return Mesh(points, blocks)


def known_valid(seed):
    """One of many valid curved meshes: waves through a square, or a disc, of triangles or quads."""
    rng = np.random.default_rng(seed)
    quads = ("quad8", "quad9")[seed % 2]
    while True:
        shape = seed % 5
        if shape == 0:
            mesh = second_order(disc_of_quads(int(rng.integers(1, 4)), 8), quads=quads, project=on_circle(1.0))
        elif shape == 1:
            base = random_mesh(30, "circle", seed=int(rng.integers(1000)))
            rim = base.points[np.unique(next(b.nodes for b in base.cells if b.kind == "line"))]
            centre = (rim.max(axis=0) + rim.min(axis=0)) / 2
            project = on_circle(float(np.linalg.norm(rim - centre, axis=1).mean()), tuple(centre))
            mesh = second_order(base, project=project)
        else:
            base = random_mesh(30, seed=int(rng.integers(1000))) if shape == 2 else quad_grid(4, float(shape - 2))
            mesh = waved(second_order(base, quads=quads, bend=0.03, seed=seed), float(rng.uniform(0, 0.1)))
        if (judged(mesh)[0] == 1).all():
            return mesh


def thrown(seed):
    """A curved mesh that is invalid, with inner nodes thrown from a valid one."""
    throws = np.random.default_rng(seed)
    good = known_valid(seed)
    while True:
        corners = float(throws.choice([0.0, 0.3, 0.6]))
        mesh = throw(good, middles=0.4, corners=corners, seed=int(throws.integers(2**31)))
        if not (judged(mesh)[0] == 1).all():
            return mesh
