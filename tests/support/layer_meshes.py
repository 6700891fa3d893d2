"""Meshes with cells that are stretched on purpose, for tests."""

from __future__ import annotations

import itertools

import numpy as np

from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.topology import Topology


def heights(aspect, width, growth=1.3):
    """Heights of rows that grow from width/aspect to the width, up to 1."""
    y, step = [0.0], width / aspect
    while y[-1] < 1.0:
        y.append(y[-1] + step)
        step = min(step * growth, width)
    return np.array(y)


def grid(x, y, alternate=False, region=None):
    """Rectangles between x and y, each halved (alternate: by a random diagonal); nodes in rows of equal y."""
    rows, columns = len(y), len(x)
    node = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    other = np.random.default_rng(0).random(a.shape) < 0.5 if alternate else np.zeros(a.shape, dtype=bool)
    halves = [((a, b, c), ~other), ((a, c, d), ~other), ((a, b, d), other), ((b, c, d), other)]
    triangles = np.concatenate([np.stack(corners, axis=-1)[chosen] for corners, chosen in halves])
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    regions = np.zeros(len(triangles), dtype=int) if region is None else region(points[triangles].mean(axis=1))
    return Mesh(points, (CellBlock("triangle", triangles, regions),))


def made(points, quads, cells):
    """A mesh of quads, or of their halves."""
    rows = quads if cells == "quad" else np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(points, (CellBlock(cells, rows, np.zeros(len(rows), dtype=int)),))


def rows_around(around, rows, first, growth, flat=1.0, cells="quad"):
    """An O-grid around an ellipse: rows of one height each, from the first one on, to the other boundary."""
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    height = np.append(0.0, np.cumsum(first * growth ** np.arange(rows)))[:, None]
    points = np.stack([(1.0 + height) * np.cos(angle), (flat + height) * np.sin(angle)], axis=-1).reshape(-1, 2)
    return made(points, _cells_between(np.arange(len(points)).reshape(-1, around)), cells)


def _cells_between(node):
    """(C, 4) the quads between closed rows of nodes."""
    a, b, d, c = node[:-1], np.roll(node[:-1], -1, axis=1), node[1:], np.roll(node[1:], -1, axis=1)
    return np.stack((a, d, c, b), axis=-1).reshape(-1, 4)


