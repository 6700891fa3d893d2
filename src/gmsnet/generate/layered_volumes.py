"""Prisms in layers that grow from a wall, over a triangulated square, or the thirds of them; tetrahedra above."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.arguments import one_of, positive, whole_number
from gmsnet.generate.marked_volume import SIDES, marked_volume, on_sides
from gmsnet.generate.random import generator
from gmsnet.generate.volumes import determinants
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BUMP = 0.1  # how high the bottom rises in its middle
JITTER = 0.2  # of a square's side: by how much nodes are off their even places, inside and above the layers


def layered_volume(
    cells: int, rows: int = 8, *, kind: str = "tetra", first: float = 0.02, growth: float = 1.4, size: float = 1.0,
    seed: int = 0,
) -> Mesh:  # fmt: skip
    """A cube whose bottom bulges, with rows of prisms on it, each cut into three tetrahedra, and even cells above.

    kind: "tetra", or "wedge", which leaves the prisms of the layers whole.

    cells: squares on each side of the bottom, of two triangles each, their nodes jittered. rows: of the layers. first:
    the height of the first row over the side of a square; growth: of each row over the one before, up to the side of a
    square; the rest of the height is divided evenly. size, seed, region, markers and errors: as in ``random_volume``.
    """
    cells, rows = whole_number(cells, "the number of cells", 2), whole_number(rows, "the number of rows", 1)
    one_of(kind, "kind", ("tetra", "wedge"))
    size, first = positive(size, "the size"), positive(first, "the first height")
    if not growth >= 1.0:
        raise InputError(f"the growth is that of one row over the one before and must be 1 or more, got {growth!r}")
    rng, side = generator(seed), 1.0 / cells
    low = np.cumsum(np.minimum(first * side * growth ** np.arange(rows), side))
    if low[-1] >= 1.0 - side:
        raise InputError(f"{rows} rows are {low[-1]:.3g} of the cube high: take fewer, thinner or slower growing ones")
    above = round((1.0 - low[-1]) / side)
    levels = np.concatenate([[0.0], low, np.linspace(low[-1], 1.0, above + 1)[1:]])
    flat, triangles = _square(cells, JITTER * side, rng)
    points = np.array([(x, y, z) for z in levels for x, y in flat])
    inside = ((points > 0.0) & (points < 1.0)).all(axis=1) & (points[:, 2] > low[-1])
    points[inside] += JITTER * side * rng.uniform(-1.0, 1.0, (int(inside.sum()), 3))
    tetrahedra = _thirds(triangles, len(flat), len(levels) - 1)
    if kind == "wedge":
        tetrahedra = tetrahedra[3 * rows * len(triangles) :]
    swapped = determinants(points, tetrahedra) < 0.0
    tetrahedra[swapped] = tetrahedra[swapped][:, [0, 2, 1, 3]]
    prisms = {"wedge": _prisms(triangles, len(flat), rows)} if kind == "wedge" else {}
    made = marked_volume(points, {**prisms, "tetra": tetrahedra}, on_sides, SIDES, 1.0)
    x, y, z = made.points.T
    bulge = BUMP * np.sin(np.pi * x) * np.sin(np.pi * y) * (1.0 - z)
    return made.with_points(np.column_stack([x, y, z + bulge]) * size)


def _square(cells: int, jitter: float, rng: np.random.Generator) -> tuple[Floats, Ints]:
    """The nodes (M, 2) of a square of so many cells a side, those inside jittered, and its triangles."""
    at = np.linspace(0.0, 1.0, cells + 1)
    flat = np.stack(np.meshgrid(at, at, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = ((flat > 0.0) & (flat < 1.0)).all(axis=1)
    flat[inside] += jitter * rng.uniform(-1.0, 1.0, (int(inside.sum()), 2))
    i, j = np.divmod(np.arange(cells * cells), cells)
    a = i * (cells + 1) + j
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    return flat, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def _prisms(triangles: Ints, width: int, levels: int) -> Ints:
    """Those over triangles on so many levels."""
    low = (triangles[None] + width * np.arange(levels)[:, None, None]).reshape(-1, 3)
    return np.concatenate([low, low + width], axis=1)


def _thirds(triangles: Ints, width: int, levels: int) -> Ints:
    """The tetrahedra of prisms over triangles on so many levels; a quadrilateral side is cut from its lowest node."""
    p, q, r = np.sort(triangles, axis=1).T
    upper = width
    three = np.stack(
        [
            np.column_stack([p, q, r, r + upper]), np.column_stack([p, q, q + upper, r + upper]),
            np.column_stack([p, p + upper, q + upper, r + upper]),
        ]
    ).reshape(-1, 4)  # fmt: skip
    cells: Ints = (three[None] + width * np.arange(levels)[:, None, None]).reshape(-1, 4)
    return cells
