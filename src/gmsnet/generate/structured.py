"""Quads in rows and columns: even ones, and Kershaw's zigzag."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.generate.arguments import number_between, positive, whole_number
from gmsnet.generate.marked import marked
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SIDES = ("bottom", "right", "top", "left")


def structured_mesh(columns: int, rows: int | None = None, *, size: float = 1.0) -> Mesh:
    """Even quads in a square, so many columns and rows of them (rows: as many as columns).

    size: side of the square. Nodes are numbered row by row from the bottom, cells too, counter-clockwise. The region
    is "domain"; the markers are "bottom", "right", "top" and "left". ``disturb`` throws the nodes out of place.

    Raises InputError for numbers out of range.
    """
    columns, rows = _checked(columns, rows)
    x, y = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    return _square(x, y, positive(size, "the size"))


def kershaw_mesh(columns: int, rows: int | None = None, *, flatness: float = 0.3, size: float = 1.0) -> Mesh:
    """Quads in a square whose rows zigzag: the height that halves the rows falls and rises between two levels.

    flatness: of the rows where they are crowded, their height over the mean one, 0.001 to 1 (1: no zigzag). The level
    stays over the first and the last sixth of the width, and goes up, down and up at 1/3, 2/3 and 5/6 of it. All quads
    are convex. Nodes, cells, markers and errors are as in ``structured_mesh``.

    Source: D. S. Kershaw, "Differencing of the diffusion equation in Lagrangian hydrodynamic codes", Journal of
    Computational Physics 39, 1981.
    """
    columns, rows = _checked(columns, rows)
    low = number_between(flatness, "the flatness", 1e-3, 1.0) / 2.0
    x, share = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    bends, levels = np.array([0.0, 1.0, 2.0, 4.0, 5.0, 6.0]) / 6.0, np.array([0, 0, 1, 0, 1, 1])
    middle = np.interp(x, bends, low + levels * (1.0 - 2.0 * low))
    lower, upper = 2.0 * share * middle, 1.0 - 2.0 * (1.0 - share) * (1.0 - middle)
    return _square(x, np.where(share <= 0.5, lower, upper), positive(size, "the size"))


def grid_quads(node: Ints) -> Ints:
    """((n − 1)(m − 1) × 4) the quads between the nodes of a grid (n × m), counter-clockwise if y grows with the row."""
    corners = (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1])
    return np.stack(corners, axis=-1).reshape(-1, 4)


def grid_outline(node: Ints) -> tuple[Ints, Ints]:
    """(B × 2) the edges around a grid of nodes (n × m), counter-clockwise, and (B,) the number of their side."""
    sides = (node[0], node[:, -1], node[-1, ::-1], node[::-1, 0])
    edges = [np.column_stack([side[:-1], side[1:]]) for side in sides]
    return np.concatenate(edges), np.repeat(np.arange(4), [len(each) for each in edges])


def _checked(columns: int, rows: int | None) -> tuple[int, int]:
    columns = whole_number(columns, "the number of columns", 1)
    return columns, columns if rows is None else whole_number(rows, "the number of rows", 1)


def _square(x: Floats, y: Floats, size: float) -> Mesh:
    node = np.arange(x.size).reshape(x.shape)
    segments, side = grid_outline(node)
    points = np.column_stack([x.ravel(), y.ravel()])
    return marked(points, {"quad": grid_quads(node)}, segments, side, SIDES, scale=size)
