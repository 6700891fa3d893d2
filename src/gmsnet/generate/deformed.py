"""Meshes that were deformed as a whole, as moving boundaries, shape optimisation and flows do it: no cell is inverted.

Of grids, the square's boundary keeps its places, so that the even grid can be had again. Of the plate, the hole moves
and nodes follow the less, the further away they are. The terrain has nodes along contour lines, closer than the lines.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.generate.arguments import number_between, one_of, positive, whole_number
from gmsnet.generate.curves import Curve
from gmsnet.generate.delaunay import labelled, triangulate
from gmsnet.generate.good import good_mesh
from gmsnet.generate.marked import marked
from gmsnet.generate.random import generator
from gmsnet.generate.structured import SIDES, grid_outline, grid_quads
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CELLS = ("triangle", "quad")
HOLE = 0.15  # the radius of the plate's hole, in sides


def sheared_mesh(
    columns: int, rows: int | None = None, *, amplitude: float = 0.5, waves: float = 2.0, cells: str = "triangle"
) -> Mesh:
    """A grid in the unit square whose rows were pushed to and fro: x + a·sin(2πwy)·x(1 − x).

    amplitude: a, below 1 in size, else cells would be inverted. waves: w. cells: "triangle" (diagonals to and fro) or
    "quad". Nodes are numbered row by row from the bottom.

    Raises InputError for numbers out of range.
    """
    a, w = number_between(amplitude, "the amplitude", -0.99, 0.99), positive(waves, "the number of waves")
    x, y = _even(columns, rows)
    return _grid(x + a * np.sin(2.0 * math.pi * w * y) * x * (1.0 - x), y, cells)


def swirled_mesh(columns: int, rows: int | None = None, *, angle: float = 1.2, cells: str = "triangle") -> Mesh:
    """A grid in the unit square that was turned by an angle (radians) at its centre, by less towards the sides.

    The rest is as in ``sheared_mesh``. Raises InputError for numbers out of range.
    """
    angle = number_between(angle, "the angle", -3.0, 3.0)
    x, y = _even(columns, rows)
    x, y = x - 0.5, y - 0.5
    turned = angle * np.clip(1.0 - 2.0 * np.hypot(x, y), 0.0, 1.0)
    cosine, sine = np.cos(turned), np.sin(turned)
    return _grid(cosine * x - sine * y + 0.5, sine * x + cosine * y + 0.5, cells)


def zigzag_mesh(columns: int, rows: int | None = None, *, height: float = 0.4, cells: str = "triangle") -> Mesh:
    """A grid in the unit square whose columns went up and down in turn, by ``height`` in its middle.

    The rest is as in ``sheared_mesh``. Raises InputError for numbers out of range.

    Source: M. Shashkov, S. Steinberg, "Solving diffusion equations with rough coefficients in rough grids", Journal of
    Computational Physics 129, 1996, for the idea of such grids.
    """
    height = number_between(height, "the height", 0.0, 0.45)
    x, y = _even(columns, rows)
    turn = np.where(np.arange(x.shape[1]) % 2 == 0, height, -height)
    turn[[0, -1]] = 0.0
    return _grid(x, y + turn * np.minimum(2.0 * y, 2.0 - 2.0 * y), cells)


def moved_hole_mesh(edge: float = 0.03, *, shift: float = 1.0, squash: float = 1.0, turn: float = 0.0) -> Mesh:
    """Good triangles in the unit square with a round hole, which was then moved and squashed.

    edge: of the triangles. shift: of the hole, in radii (0.15 each), along ``turn`` (radians). squash: factor of its
    height. Nodes follow by the share (1 − s)²(1 + 2s), s their distance from the old hole over that to the sides.

    Raises InputError for numbers out of range; cells may be inverted by shifts of more than 1.
    """
    edge, shift = number_between(edge, "the edge", 1e-3, 0.1), number_between(shift, "the shift", 0.0, 2.0)
    squash = number_between(squash, "the squash", 0.05, 3.0)
    sides = [Curve(np.array(ends), name) for ends, name in zip(_sides(), SIDES, strict=True)]
    around = np.linspace(0.0, 2.0 * math.pi, 241)
    around[-1] = 0.0
    hole = Curve(0.5 + HOLE * np.column_stack([np.cos(around), np.sin(around)]), "hole")
    plate = good_mesh([sides, [hole]], edge)
    away = plate.points[:, :2] - 0.5
    distance = np.hypot(away[:, 0], away[:, 1])
    to_side = 0.5 * distance / np.maximum(np.abs(away).max(axis=1), 1e-12)
    s = np.clip((distance - HOLE) / (to_side - HOLE), 0.0, 1.0)
    follow = ((1.0 - s) ** 2 * (1.0 + 2.0 * s))[:, None]
    way = shift * HOLE * np.array([math.cos(turn), math.sin(turn)]) + away * np.array([0.0, squash - 1.0])
    return plate.with_points(plate.points + follow * way)


def terrain_mesh(lines: int = 12, *, ratio: float = 4.0, seed: int = 0) -> Mesh:
    """Delaunay triangles of the unit square with nodes along contour lines of smooth hills.

    lines: levels. ratio: the mean distance of lines over that of nodes on them. Raises InputError for numbers out of
    range.
    """
    lines, ratio = whole_number(lines, "the number of lines", 1), number_between(ratio, "the ratio", 1.0, 20.0)
    rng = generator(seed)
    middle, width = rng.random((5, 2)), rng.uniform(0.15, 0.4, 5)

    def height(at: Floats) -> Floats:
        away = ((at[:, None] - middle) ** 2).sum(axis=2)
        found: Floats = np.exp(-away / width**2).sum(axis=1)
        return found

    step = 1.0 / (2.0 * lines * ratio)
    along = np.arange(0.0, 1.0 + 0.5 * step, step)
    x, y = np.meshgrid(along, along, indexing="ij")
    z = height(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    levels = np.linspace(z.min(), z.max(), lines + 2)[1:-1]
    found = []
    for level in levels:  # where it crosses the lines of a grid
        low, high = z[:-1], z[1:]
        crossed = (low < level) != (high < level)
        share = (level - low[crossed]) / (high - low)[crossed]
        found.append(np.column_stack([x[:-1][crossed] + share * step, y[:-1][crossed]]))
    inner = np.concatenate(found)
    inner = inner[(np.minimum(inner, 1.0 - inner) > step).all(axis=1)]
    count = max(4, round(1.0 / (ratio * step)))
    share = np.linspace(0.0, 1.0, count + 1)[:-1]
    outer = np.concatenate([a + share[:, None] * (b - a) for a, b in _sides()])
    number = np.arange(len(outer))
    segments = np.column_stack([number, np.roll(number, -1)])
    return labelled(triangulate(outer, segments, np.repeat(np.arange(4), count), inner), SIDES)


def _sides() -> list[tuple[Floats, Floats]]:
    """The ends of the sides of the unit square, in the order of SIDES."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return list(zip(corners, np.roll(corners, -1, axis=0), strict=True))


def _even(columns: int, rows: int | None) -> tuple[Floats, Floats]:
    columns = whole_number(columns, "the number of columns", 2)
    rows = columns if rows is None else whole_number(rows, "the number of rows", 2)
    x, y = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    return x, y


def _grid(x: Floats, y: Floats, cells: str) -> Mesh:
    one_of(cells, "the cells", CELLS)
    node = np.arange(x.size).reshape(x.shape)
    quads = grid_quads(node)
    segments, side = grid_outline(node)
    points = np.column_stack([x.ravel(), y.ravel()])
    faces = {"quad": quads} if cells == "quad" else {"triangle": _halved(quads, x.shape[1] - 1)}
    return marked(points, faces, segments, side, SIDES)


def _halved(quads: Ints, columns: int) -> Ints:
    """Two triangles a quad, whose diagonals point one way and the other in turn."""
    row, column = np.divmod(np.arange(len(quads)), columns)
    rising = ((row + column) % 2 == 0)[:, None]
    one = np.where(rising, quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
    two = np.where(rising, quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
    return np.stack([one, two], axis=1).reshape(-1, 3)
