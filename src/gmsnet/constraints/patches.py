"""The patches of a surface in space: its smooth parts between sharp edges, and which of its nodes slide on what."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.facets import Facets
from gmsnet.constraints.features import COLLINEAR, SLACK, Curves, curves_along, dot, lengths_of, rounding_of
from gmsnet.constraints.needles import free_edges
from gmsnet.constraints.outline import Flags, Longs, Outline, edge_keys

Floats = NDArray[np.float64]
NOTHING = -1


@dataclass(frozen=True, eq=False)
class Patches:
    """Of a surface of F facets.

    curves: those of its sharp edges. slides: (N,) bool, the nodes inside of patches that slide. rows: (F, 3) node ids.
    patch: (F,) the patch of each facet. beside: (F, 3) the facet across the edge from corner k to k + 1, NOTHING where
    that is sharp. unit: (F, 3) normals, 0 where a facet has no area. area: (F,) twice the area. flat: (F, 3) bool, the
    facet across lies in the same plane.
    """

    curves: Curves
    slides: Flags
    rows: Longs
    patch: Longs
    beside: Longs
    unit: Floats
    area: Floats
    flat: Flags


def patches_of(
    facets: Facets, points: Floats, feature_angle: float, single: bool, may: Flags, free_needles: bool = False
) -> Patches:
    """The patches of a surface. points: (N, 3). feature_angle: degrees. may: (N,) bool, which nodes may slide.

    free_needles: edges are not sharp that are so only because a facet there is thin (constraints/needles.py).

    An edge is sharp where its two facets turn by the feature angle or more, differ in their region or marks, or have
    no area, where it belongs to one facet or more than two, and where there is a line cell.
    """
    rows, nodes = facets.rows, len(points)
    normal = np.cross(points[rows[:, 1]] - points[rows[:, 0]], points[rows[:, 2]] - points[rows[:, 0]])
    area = lengths_of(normal)
    unit = np.divide(normal, area[:, None], out=np.zeros_like(normal), where=area[:, None] > 0.0)
    keys = edge_keys(rows, np.roll(rows, -1, axis=1), nodes).ravel()
    order = np.argsort(keys, kind="stable")
    begins = np.diff(keys[order], prepend=-1) != 0
    first = np.flatnonzero(begins)
    found, count = keys[order[first]], np.diff(first, append=len(keys))
    two = count == 2
    one, other = order[first], order[first + two]  # numbers 3f + k; the same one where there is no other
    f, g = one // 3, other // 3
    turning, size = _of_cells(facets, normal, unit, area)
    cosine = dot(turning[f], turning[g])
    smooth = two & (size[f] > 0.0) & (size[g] > 0.0) & (facets.label[f] == facets.label[g])
    least = math.cos(math.radians(feature_angle)) + SLACK
    gentle = smooth & (cosine >= least)
    if free_needles:
        triangles = len(rows) - facets.halves
        alike = two & (facets.label[f] == facets.label[g]) & (np.maximum(f, g) < triangles)
        freed, unit = free_edges(points[rows], unit, area, one, other, gentle, alike, least)
        gentle |= freed
    smooth = gentle
    line_keys = edge_keys(facets.lines[:, 0], facets.lines[:, 1], nodes)
    smooth &= ~np.isin(found, line_keys)

    beside, flat = np.full(len(keys), NOTHING, dtype=np.int64), np.zeros(len(keys), dtype=bool)
    beside[one[smooth]], beside[other[smooth]] = g[smooth], f[smooth]
    beyond = points[rows[g, (other + 2) % 3]] - points[rows[f, 0]]
    away = abs(dot(beyond, unit[f]))
    level = smooth & (away <= COLLINEAR * lengths_of(beyond) + rounding_of(points, single)) & (cosine > 0.0)
    flat[one[level]] = flat[other[level]] = True

    sharp = np.flatnonzero(~smooth)
    still = facets.still.copy()
    apart = ~two if facets.closed else count > 2
    elsewhere = np.setdiff1d(line_keys, found) if len(line_keys) else line_keys
    for chosen in (found[apart], elsewhere):  # edges of one facet or many; lines elsewhere
        still[chosen // nodes] = still[chosen % nodes] = True
    outline = _outline(facets, found[sharp], f[sharp], g[sharp], line_keys, still)
    curves = curves_along(outline, points, single, feature_angle, may)
    at_sharp = np.zeros(nodes, dtype=bool)
    at_sharp[outline.edges] = True
    slides = np.zeros(nodes, dtype=bool)
    slides[rows] = True
    slides &= ~at_sharp & ~still & may
    return Patches(
        curves, slides, rows, linked(beside.reshape(-1, 3)), beside.reshape(-1, 3), unit, area, flat.reshape(-1, 3)
    )


def _of_cells(facets: Facets, normal: Floats, unit: Floats, area: Floats) -> tuple[Floats, Floats]:
    """The unit normals of facets and their lengths before; of halves of quads those of the quads."""
    if not facets.halves:
        return unit, area
    begin, half = len(normal) - facets.halves, facets.halves // 2
    whole = np.tile(normal[begin : begin + half] + normal[begin + half :], (2, 1))
    length = lengths_of(whole)
    of_quads = np.divide(whole, length[:, None], out=np.zeros_like(whole), where=length[:, None] > 0.0)
    return np.concatenate([unit[:begin], of_quads]), np.concatenate([area[:begin], length])


def linked(beside: Longs, chosen: Flags | None = None) -> Longs:
    """(F,) the number of the part of each facet, of those that are joined across their edges; chosen: (F, 3) which."""
    joins = beside != NOTHING if chosen is None else chosen
    if not joins.any():
        return np.arange(len(beside), dtype=np.int64)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components  # loads what few runs need

    one, _ = np.nonzero(joins)
    shape = (len(beside), len(beside))
    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, beside[joins])), shape=shape)
    part: Longs = connected_components(graph, directed=False)[1].astype(np.int64)
    return part


def _outline(facets: Facets, keys: Longs, f: Longs, g: Longs, line_keys: Longs, still: Flags) -> Outline:
    """The sharp edges with these keys, between facets f and g: labelled by what lies on both sides and on them."""
    nodes = len(still)
    sides = np.sort(np.column_stack([facets.label[f], facets.label[g]]), axis=1)
    marks = np.full(len(keys), NOTHING, dtype=np.int64)
    place = np.searchsorted(keys, line_keys)
    on_edge = np.flatnonzero(place < len(keys))  # none where there are no sharp edges
    on_edge = on_edge[keys[place[on_edge]] == line_keys[on_edge]]
    marks[place[on_edge]] = facets.line_marks[on_edge]
    table, label = np.unique(np.column_stack([sides, marks]), axis=0, return_inverse=True)
    names = tuple(tuple(dict.fromkeys(facets.names[a] + facets.names[b])) for a, b, _ in table.tolist())
    edges = np.column_stack([keys // max(nodes, 1), keys % max(nodes, 1)])
    return Outline(edges, label.reshape(-1), names, still)
