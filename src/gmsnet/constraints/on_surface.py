"""What the nodes of a surface in space slide on, for the kernels: planes, smooth patches, lines and curves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.features import COLLINEAR, dot, rounding_of
from gmsnet.constraints.grid import Grid, no_boxes
from gmsnet.constraints.on_geometry import PER_EDGE, OnGeometry
from gmsnet.constraints.outline import Flags, Longs
from gmsnet.constraints.patches import NOTHING, Patches
from gmsnet.constraints.smooth_patches import Skin, Vertices, handles, skin_of, summed
from gmsnet.kernels.star.pieces import NOWHERE
from gmsnet.kernels.star.surface import CURVE, CURVED, FLAT, LINE, Surface
from gmsnet.kernels.whole import skin as kernels
from gmsnet.kernels.whole.nearest import Boxes
from gmsnet.topology.polygons import Ints

Floats = NDArray[np.float64]


SAG = 4.0  # times the bound over the curvature: of 8, with which the chord of a circle is as far off
GROWTH = 8.0  # times its longest edge: what a facet grows to at most, where none is looked at


class Rows(NamedTuple):
    """Of nodes (K,) that slide on things of one kind: the frame of each, and the facet or piece where each is."""

    nodes: Longs
    kind: int
    of: Longs
    place: Longs


def surface_of(
    patches: Patches, points: Floats, memory: Ints, single: bool, limit: Floats | None = None,
    geometry: OnGeometry | None = None, folds: bool = True,
    vertices: Vertices | None = None, bound: float = math.inf,
) -> Surface | None:  # fmt: skip
    """The constraint for kernels, with the nodes where they are; None where none slides.

    points: (N, 3) by node ids. memory: (N,) node ids in memory order. limit: (N,) how far each may go from the facets
    or edges; None: as far as the cubics are. geometry: the true shape of what is not plane or straight. folds: the
    facets around nodes are listed, so that none turns over. vertices: see ``vertices_of``, where they are known.
    bound: how far any place on a facet may be from them.
    """
    slides = patches.slides | patches.curves.slides
    if not slides.any():
        return None
    facet = np.full(len(points), NOTHING, dtype=np.int64)
    facet[patches.rows] = np.arange(len(patches.rows))[:, None]
    plane, frame = _planes(patches, points, single)
    inner = np.flatnonzero(patches.slides)
    number = plane[patches.patch[facet[inner]]]
    level = number != NOTHING
    found = [Rows(inner[level], FLAT, number[level], np.zeros(level.sum(), dtype=np.int64))]
    curved = inner[~level]
    kept = np.isin(patches.patch, patches.patch[facet[curved]])
    if bound < math.inf:
        kept = np.isin(patches.patch, patches.patch[kept | patches.curves.slides[patches.rows].any(axis=1)])
    skin = skin_of(patches, points, kept, vertices) if geometry is None else geometry.skin(patches, points, kept)
    found.append(Rows(curved, CURVED, np.zeros(len(curved), dtype=np.int64), skin.at[curved]))
    lines, line_frame, pieces, before, after = _along_curves(patches, points, len(frame[0]), geometry)
    found += lines

    nodes, kind, of, place = (np.concatenate(parts) for parts in zip(*map(_columns, found), strict=True))
    order = np.argsort(nodes)
    row = np.full(len(points), NOWHERE, dtype=np.int32)
    row[nodes[order]] = np.arange(len(nodes))
    origin, direction, same = (np.concatenate(parts) for parts in zip(frame, line_frame, strict=True))
    of_row = nodes[order]
    looked = _looked_at(patches, points, skin, kept, bound)
    return Surface(
        row[memory], kind[order].astype(np.int8), of[order].astype(np.int32), place[order].astype(np.int32),
        origin, direction, same, skin.vertex, skin.facet, pieces, before, after, bool(single),
        np.full(len(of_row), np.inf) if limit is None else limit[of_row],
        *_around(patches.rows if folds else patches.rows[:0], patches.unit, row, memory),
        looked.bound, looked.at_facet, np.where(kind[order] == FLAT, np.inf, looked.at_node[of_row]),
        looked.shortest, looked.boxes,
    )  # fmt: skip


class LookedAt(NamedTuple):
    """Beyond which squared length of edges facets are looked at: see ``Surface``; at nodes (N,) as they were."""

    bound: float
    at_facet: Floats
    at_node: Floats
    shortest: float
    boxes: Boxes


def _looked_at(patches: Patches, points: Floats, skin: Skin, kept: Flags, bound: float) -> LookedAt:
    """kept: (F,) facets that the skin has, maybe in several parts. bound: how far facets may be from them.

    The chord of length l of a circle of radius r is l²/8r away from it: edges of facets that are shorter are not looked
    at, for the largest of the curvatures around, and with margin. Where all edges may become GROWTH times as long as
    the longest of a facet, none is.
    """
    of_facet, of_node = np.full(len(kept), np.inf), np.full(len(points), np.inf)
    if bound < math.inf:
        curvature, most = patches.curves.curvatures(points), np.zeros(len(kept))
        kernels.add_curvatures(points, patches.rows, patches.unit, patches.area, patches.beside, curvature)
        kernels.spread(patches.rows, curvature, most)
        kernels.spread(patches.rows, curvature, most)
        for span, each in ((of_facet, most), (of_node, curvature)):
            np.divide(SAG * bound, each, out=span, where=each > 0.0)
    several, triangles = len(skin.facet) // max(int(kept.sum()), 1), skin.vertex[skin.facet[:, :3], :3]
    if kernels.least_growth(points, patches.rows, of_facet) >= GROWTH * GROWTH or not len(triangles):
        none = np.full(len(triangles), np.inf)
        return LookedAt(math.inf, none, np.full(len(points), np.inf), math.inf, no_boxes())
    at_facet = np.repeat(of_facet[kept], several)
    shortest = float(min(at_facet.min(), of_node.min()))
    return LookedAt(bound, at_facet, of_node, shortest, Grid(triangles).boxes)


def _around(rows: Longs, unit: Floats, row: Ints, memory: Ints) -> tuple[Ints, Ints, Floats]:
    """The facets around the node of each row (``Surface``). row: (N,) by node ids."""
    around = np.concatenate([np.column_stack([rows[:, k], rows[:, k - 2], rows[:, k - 1]]) for k in range(3)])
    chosen = np.flatnonzero(row[around[:, 0]] != NOWHERE)
    chosen = chosen[np.argsort(row[around[chosen, 0]], kind="stable")]
    start = np.zeros(int((row != NOWHERE).sum()) + 1, dtype=np.int32)
    np.cumsum(np.bincount(row[around[chosen, 0]], minlength=len(start) - 1), out=start[1:])
    place = np.empty(len(memory), dtype=np.int32)
    place[memory] = np.arange(len(memory), dtype=np.int32)
    return start, place[around[chosen, 1:]], np.tile(unit[: len(rows)], (3, 1))[chosen]


def _columns(rows: Rows) -> tuple[Longs, Longs, Longs, Longs]:
    return rows.nodes, np.full(len(rows.nodes), rows.kind), rows.of, rows.place


def _planes(patches: Patches, points: Floats, single: bool) -> tuple[Longs, tuple[Floats, Floats, Flags]]:
    """The number of the plane of each patch that is one, else NOTHING; origin, direction and common coordinates."""
    count = int(patches.patch.max(initial=-1)) + 1
    normal = summed(patches.patch, patches.unit * patches.area[:, None], count)
    length = np.sqrt(dot(normal, normal))
    normal = np.divide(normal, length[:, None], out=np.zeros_like(normal), where=length[:, None] > 0.0)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    origin, away = np.zeros((count, 3)), np.zeros(count)
    kernels.bound_patches(patches.rows, patches.patch, points, low, high, origin)
    kernels.leave_planes(patches.rows, patches.patch, points, origin, normal, away)
    near = away <= COLLINEAR * (high - low).max(axis=1, initial=0.0) + rounding_of(points, single)
    same = low == high
    normal[same.any(axis=1)] = same[same.any(axis=1)]
    chosen = np.flatnonzero((length > 0.0) & near & (same.sum(axis=1) <= 1))
    plane = np.full(count, NOTHING, dtype=np.int64)
    plane[chosen] = np.arange(len(chosen))
    return plane, (origin[chosen], normal[chosen], same[chosen])


def _along_curves(
    patches: Patches, points: Floats, first: int, geometry: OnGeometry | None
) -> tuple[list[Rows], tuple[Floats, Floats, Flags], Floats, Ints, Ints]:
    """The nodes on each curve; their frames, numbered from ``first`` on; cubic pieces and what follows them."""
    found, frames, pieces, links, count = list[Rows](), list[tuple[Floats, Floats, Flags]](), list[Floats](), [], 0
    curves, per_edge = patches.curves, 1 if geometry is None else PER_EDGE
    for c in range(len(curves)):
        nodes = curves.nodes_of(c)
        inner, place = nodes[:-1] if curves.closed[c] else nodes[1:-1], np.arange(len(nodes) - 1)
        place = place if curves.closed[c] else place[1:]
        sliding = curves.slides[inner]
        if not sliding.any():
            continue
        chosen, place, p = inner[sliding].astype(np.int64), place[sliding], points[nodes]
        same, way = (p == p[0]).all(axis=0), p[-1] - p[0]
        number = np.full(len(chosen), first + len(frames))
        if curves.straight[c]:
            frames.append((p[0], way / np.sqrt(dot(way[None], way[None])[0]), same))
            found.append(Rows(chosen, LINE, number, np.zeros_like(number)))
            continue
        frames.append((p[0], np.zeros(3), same))
        found.append(Rows(chosen, CURVE, number, count + per_edge * place))
        if geometry is None:
            pieces.append(_cubics(p, *_tangents(p, bool(curves.closed[c]))))
        else:
            q, tangent = geometry.chain(patches, c, p)
            pieces.append(_cubics(q, tangent[:-1], tangent[1:]))
        numbers = np.arange(count, count + len(pieces[-1]))
        links.append(_neighbours(numbers, bool(curves.closed[c])))
        count += len(numbers)
    none = np.empty((0, 3))
    frame = (
        np.vstack([none, *(origin for origin, _, _ in frames)]),
        np.vstack([none, *(direction for _, direction, _ in frames)]),
        np.vstack([none.astype(bool), *(same for _, _, same in frames)]),
    )
    before, after = np.concatenate([np.empty((2, 0), dtype=np.int32), *links], axis=1)
    return found, frame, np.concatenate([np.empty((0, 4, 3)), *pieces]), before, after


def _neighbours(numbers: Longs, closed: bool) -> Ints:
    """(2, P) int32 the pieces before and after each of a curve, NOWHERE at its ends."""
    both = np.stack([np.roll(numbers, 1), np.roll(numbers, -1)]).astype(np.int32)
    if not closed:
        both[0, 0] = both[1, -1] = NOWHERE
    return both


def _cubics(p: Floats, start: Floats, end: Floats) -> Floats:
    """(K − 1, 4, 3) cubics over the edges of a chain (K, 3), along tangents at the start and at the end of each."""
    edge = np.diff(p, axis=0)
    return np.stack([p[:-1], p[:-1] + handles(edge, start), p[1:] - handles(edge, end), p[1:]], axis=1)


def _tangents(p: Floats, closed: bool) -> tuple[Floats, Floats]:
    """Those of circles through three nodes, at the start and at the end of each edge.

    At an end of a chain the tangent makes the same angle with the edge as at the edge's other end. On circles the
    error is of sixth order.
    """
    edge = np.diff(p, axis=0)
    length = np.sqrt(dot(edge, edge))[:, None]
    unit = edge / length
    back, ahead = (np.roll(unit, 1, axis=0), unit) if closed else (unit[:-1], unit[1:])
    near, far = (np.roll(length, 1, axis=0), length) if closed else (length[:-1], length[1:])
    tangent = back * far + ahead * near
    if closed:
        return tangent, np.roll(tangent, -1, axis=0)
    first = _mirrored(tangent[:1], unit[:1])
    return np.vstack([first, tangent]), np.vstack([tangent, _mirrored(tangent[-1:], unit[-1:])])


def _mirrored(tangent: Floats, unit: Floats) -> Floats:
    """Tangents (K, 3) at the other ends of arcs whose chords have these directions."""
    mirrored: Floats = 2.0 * dot(tangent, unit)[:, None] * unit - tangent
    return mirrored
