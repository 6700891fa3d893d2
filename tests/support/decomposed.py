"""Decomposed cases of OpenFOAM: a block of hexahedra and wedges, and one layer of cells between empty patches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from support.foam import in_text, poly_mesh
from support.foam_processors import processors

Cell = list[list[int]]


class Case(NamedTuple):
    """points: of all. cells: the faces of each, seen from outside. patches: name → type. patch_of: of a face."""

    points: list[list[float]]
    cells: list[Cell]
    patches: dict[str, str]
    patch_of: Callable[[list[int]], str]

    def whole(self, make: Callable[[Any], dict[str, bytes]] = in_text) -> dict[str, bytes]:
        """The files of the case that is not decomposed."""
        lists = poly_mesh(self.points, self.cells, self.patch_of)
        named = {name: (count, start) for name, _, count, start in lists["boundary"]}  # type: ignore[attr-defined]
        lists["boundary"] = [(name, self.patches[name], *rest) for name, rest in named.items()]
        return make(lists)

    def parts(
        self, parts: Sequence[Sequence[int]], make: Callable[[Any], dict[str, bytes]] = in_text, ids: bool = True
    ) -> dict[str, bytes]:
        """The files of so many processors, below the case."""
        return processors(self.points, self.cells, parts, self.patches, self.patch_of, make, ids)


def block(size: int = 4, seed: int = 5) -> Case:
    """A block of hexahedra whose inner points are thrown; every third is cut into two wedges. The left side is an
    inlet."""
    wide, random = size + 1, np.random.default_rng(seed)

    def at(x: int, y: int, z: int) -> int:
        return x + wide * (y + wide * z)

    points = [[float(x), float(y), float(z)] for z in range(wide) for y in range(wide) for x in range(wide)]
    for point in points:
        if all(0 < value < size for value in point):
            point[:] = [value + 0.25 * shift for value, shift in zip(point, random.uniform(-1, 1, 3), strict=True)]
    cells = []
    for x, y in np.ndindex(size, size):
        for z in range(size):
            ring = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
            cut = (x + y) % 3 == 0
            for corners in [ring[:3], [ring[0], ring[2], ring[3]]] if cut else [ring]:
                low, high = ([at(*corner, level) for corner in corners] for level in (z, z + 1))
                sides = [[low[k - 1], low[k], high[k], high[k - 1]] for k in range(len(low))]
                cells.append([low[::-1], high, *sides])

    def patch_of(face: list[int]) -> str:
        return "inlet" if all(points[node][0] == 0.0 for node in face) else "walls"

    return Case(points, cells, {"walls": "wall", "inlet": "patch"}, patch_of)


def plane(columns: int = 6, rows: int = 5, seed: int = 2) -> Case:
    """One layer of hexahedra between the empty patch ``sides``."""
    across, random = (columns + 1) * (rows + 1), np.random.default_rng(seed)
    flat = [[float(x), float(y)] for y in range(rows + 1) for x in range(columns + 1)]
    for point in flat:
        if 0 < point[0] < columns and 0 < point[1] < rows:
            point[:] = [value + 0.3 * shift for value, shift in zip(point, random.uniform(-1, 1, 2), strict=True)]
    points = [[*point, z] for z in (0.0, 0.5) for point in flat]
    cells = []
    for y in range(rows):
        for x in range(columns):
            a = y * (columns + 1) + x
            quad = [a, a + 1, a + columns + 2, a + columns + 1]
            sides = [[p, q, q + across, p + across] for p, q in zip(quad, quad[1:] + quad[:1], strict=True)]
            cells.append([quad[::-1], [k + across for k in quad], *sides])

    def patch_of(face: list[int]) -> str:
        if len({node // across for node in face}) == 1:
            return "sides"
        return "inlet" if all(points[node][0] == 0.0 for node in face) else "walls"

    return Case(points, cells, {"walls": "wall", "sides": "empty", "inlet": "patch"}, patch_of)


def strips(case: Case, count: int) -> list[list[int]]:
    """The cells in so many parts, cut across x."""
    middle = [np.mean([case.points[node][0] for face in cell for node in face]) for cell in case.cells]
    return [sorted(part.tolist()) for part in np.array_split(np.argsort(middle, kind="stable"), count)]
