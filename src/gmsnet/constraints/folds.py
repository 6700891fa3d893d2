"""Where a curved surface is folded over, as one whose nodes were thrown along it, and the charts in which to mend that.

What a surface is like there follows from the products of edges, added over some rings of facets: those of facets that
lie over one another cancel. Two sides of a thin sheet cancel as well, and so tell nothing.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.charts import (
    Chart,
    across_edges,
    axes_across,
    edges_of,
    level,
    normals_of,
    quads_of,
    turned_corners,
)
from gmsnet.constraints.facets import Facets
from gmsnet.constraints.features import dot, lengths_of
from gmsnet.constraints.outline import Flags, Longs
from gmsnet.constraints.patches import NOTHING, linked

Floats = NDArray[np.float64]
FOLD = math.cos(math.radians(150.0))  # between normals, from which on neighbours are folded
PASSES = 12  # in which products of edges are added up, each time those of the facets beside
COHERENT = 0.2  # of the areas that were added: a sum of products that is shorter tells no normal
RINGS = 4  # of facets around those that are turned over belong to their chart
CAP = math.cos(math.radians(50.0))  # between the axis of a chart and the normals in it, at least
UPRIGHT = math.cos(math.radians(65.0))  # between the normal of the surface and that of a facet of a step in it, at most
THIN = 0.05  # of the square of its longest edge is twice the area of a facet whose normal tells nothing
GENTLEST = 45.0  # degrees: by more facets may not turn within a chart, whatever the feature angle is


class Folds:
    """The facets of a surface that are turned over, in clusters that hang together.

    near: (n,) the facets around folds, ascending, which alone are looked at. cluster: (n,) the number of the cluster of
    each that is turned over, or is half of a quad with such a corner; else NOTHING. torn: (N,) bool, the nodes at
    creases, steps, and the rim of the surface.
    """

    near: Longs
    cluster: Longs
    torn: Flags

    def __init__(self, facets: Facets, points: Floats, feature_angle: float, near: Longs | None = None) -> None:
        """points: (N, 3). feature_angle: degrees, by which facets turn at a crease; no chart goes across one. near:
        facets to look at, where others around them were folded."""
        rows, begin, half = facets.rows, len(facets.rows) - facets.halves, facets.halves // 2
        twin = np.arange(len(rows))
        twin[begin : begin + half] += half
        twin[begin + half :] -= half
        normal, unit, area = normals_of(points, rows)
        edges = edges_of(len(points), rows)
        f, g = edges[2] // 3, edges[3] // 3
        sine = math.sin(math.radians(min(feature_angle, GENTLEST)))
        joined = level(facets, points, unit, area, edges, sine) | ((f != g) & (twin[f] == g))
        one, corner = edges[2, ~joined] // 3, edges[2, ~joined] % 3
        self.torn = np.zeros(len(points), dtype=bool)
        self.torn[rows[one, corner]] = self.torn[rows[one, (corner + 1) % 3]] = True
        over = joined & (dot(unit[f], unit[g]) < FOLD)
        around = np.zeros(len(rows), dtype=bool)
        around[f[over]] = around[g[over]] = True
        around = _grown(around, rows, PASSES + RINGS)
        if near is not None:
            around[near] = True
        self.near = np.flatnonzero(around | around[twin])
        self._rows, self._twin = rows[self.near], _among(self.near, twin[self.near])
        self._beside = _among(self.near, across_edges(len(rows), *edges[2:, joined])[self.near])
        self._normal = self._smoothed(normal[self.near], area[self.near])
        turned = self._turned(facets, points)
        self.torn[self._rows[self._upright(unit[self.near], area[self.near], points)]] = True
        self.cluster = np.where(turned, self._linked(turned), NOTHING)
        self._part = self._linked(_grown(turned, self._rows, RINGS))
        self._parts = np.split(np.argsort(self._part, kind="stable"), np.cumsum(np.bincount(self._part))[:-1])

    def _linked(self, chosen: Flags) -> Longs:
        """(n,) the number of the part of each facet, of those that chosen ones (n,) make up."""
        return linked(self._beside, (self._beside != NOTHING) & chosen[:, None] & chosen[self._beside])

    def _smoothed(self, normal: Floats, area: Floats) -> Floats:
        """(n, 3) the unit normals of the surface at facets, 0 where they are not known."""
        total = np.zeros((len(normal) + 1, 4))  # the last one is what NOTHING names
        total[:-1, :3], total[:-1, 3] = normal, area
        for _ in range(PASSES):
            total[:-1] = 0.25 * (total[:-1] + total[self._beside].sum(axis=1))
        length = lengths_of(total[:-1, :3])[:, None]
        known = length > COHERENT * total[:-1, 3:]
        return np.divide(total[:-1, :3], length, out=np.zeros_like(normal), where=known)

    def _turned(self, facets: Facets, points: Floats) -> Flags:
        """(n,) the facets of cells with a corner that is turned against the surface."""
        begin, half = len(facets.rows) - facets.halves, facets.halves // 2
        turned = turned_corners(points[self._rows], self._normal)
        first = np.flatnonzero((self.near >= begin) & (self.near < begin + half))
        second, quads = self._twin[first], quads_of(facets)[self.near[first] - begin]
        turned[first] = turned[second] = turned_corners(points[quads], self._normal[first] + self._normal[second])
        return turned & self._normal.any(axis=1)

    def _upright(self, unit: Floats, area: Floats, points: Floats) -> Flags:
        """(n,) the facets of steps, upright to the surface. Thin ones do not count, nor halves of quads of which one is
        turned over: their normals tell nothing. Nor does one alone, as a thrown node makes it."""
        slope = dot(unit, self._normal)
        crossed = (slope < 0.0) | (slope[self._twin] < 0.0)
        crossed &= self._twin != np.arange(len(slope))
        upright = (abs(slope) < UPRIGHT) & ~thin(points[self._rows], area) & self._normal.any(axis=1) & ~crossed
        others = (self._beside != NOTHING) & (self._beside != self._twin[:, None])
        steps: Flags = upright & (others & upright[self._beside]).any(axis=1)
        return steps

    def chart(self, number: int, points: Floats) -> Chart | None:
        """The chart around the first facet of a cluster, with what else is turned over nearby; None where that is half
        of a quad whose other half is not seen from there. points: (N, 3)."""
        seed = np.flatnonzero(self.cluster == number)[:1]
        axis = self._normal[seed[0]]
        part = self._parts[self._part[seed[0]]]
        ids = part[self._normal[part] @ axis >= CAP]
        ids = ids[_among(ids, self._twin[ids]) != NOTHING]
        place = _among(ids, seed)[0]
        if place == NOTHING:
            return None
        beside = _among(ids, self._beside[ids])
        piece = linked(beside, beside != NOTHING)
        ids = ids[piece == piece[place]]
        return Chart(self.near[ids], points[self._rows[seed[0], 0]], axes_across(axis))

    def clusters_in(self, chart: Chart) -> Longs:
        """(k,) the number of the cluster of each facet of a chart, else NOTHING."""
        return self.cluster[np.searchsorted(self.near, chart.facets)]


def thin(triangles: Floats, area: Floats) -> Flags:
    """(k,) the triangles (k, 3, 3) whose normals tell nothing. area: twice that of each."""
    longest = np.max([lengths_of(triangles[:, k] - triangles[:, k - 1]) for k in range(3)], axis=0)
    return np.asarray(area <= THIN * longest**2)


def _among(ids: Longs, values: Longs) -> Longs:
    """The places of values among ids, which ascend; NOTHING where they are not."""
    if not len(ids):
        return np.full(values.shape, NOTHING)
    place = np.minimum(np.searchsorted(ids, values), len(ids) - 1)
    return np.where(ids[place] == values, place, NOTHING)


def _grown(chosen: Flags, rows: Longs, rings: int) -> Flags:
    """(F,) some facets (F, 3) with so many rings of facets around, at their nodes."""
    at: Flags = np.zeros(int(rows.max(initial=-1)) + 1, dtype=bool)
    for _ in range(rings):
        at[rows[chosen]] = True
        chosen = np.any(at[rows], axis=1)
    return chosen
