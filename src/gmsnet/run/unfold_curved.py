"""Folds of curved parts of a surface: untangled on charts, one by one, and put back on the surface that nodes tell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.charts import Chart, across_edges, edges_of, normals_of, turned_corners
from gmsnet.constraints.facets import Facets, edge_lengths
from gmsnet.constraints.features import dot, lengths_of
from gmsnet.constraints.folds import FOLD, UPRIGHT, Folds, thin
from gmsnet.constraints.grid import Grid
from gmsnet.constraints.heights import heights_at, within
from gmsnet.constraints.options import TOLERANCE
from gmsnet.constraints.patches import NOTHING, linked
from gmsnet.kernels.star.guard import Precision
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.measure.surface_change import places_on
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.flat_part import FlatPart
from gmsnet.run.options import SmoothOptions
from gmsnet.run.run import precision_of

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Longs = NDArray[np.int64]
ROUNDS = 5  # in each of which all clusters are looked at that are left
TRIES = 6  # on one chart, with nodes held of what could not be mended
FAILURES = 20  # parts in vain, for each that was mended and one more, until the rest is left as it is
UPWARD = np.array([[0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class CurvedParts:
    """facets, given: (N, 3) of the input. held: (N,) bool. uses: (N,) how many facets have each node. limit: (N,) how
    far from the input's facets nodes may come to lie; bound: how far any place on a facet, ∞ if that was not asked for.
    precision: of points in space, before they are rounded; written: after that. angle: by which facets turn at creases,
    in degrees.
    """

    facets: Facets
    given: Floats
    held: Flags
    uses: Longs
    limit: Floats
    bound: float
    precision: Precision
    written: Precision
    angle: float

    @cached_property
    def grid(self) -> Grid:
        """To find the nearest facets of the input."""
        return Grid(self.given[self.facets.rows])

    @cached_property
    def least(self) -> float:
        """The least 1/q of a facet of the input: none that is moved gets less."""
        return float(_shapes(self.given[self.facets.rows]).min(initial=1.0))

    @classmethod
    def of(
        cls, mesh: Mesh, facets: Facets, given: Floats, held: Flags, uses: Longs, precision: Precision,
        options: SmoothOptions,
    ) -> CurvedParts:  # fmt: skip
        """Of a surface, and what is asked for."""
        tolerance = options.distance if math.isfinite(options.distance) else TOLERANCE
        limit = tolerance * edge_lengths(facets, given, mesh)
        bound = math.inf
        if options.hausdorff is not None:
            bound = facets.bound(given, options.hausdorff)
        limit = np.minimum(limit, bound)
        return cls(facets, given, held, uses, limit, bound, precision, precision_of(mesh), options.feature_angle)

    def mend(self, points: Floats, laid: Flags) -> list[str]:
        """Mends what can be of the points (N, 3), in place, and says so. laid: (F,) bool, where charts are flagged."""
        folds = Folds(self.facets, points, self.angle)
        charts, failed, was = 0, 0, self._count(folds)
        for _ in range(ROUNDS):
            before = charts
            done = set[int]()
            for number in np.unique(folds.cluster[folds.cluster != NOTHING]).tolist():
                given_up = failed > FAILURES * (1 + charts)
                chart = None if given_up or number in done else folds.chart(number, points)
                if chart is None:
                    continue
                mended, looked_at = self._mended(chart, folds, points), folds.clusters_in(chart)
                failed += mended is None
                if mended is not None:
                    laid[chart.facets] = True
                    looked_at = looked_at[mended]
                    charts += 1
                done |= set(looked_at.tolist())
            if charts == before:
                break
            folds = Folds(self.facets, points, self.angle, folds.near)
        if not charts:
            return []
        left = self._count(folds)
        said = f"{left:,} of {was:,} cells that are folded over are left" if left else f"all {was:,} cells mended"
        return [f"where the surface is folded over, untangling: {said}; {charts:,} parts laid flat"]

    def _count(self, folds: Folds) -> int:
        """How many cells are turned over."""
        turned = folds.near[folds.cluster != NOTHING]
        return int((turned < len(self.facets.rows) - self.facets.halves // 2).sum())

    def _mended(self, chart: Chart, folds: Folds, points: Floats) -> Flags | None:
        """(k,) bool, the facets of a chart that were inverted on it and no longer are; None where nothing was mended.

        Each cluster of these is mended in full, or its nodes stay. Then points (N, 3) are changed in place.
        """
        part = FlatPart.of(self.facets, chart, points, self.held | folds.torn, self.uses)
        rows, held = part.rows, part.held.copy()
        was = _inverted(part, part.flat)
        if not was.any() or self._rough(chart, part, sorted_unique(rows[was])):
            return None
        beside = _beside(rows)
        cluster = np.where(was, linked(beside, (beside != NOTHING) & was[:, None] & was[beside]), NOTHING)
        left = np.zeros(len(rows), dtype=bool)
        for _ in range(TRIES):
            held[rows[left]] = True
            found = part.untangled(held, self.precision)
            if found is None or not len(found[1]):
                return None
            _, own, step = found
            flat = part.flat.copy()
            flat[own] += step
            failed = was & ~left & np.isin(cluster, cluster[was & _inverted(part, flat)])
            places, wrong = self._lifted(chart, part, flat, own, points, left)
            if not failed.any() and not wrong.any():
                ids, before = part.nodes[own], points[part.nodes[own]]
                points[ids] = places[own]
                if self.bound < math.inf and self._apart(chart, folds.near, points) > self.bound:
                    points[ids] = before
                    return None
                return was & ~left
            left |= failed
            held[own[wrong[own]]] = True
        return None

    def _rough(self, chart: Chart, part: FlatPart, at: Longs) -> bool:
        """Are most of some nodes of a part none of a smooth surface? Then untangling it would be in vain."""
        old = self.given[part.nodes] - chart.origin
        flat = old @ chart.axes.T
        off = heights_at(flat[at], flat, old @ chart.normal).off
        return bool(np.mean(off > self.limit[part.nodes[at]]) > 0.5)

    def _apart(self, chart: Chart, near: Longs, points: Floats) -> float:
        """How far the facets of a chart are from the input's, and these, as they were, from those of points (N, 3).
        near: facets of the surface, which alone are looked at."""
        rows = self.facets.rows[chart.facets]
        there, _ = self.grid.nearest(places_on(points[rows]))
        here, _ = Grid(points[self.facets.rows[near]]).nearest(places_on(self.given[rows]))
        return float(max(there.max(), here.max()))

    def _lifted(
        self, chart: Chart, part: FlatPart, flat: Floats, own: Longs, points: Floats, left: Flags
    ) -> tuple[Floats, Flags]:
        """The nodes of a part in space (n, 3), those that have moved on the surface that the input's nodes tell; and
        which of these nodes (n,) are none of a smooth surface, or of facets that would be folded or upright there.

        flat: (n, 2) where they lie on the chart now. own: of those that have moved. left: (k,) facets that are no
        matter.
        """
        rows = part.rows
        moved = np.zeros(len(flat), dtype=bool)
        moved[own] = True
        touched = moved[rows].any(axis=1)
        at = sorted_unique(rows[touched])
        old = self.given[part.nodes] - chart.origin
        surface = heights_at(flat[at], old @ chart.axes.T, old @ chart.normal)
        side = np.zeros((len(flat), 3))
        side[at] = chart.normal - surface.slope @ chart.axes
        places, height = points[part.nodes], surface.height[np.searchsorted(at, own)]
        places[own] = chart.origin + flat[own] @ chart.axes + height[:, None] * chart.normal
        far, which = self.grid.nearest(places[own])
        room = self.limit[part.nodes[own]]
        out = np.flatnonzero(far > room)
        places[own[out]] = within(places[own[out]], self.grid.boxes.triangles[which[out]], room[out])
        places[own] = self.written.rounded(places[own])
        worse = _shapes(places[rows]) < self.least
        _, unit, area = normals_of(places, rows)
        steep = _steep(unit, side[rows].sum(axis=1)) & ~thin(places[rows], area)
        bad = touched & ~left & (_turned(part, places, side) | steep | _sharp(rows, unit, len(flat)) | worse)
        wrong = np.zeros(len(flat), dtype=bool)
        wrong[rows[bad]] = True
        wrong[at] |= surface.off > self.limit[part.nodes[at]]
        wrong &= moved
        return places, wrong


def _inverted(part: FlatPart, flat: Floats) -> Flags:
    """(k,) the facets of cells that are inverted where nodes lie at some places (n, 2)."""
    at = np.column_stack([flat, np.zeros(len(flat))])
    return part.of_cells(*(turned_corners(at[rows], UPWARD) for rows in (part.triangles, part.quads)))


def _turned(part: FlatPart, places: Floats, side: Floats) -> Flags:
    """(k,) the facets of cells with a corner turned against the surface, whose normals at nodes are ``side`` (n, 3)."""
    cells = part.triangles, part.quads
    return part.of_cells(*(turned_corners(places[rows], side[rows].sum(axis=1)) for rows in cells))


def _steep(unit: Floats, across: Floats) -> Flags:
    """(k,) the facets with normals (k, 3) about upright to a surface, whose own there are along ``across`` (k, 3).

    Their edges would look sharp, and hold nodes there.
    """
    return np.asarray(dot(unit, across) < UPRIGHT * lengths_of(across))


def _sharp(rows: Longs, unit: Floats, nodes: int) -> Flags:
    """(k,) the facets (k, 3) of so many nodes, with normals (k, 3), that have a neighbour which is folded over them."""
    _, count, one, other = edges_of(nodes, rows)
    over = (count == 2) & (dot(unit[one // 3], unit[other // 3]) < FOLD)
    found = np.zeros(len(rows), dtype=bool)
    found[one[over] // 3] = found[other[over] // 3] = True
    return found


def _shapes(triangles: Floats) -> Floats:
    """(k,) 1/q of triangles in space (k, 3, 3), 0 where all corners are at one place."""
    sides = np.roll(triangles, -1, axis=1) - triangles
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    squares = np.einsum("ijk,ijk->i", sides, sides)
    found: Floats = 2.0 * math.sqrt(3.0) * area / np.where(squares > 0.0, squares, 1.0)
    return found


def _beside(rows: Longs) -> Longs:
    """(k, 3) the facet across each edge of facets (k, 3)."""
    edges = edges_of(int(rows.max()) + 1, rows)
    return across_edges(len(rows), *edges[2:, edges[1] == 2])
