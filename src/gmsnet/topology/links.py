"""The stars of a mesh that is not all triangles, and the patterns that they follow (kernels.star.pattern)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.simplex.mean_ratio2 import EQUILATERAL, SQUARE, WEIGHTS, Simplices
from gmsnet.kernels.star.pattern import Patterns, Stars
from gmsnet.kernels.topology import connectivity, links
from gmsnet.topology.polygons import NearFaces, Offsets, offset_type

Ints = NDArray[np.int32]
Flags = NDArray[np.bool_]

# Of a simplex (v, a, b), the weights of |a|², |b|² and |b − a|² where the cell's square corner is v, a or b.
AT_NODE = (WEIGHTS[SQUARE, 0], WEIGHTS[SQUARE, 1], WEIGHTS[SQUARE, 2])
AT_A = (WEIGHTS[SQUARE, 0], WEIGHTS[SQUARE, 2], WEIGHTS[SQUARE, 1])
AT_B = (WEIGHTS[SQUARE, 2], WEIGHTS[SQUARE, 0], WEIGHTS[SQUARE, 1])
ROUND = tuple(WEIGHTS[EQUILATERAL])
FEW = 2**16  # kinds of stars that there may be: so many have a table


class Links(NamedTuple):
    """stars: of the nodes with a closed fan, by places in memory; around has ``connectivity.WIDTH`` more. simplices:
    the corner simplices of all triangles and quads.
    """

    stars: Stars
    simplices: Simplices | None

    @classmethod
    def of(
        cls, faces: NearFaces, orientation: NDArray[np.int8], fan_start: Offsets, fan: Ints, sliding: Flags
    ) -> Links:
        """From the faces by places in memory, how each is read, and the neighbours around each node that has a fan.

        sliding: (N,) nodes that have a star, too, though it may not be closed.
        """
        first = np.arange(0, len(faces.corner) + 1, 3, dtype=np.int64) if faces.first is None else faces.first
        chosen = (np.diff(fan_start) > 0) | sliding
        triangles, quads = np.zeros((2, len(chosen)), dtype=np.int32)
        links.count_cells(first, faces.corner, chosen, triangles, quads)
        both = ((triangles > 0) & (quads > 0)) | sliding
        size = np.where(both, 2 * triangles + 3 * quads, triangles + 2 * quads)
        start = np.zeros(len(chosen) + 1, dtype=offset_type(int(size.sum())))
        np.cumsum(size, out=start[1:])
        around = np.zeros(int(start[-1]) + connectivity.WIDTH, dtype=np.int32)
        links.list_nodes(
            first, faces.corner, orientation, faces.origin, chosen, both, triangles, quads, fan_start, fan, start,
            around,
        )  # fmt: skip
        kinds, number = kinds_of(triangles, quads, both)
        stars = Stars(start, around, number, patterns_of(kinds))
        return cls(stars, None if faces.first is None else simplices_of(faces, orientation))


def kinds_of(triangles: Ints, quads: Ints, both: Flags) -> tuple[list[tuple[int, int, bool]], Ints]:
    """The kinds of stars that there are, in their order, that of no cells first; and (N,) the number of each star's.

    A kind: how many triangles and how many quads, and whether each cell has nodes of its own in the star.
    """
    many = int(quads.max(initial=0)) + 1
    apart = (int(triangles.max(initial=0)) + 1) * many
    code = np.int64(many) * triangles + quads
    code[both] += apart
    if 2 * apart <= FEW:
        there = np.bincount(code, minlength=1) > 0
        there[0] = True
        found, number = np.flatnonzero(there), (np.cumsum(there, dtype=np.int32) - np.int32(1)).take(code)
    else:
        found, where = np.unique(np.append(code, 0), return_inverse=True)
        number = where[:-1].astype(np.int32)
    return [(kind % apart // many, kind % many, kind >= apart) for kind in found.tolist()], number


def simplices_of(faces: NearFaces, orientation: NDArray[np.int8]) -> Simplices:
    """The corner simplices of all triangles and quads among the faces."""
    assert faces.first is not None
    corners = np.diff(faces.first)
    count = int((corners == 3).sum() + 4 * (corners == 4).sum())
    rows, shapes = np.empty((count, 3), dtype=np.int32), np.empty(count, dtype=np.uint8)
    cells = np.empty(count, dtype=np.int32)
    links.corner_simplices(faces.first, faces.corner, orientation, rows, shapes, cells)
    return Simplices(rows, np.ones(count, dtype=np.int8), shapes, cells)


def taken_from(simplices: Simplices, rows: Ints) -> Simplices:
    """``simplices.take(rows)`` of those of cells, all arrays at once."""
    assert simplices.shapes is not None
    assert simplices.cells is not None
    count = len(rows)
    taken = Simplices(
        np.empty((count, 3), dtype=np.int32), np.empty(count, dtype=np.int8), np.empty(count, dtype=np.uint8),
        np.empty(count, dtype=np.int32),
    )  # fmt: skip
    links.take(rows, *simplices, *taken)
    return taken


def patterns_of(kinds: list[tuple[int, int, bool]]) -> Patterns:
    """The table for stars of so many triangles and quads each, and whether each cell has nodes of its own in the
    star."""
    pairs: list[tuple[int, int, int]] = []
    weights: list[tuple[float, ...]] = []
    neighbour: list[float] = []
    first, row, sums = [0], [0], []
    for triangles, quads, both in kinds:
        for k in range(triangles):
            a, b = (2 * k, 2 * k + 1) if both else (k - 1 if k else triangles - 1, k)
            pairs.append((a, b, a))
            weights.append(ROUND)
        for k in range(quads):
            low = 2 * triangles + 3 * k if both else 2 * k
            a, d, b = low, low + 1, low + 2 if both else (low + 2) % (2 * quads)
            pairs += [(a, b, d), (a, d, b), (d, b, a)]
            weights += [AT_NODE, AT_A, AT_B]
        own = [0.5] * (2 * triangles) + [0.5, 0.0, 0.5] * quads if both else [1.0] * triangles + [1.0, 0.0] * quads
        neighbour += own
        sums.append(sum(own))
        first.append(len(pairs))
        row.append(len(neighbour))
    table = np.array(pairs, dtype=np.int32).reshape(-1, 3)
    return Patterns(
        first=np.array(first, dtype=np.int32),
        pair=np.ascontiguousarray(table[:, :2]),
        other=np.ascontiguousarray(table[:, 2]),
        weight=np.array(weights, dtype=np.float64).reshape(-1, 3),
        row=np.array(row, dtype=np.int32),
        neighbour=np.array(neighbour, dtype=np.float64),
        neighbours=np.array(sums, dtype=np.float64),
    )
