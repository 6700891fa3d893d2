"""Which tetrahedra have the smallest dihedral angles, without a look at the angles of all.

Of all tetrahedra with a dihedral angle of θ that symmetric about the edge and the edge opposite to it has the largest
η. With t = tan(θ/2), the edge 2a long, and half the opposite one t, at a distance of 1 from it, D = 4at and S = 8a² +
8t² + 4, so that η is largest for 8a² = 4t² + 2:

    η ≤ 2·(t/(1 + 2t²))^(2/3),

which grows up to a regular tetrahedron's θ and falls beyond. So cells whose η is above that need not be looked at.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.simplex.tetra_measures import COLUMNS, HIGH, LOW, cubed_ratios, per_tetrahedron, renewed_ratios
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.threads import serial

Floats = NDArray[np.float64]
Rows = NDArray[np.int32]

REGULAR = math.degrees(math.acos(1.0 / 3.0))  # the dihedral angles of a regular tetrahedron
# The weight of what an angle lacks to 180°: 45° and 120°, as cells at the faces of a lattice have, count alike. With
# 0.64, by which those of a regular tetrahedron do, lattices keep 42°.
WIDE = 0.75
MORE = 4  # times as many cells of the least η are looked at first
SHARE = 1.0 + 1e-6  # times an η: for its rounding


class Ranked(NamedTuple):
    """Some cells of the least measure. rows: which. measure: (K,) degrees, ascending. least, most: of all processes."""

    rows: Rows
    measure: Floats
    least: float
    most: float

    @classmethod
    def of(cls, rows: Rows, measure: Floats, executor: Executor) -> Ranked:
        """With the extremes over all processes."""
        least = executor.minimum(float(measure.min(initial=math.inf)))
        return cls(rows, measure, least, -executor.minimum(float((-measure).min(initial=math.inf))))


def most_shape_with(angle: float) -> float:
    """The largest η of a tetrahedron one of whose dihedral angles is this, in degrees between 0 and 180."""
    t = math.tan(math.radians(0.5 * angle))
    return float(2.0 * (t / (1.0 + 2.0 * t * t)) ** (2.0 / 3.0))


def most_shape_below(measure: float, wide: float) -> float:
    """The largest η of one whose measure is at most this."""
    if measure >= REGULAR:
        return math.inf
    greatest = 180.0 - measure / wide if wide > 0.0 else 180.0
    return SHARE * max(most_shape_with(max(measure, 0.0)), most_shape_with(greatest) if greatest < 180.0 else 0.0)


def columns_of(points: Floats, cells: Tetrahedra, rows: Rows | None = None, executor: Executor = serial) -> Floats:
    """The measures (5, K) of some tetrahedra (kernels.simplex.tetra_measures). points: (N, 3 or 4)."""
    some = cells if rows is None else cells.take(rows)
    count = len(some.rows)
    columns = np.empty((COLUMNS, count))

    def look(first: int, last: int) -> None:
        per_tetrahedron(points, some.rows, some.orientation, first * LANES, min(last * LANES, count), columns)

    executor.map(look, 0, -(-count // LANES))
    return columns


def measures_of(columns: Floats, wide: float) -> Floats:
    """(K,) the smallest dihedral angle of each, or what the largest lacks to 180°, times ``wide``, if that is less."""
    found: Floats = columns[LOW]
    return np.minimum(found, wide * (180.0 - columns[HIGH])) if wide > 0.0 else found


def ratios_of(points: Floats, cells: Tetrahedra, executor: Executor = serial) -> Floats:
    """(T,) 432·η⁻³ of each, infinite where the volume is not positive."""
    out = np.empty(len(cells.rows))

    def look(first: int, last: int) -> None:
        cubed_ratios(
            points, cells.rows, cells.orientation, cells.shapes, first * LANES, min(last * LANES, len(out)), out
        )

    executor.map(look, 0, -(-len(out) // LANES))
    return out


def renew(ratios: Floats, points: Floats, cells: Tetrahedra, nodes: Rows, executor: Executor = serial) -> None:
    """Measures those of ``ratios_of`` anew that have one of these nodes, which alone have moved."""
    moved = np.zeros(len(points))
    moved[nodes] = 1.0
    executor.exchange(moved)
    chosen = moved > 0.0

    def look(first: int, last: int) -> None:
        rows = first * LANES, min(last * LANES, len(ratios))
        renewed_ratios(points, cells.rows, cells.orientation, cells.shapes, chosen, *rows, ratios)

    executor.map(look, 0, -(-len(ratios) // LANES))


def below(points: Floats, cells: Tetrahedra, measure: float, wide: float, executor: Executor = serial) -> Ranked:
    """The cells whose measure is less than this, or that are inverted."""
    ratios = ratios_of(points, cells, executor)
    rows = np.flatnonzero(~(ratios < 432.0 / most_shape_below(measure, wide) ** 3)).astype(np.int32)
    found = measures_of(columns_of(points, cells, rows, executor), wide)
    chosen = (found < measure) | np.isinf(ratios[rows])
    order = np.argsort(found[chosen], kind="stable")
    return Ranked.of(rows[chosen][order], found[chosen][order], executor)


def worst(
    points: Floats,
    cells: Tetrahedra,
    count: int,
    wide: float,
    executor: Executor = serial,
    ratios: Floats | None = None,
) -> Ranked:
    """So many cells of the least measure, all if they are fewer; of valid meshes. ratios: theirs, as far as known.

    cells: those that can change (``Volume.changeable``), of which processes may have some each.
    """
    ratios = ratios_of(points, cells, executor) if ratios is None else ratios
    rows = executor.lowest_rows(-ratios, MORE * count)
    found = measures_of(columns_of(points, cells, rows, executor), wide)
    if MORE * count < executor.counted(np.ones(len(ratios), dtype=bool)):
        limit = most_shape_below(Ranked.of(*_lowest(found, count, rows, executor), executor).most, wide)
        rows = np.flatnonzero(~(ratios < 432.0 / limit**3)).astype(np.int32)
        found = measures_of(columns_of(points, cells, rows, executor), wide)
    return Ranked.of(*_lowest(found, count, rows, executor), executor)


def _lowest(measure: Floats, count: int, rows: Rows, executor: Executor) -> tuple[Rows, Floats]:
    """So many of some rows of the least measure, and that."""
    chosen = executor.lowest_rows(measure, count, rows)
    chosen = chosen[np.argsort(measure[chosen], kind="stable")]
    return rows[chosen], measure[chosen]