def blunt(cells="triangle", rows=32, half=40):
    """An O-grid around an ellipse, and its nodes row by row, from the nose (the first) around.

    At the nose they are so close together that from row 13 on cells are as thick as long, and thicker from row 20 on.
    """
    step = np.minimum(0.01 * 1.6 ** np.maximum(np.arange(half) - 8, 0), 0.12)
    way = np.pi * np.cumsum(step) / step.sum()
    angle = np.pi + np.concatenate([[0.0], way, 2.0 * np.pi - way[-2::-1]])
    normal = np.column_stack([0.1 * np.cos(angle), np.sin(angle)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    height = np.append(0.0, np.cumsum(1e-4 * 1.25 ** np.arange(rows)))
    points = np.column_stack([np.cos(angle), 0.1 * np.sin(angle)]) + height[:, None, None] * normal
    node = np.arange(points.size // 2).reshape(len(height), -1)
    return made(points.reshape(-1, 2), _cells_between(node), cells), node


def shaken(mesh, x, y, amount, seed=0):
    """The free nodes of a grid thrown along both axes by up to ``amount`` of the smaller spacing beside them."""

    def spacing(values):
        steps = np.diff(values)
        return np.minimum(np.append(steps[0], steps), np.append(steps, steps[-1]))

    local = np.stack(np.meshgrid(spacing(x), spacing(y)), axis=-1).reshape(-1, 2)
    thrown = amount * local * np.random.default_rng(seed).uniform(-1.0, 1.0, local.shape)
    free = np.zeros(len(local), dtype=bool)
    free[Topology.of(mesh).free] = True
    return mesh.with_points(np.where(free[:, None], mesh.points + thrown, mesh.points))


def with_fans(cells, rows=14, side=12, fan=5, first=2e-3, growth=1.3):
    """Rows around a square, with fans of cells around its corners, and its nodes row by row; then rows that grow on.

    On the wall the nodes of a fan are one: its first cells are triangles.
    """
    along = np.linspace(-1.0, 1.0, side + 1)[1:-1]
    turns = np.linspace(-0.25, 0.25, fan + 1) * np.pi
    foot, way = [], []
    for k in range(4):
        quarter = np.array([[np.cos(0.5 * np.pi * k), -np.sin(0.5 * np.pi * k)],
                            [np.sin(0.5 * np.pi * k), np.cos(0.5 * np.pi * k)]])  # fmt: skip
        own_foot = np.concatenate([np.column_stack([np.ones_like(along), along]), np.ones((fan + 1, 2))])
        corner = np.column_stack([np.cos(0.25 * np.pi + turns), np.sin(0.25 * np.pi + turns)])
        foot.append(own_foot @ quarter.T)
        way.append(np.concatenate([np.tile([1.0, 0.0], (len(along), 1)), corner]) @ quarter.T)
    foot, way = np.concatenate(foot), np.concatenate(way)
    height = np.append(0.0, np.cumsum(first * growth ** np.arange(rows + 8)))
    node = np.arange(len(height) * len(foot)).reshape(len(height), -1)
    points = (foot + height[:, None, None] * way).reshape(-1, 2)
    same = np.append(False, (np.diff(foot, axis=0) == 0.0).all(axis=1))  # a node of a fan after the first
    node[0] = node[0][np.maximum.accumulate(np.where(same, 0, np.arange(len(foot))))]
    used, number = np.unique(node, return_inverse=True)
    node = number.reshape(node.shape)
    quads = _cells_between(node)
    fans = quads[:, 3] == quads[:, 0]
    triangles, quads = quads[fans][:, :3], quads[~fans]
    if cells == "quad":
        blocks = (
            CellBlock("triangle", triangles, np.zeros(len(triangles), dtype=int)),
            made(points, quads, "quad").cells[0],
        )
    else:
        halves = np.concatenate([triangles, made(points, quads, "triangle").cells[0].nodes])
        blocks = (CellBlock("triangle", halves, np.zeros(len(halves), dtype=int)),)
    return Mesh(points[used], blocks), node[: rows + 1]


def around_a_cube(kind, side=6, rows=14, first=0.01, growth=1.3):
    """Rows around a cube of edge 1, and its nodes row by row. Those on edges and corners are higher, by √2 and √3."""
    grid = np.array(list(itertools.product(range(side + 1), repeat=3)))
    surface = grid[((grid == 0) | (grid == side)).any(axis=1)]
    number = {tuple(node): k for k, node in enumerate(surface.tolist())}
    quads = []
    for axis, end in itertools.product(range(3), (0, side)):
        one, two = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
        for i, j in itertools.product(range(side), repeat=2):
            foot = end * np.eye(3, dtype=int)[axis] + i * one + j * two
            quad = [number[tuple((foot + way).tolist())] for way in (0 * one, one, one + two, two)]
            quads.append(quad if end else quad[::-1])
    height = np.append(0.0, np.cumsum(first * growth ** np.arange(rows)))
    away = (surface == side) * 1.0 - (surface == 0)
    points = np.concatenate([surface / side - 0.5 + h * away for h in height])
    node = np.arange(len(points)).reshape(len(height), -1)
    quads = np.array(quads)
    if kind == "hexahedron":
        cells = [np.hstack([node[k][quads], node[k + 1][quads]]) for k in range(rows)]
        return Mesh(points, (CellBlock(kind, np.concatenate(cells), np.zeros(rows * len(quads), dtype=int)),)), node
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    wedges = np.concatenate([np.hstack([node[k][triangles], node[k + 1][triangles]]) for k in range(rows)])
    if kind == "wedge":
        return Mesh(points, (CellBlock(kind, wedges, np.zeros(len(wedges), dtype=int)),)), node
    tetrahedra = []
    for wedge in wedges.tolist():  # its thirds, so that neighbours have one diagonal: from the lower row's larger id
        a, b, c = sorted(range(3), key=lambda k, wedge=wedge: wedge[k])
        low, high = wedge[:3], wedge[3:]
        tetrahedra += [[low[a], low[b], low[c], high[c]], [low[a], low[b], high[b], high[c]],
                       [low[a], high[a], high[b], high[c]]]  # fmt: skip
    return Mesh(points, (CellBlock("tetra", np.array(tetrahedra), np.zeros(len(tetrahedra), dtype=int)),)), node
