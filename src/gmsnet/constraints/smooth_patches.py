"""What a surface through the nodes of facets looks like between them: normals at the nodes, and cubics over them.

Over each facet of a patch stands a cubic Bézier triangle (Vlachos, Peters, Boyd, Mitchell: Curved PN triangles, 2001).
The handles of an edge are those of a circular arc: 2/(3(1 + cos α)) of its length, α the angle between the edge and
the tangent. Where all nodes of a facet have the normal of one plane, the cubic lies in that plane.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.features import dot
from gmsnet.constraints.outline import Flags, Longs
from gmsnet.constraints.patches import NOTHING, Patches, linked
from gmsnet.kernels.whole import facets, jet_lanes, jets
from gmsnet.kernels.whole import skin as kernels
from gmsnet.topology.polygons import Ints

Floats = NDArray[np.float64]


class Vertices(NamedTuple):
    """The nodes of facets, those of several patches one by one in each. own: (F, 3) int32, the vertex at each corner.
    table: (V, 6) points and the unit normals of the surface there."""

    own: Ints
    table: Floats

    @property
    def normals(self) -> Floats:
        """(F, 3, 3) the unit normal at each corner of each facet."""
        return self.table[self.own, 3:]


class Skin(NamedTuple):
    """The facets over which cubics stand: vertex (V, 6), facet (F, 6) int32 (kernels.star.surface.Surface); at (N,),
    one facet at each node by id, else NOTHING."""

    vertex: Floats
    facet: Ints
    at: Longs


def skin_of(patches: Patches, points: Floats, kept: Flags, vertices: Vertices | None = None) -> Skin:
    """The facets of the input that are kept (F,). vertices: as ``vertices_of`` finds them, where they are known."""
    vertices = vertices_of(patches, points) if vertices is None else vertices
    at = np.full(len(points), NOTHING, dtype=np.int64)
    if kept.all():
        at[patches.rows] = np.arange(len(kept))[:, None]
        return Skin(vertices.table, np.column_stack([vertices.own, patches.beside.astype(np.int32)]), at)
    fewer = np.where(kept, np.cumsum(kept) - 1, NOTHING)
    at[patches.rows[kept]] = fewer[kept, None]
    beside = patches.beside[kept]
    over = np.where(beside == NOTHING, NOTHING, fewer[beside])
    return Skin(vertices.table, np.column_stack([vertices.own[kept], over.astype(np.int32)]), at)


def vertices_of(patches: Patches, points: Floats) -> Vertices:
    """The nodes of facets with the normals of the surface there.

    At a node, that is the mean of the normals of its facets in the patch, weighted so that it is exact on a sphere
    (Max: Weights for computing vertex normals from facet normals, 1999), and then that of a cubic through two rings
    (kernels.whole.jets). At nodes of plane parts it is theirs. A tip is a vertex of each of its facets, with the normal
    of that facet, and no cubic is fitted at the nodes next to it.
    """
    rows, nodes = patches.rows, len(points)
    owner, numbers = np.empty(rows.shape, dtype=np.int32), np.full(rows.size + nodes, NOTHING, dtype=np.int64)
    count = kernels.number_corners(rows, patches.patch, nodes, numbers, numbers.copy(), owner)  # nodes in each patch
    total = np.zeros((count, 3))
    kernels.add_normals(points, rows, patches.unit, patches.area, owner, total)
    plane, parts = _planes(patches, owner, count)
    total[plane != NOTHING] = parts[plane[plane != NOTHING]]
    length = np.sqrt(dot(total, total))
    unit = np.divide(total, length[:, None], out=np.zeros_like(total), where=length[:, None] > 0.0)
    table = np.zeros((count, 6))
    table[:nodes, :3] = points
    more = owner >= nodes
    table[owner[more], :3] = points[rows[more]]
    chosen = (plane == NOTHING) & (length > 0.0)
    facet, corner = np.nonzero(patches.tips[rows]) if patches.tips.any() else np.empty((2, 0), dtype=np.int64)
    chosen[owner[facet]] = False
    fit_normals(table, owner, chosen, unit)
    table[:, 3:] = unit
    if len(facet):
        owner[facet, corner] = count + np.arange(len(facet))
        table = np.vstack([table, np.hstack([points[rows[facet, corner]], patches.unit[facet]])])
    return Vertices(owner, table)


def fit_normals(place: Floats, own: Ints, chosen: Flags, normal: Floats) -> None:
    """Makes the unit normals (V, 3) of chosen vertices anew: kernels.whole.jets. place: (V, 3 or more). own: (F, 3)."""
    count = len(normal)
    start, at = np.zeros(count + 2, dtype=np.int64), np.empty(own.size, dtype=np.int32)
    jets.list_facets(own, start, at)
    first, around = np.empty(count + 1, dtype=np.int64), np.empty(2 * own.size, dtype=np.int32)
    jet_lanes.list_neighbours(own, start, at, first, around)
    before, wanted = normal.copy(), np.flatnonzero(chosen)
    few = np.zeros(count, dtype=bool)
    for _ in range(2):
        again, left = np.empty_like(wanted), np.empty_like(wanted)
        more, fewer = jet_lanes.fit_in_lanes(place, first, around, wanted, before, normal, again, left)
        few[left[:fewer]] = True
        wanted = again[:more]
    normal[few] = before[few]
    jets.fit_normals(place, own, start, at, few, normal)


def _planes(patches: Patches, owner: Ints, count: int) -> tuple[Longs, Floats]:
    """The plane of each owner that lies in a plane part, else NOTHING; the normals of the parts.

    A part is what facets in one plane make up that have a node all of whose facets are in it: the two triangles of a
    quad are none.
    """
    part = linked(patches.beside, patches.flat)
    normals = summed(part, patches.unit * patches.area[:, None], int(part.max(initial=-1)) + 1)
    plane = np.full(count, NOTHING, dtype=np.int64)
    facets.find_planes(owner, part, np.empty_like(plane), np.empty_like(plane), plane)
    return plane, normals


def summed(owner: Longs, vectors: Floats, count: int) -> Floats:
    """(count, 3) the sums of vectors (K, 3) by their owners (K,), in their order."""
    return np.stack([np.bincount(owner, vectors[:, axis], count) for axis in range(3)], axis=1)


def across(edge: Floats, normal: Floats) -> Floats:
    """The part of edges (K, 3) that is tangent to surfaces with these unit normals."""
    tangent: Floats = edge - dot(edge, normal)[:, None] * normal
    return tangent


def handles(edge: Floats, tangent: Floats) -> Floats:
    """The handles of cubics over edges (K, 3) along tangents of any length: those of an arc where it is one."""
    length, size = np.sqrt(dot(edge, edge)), np.sqrt(dot(tangent, tangent))
    unit = np.divide(tangent, size[:, None], out=np.zeros_like(tangent), where=size[:, None] > 0.0)
    cosine = np.divide(dot(unit, edge), length, out=np.ones(len(edge)), where=length > 0.0)
    reach = 2.0 * length / (3.0 * (1.0 + np.maximum(cosine, 0.0)))
    return unit * reach[:, None]
