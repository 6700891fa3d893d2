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
from gmsnet.kernels.whole import facets as kernels

Floats = NDArray[np.float64]
NOTHING = -1
FEW, LITTLE = 3, 1.5  # sharp edges that hang together are no crease yet, if they bend by less than this times the angle


@dataclass(frozen=True, eq=False)
class Patches:
    """Of a surface of F facets.

    curves: those of its sharp edges. slides: (N,) bool, the nodes inside of patches that slide. rows: (F, 3) node ids.
    patch: (F,) the patch of each facet. beside: (F, 3) the facet across the edge from corner k to k + 1, NOTHING where
    that is sharp. unit: (F, 3) normals, 0 where a facet has no area. area: (F,) twice the area. flat: (F, 3) bool, the
    facet across lies in the same plane. tips: (N,) bool, see ``tips_of``. alone: how many nodes would slide but for
    edges of ``alone_of``, and the feature angle that would let them.
    """

    curves: Curves
    slides: Flags
    rows: Longs
    patch: Longs
    beside: Longs
    unit: Floats
    area: Floats
    flat: Flags
    tips: Flags
    alone: tuple[int, float] = (0, 0.0)


def patches_of(
    facets: Facets, points: Floats, feature_angle: float, single: bool, may: Flags, free_needles: Flags | bool = False
) -> Patches:
    """The patches of a surface. points: (N, 3). feature_angle: degrees. may: (N,) bool, which nodes may slide.

    free_needles: edges are not sharp that are so only because a facet there is thin (constraints/needles.py). (F,)
    bool: those between two of these facets.

    An edge is sharp where its two facets turn by the feature angle or more, differ in their region or marks, or have
    no area, where it belongs to one facet or more than two, and where there is a line cell.
    """
    rows, nodes = facets.rows, len(points)
    normal, unit, area = np.empty((len(rows), 3)), np.empty((len(rows), 3)), np.empty(len(rows))
    kernels.facet_normals(points, rows, normal, area, unit)
    found, count, one, other = np.empty((4, rows.size), dtype=np.int64)
    edges = kernels.list_edges(rows, nodes, found, count, one, other)
    found, count, one, other = found[:edges], count[:edges], one[:edges], other[:edges]
    two, f, g = count == 2, one // 3, other // 3
    turning, size = _of_cells(facets, normal, unit, area)
    cosine = np.empty(edges)
    kernels.cosines(turning, one, other, cosine)
    like = two & (size[f] > 0.0) & (size[g] > 0.0) & (facets.label[f] == facets.label[g])
    least = math.cos(math.radians(feature_angle)) + SLACK
    gentle = like & (cosine >= least)
    if np.any(free_needles):
        triangles, chosen = len(rows) - facets.halves, np.broadcast_to(free_needles, len(rows))
        alike = two & chosen[f] & chosen[g]
        alike &= (facets.label[f] == facets.label[g]) & (np.maximum(f, g) < triangles)
        freed, unit = free_edges(points[rows], unit, area, one, other, gentle, alike, least)
        gentle |= freed
    line_keys = edge_keys(facets.lines[:, 0], facets.lines[:, 1], nodes)
    unmarked = ~np.isin(found, line_keys)
    smooth = gentle & unmarked

    beside, flat = np.full(rows.size, NOTHING, dtype=np.int64), np.zeros(rows.size, dtype=bool)
    kernels.find_level(
        points, rows, unit, one, other, smooth, cosine, COLLINEAR, rounding_of(points, single), beside, flat
    )

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
    larger = min(LITTLE * feature_angle, 90.0)
    little = like & unmarked & (cosine > math.cos(math.radians(larger)))
    alone = alone_of(outline.edges, little[sharp])
    slides = np.zeros(nodes, dtype=bool)
    slides[rows] = True
    tips = tips_of(rows, unit, least, ~at_sharp)
    slides &= ~at_sharp & ~tips & ~still & may
    across, beside_few = beside.reshape(-1, 3), (int(np.count_nonzero(~still[alone] & may[alone])), larger)
    return Patches(curves, slides, rows, linked(across), across, unit, area, flat.reshape(-1, 3), tips, beside_few)


def alone_of(edges: Longs, little: Flags) -> Longs:
    """The nodes of sharp edges (E, 2) that hang together with FEW others at most, and of which all bend little.

    Uneven nodes make such edges on a curved surface; a crease has more of them.
    """
    if not little.any():
        return edges[:0, 0]
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components  # loads what few runs need

    ids, ends = np.unique(edges, return_inverse=True)
    ends = ends.reshape(-1, 2)
    graph = coo_array((np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=(len(ids), len(ids)))
    parts, part = connected_components(graph, directed=False)
    of_edge = part[ends[:, 0]]
    chosen = (np.bincount(of_edge, minlength=parts) <= FEW) & (np.bincount(of_edge, ~little, minlength=parts) == 0)
    found: Longs = ids[chosen[part]]
    return found


def tips_of(rows: Longs, unit: Floats, least: float, among: Flags) -> Flags:
    """(N,) bool, the nodes of these at which every facet turns from the mean of their normals by an angle or more.

    Such is the tip of a cone of many facets, whose edges are all blunt. least: the cosine of the angle.
    """
    found = np.zeros(len(among), dtype=bool)
    if least <= 0.0:
        return found
    total, count = np.zeros((len(among), 3)), np.zeros(len(among), dtype=np.int64)
    kernels.add_units(rows, unit, total, count)
    found = among & (count > 0) & (dot(total, total) <= (least * count) ** 2)
    if found.any():
        facet, corner = np.nonzero(found[rows])
        node = rows[facet, corner]
        nearest = np.full(len(among), -np.inf)
        np.maximum.at(nearest, node, dot(unit[facet], total[node]))
        found &= nearest <= least * lengths_of(total)
    return found


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
    part = np.full(len(beside), NOTHING, dtype=np.int64)
    kernels.link(beside, joins, np.empty(len(beside), dtype=np.int64), part)
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
