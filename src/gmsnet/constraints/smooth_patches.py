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
from gmsnet.constraints.outline import Longs
from gmsnet.constraints.patches import NOTHING, Patches, linked
from gmsnet.kernels.star.surface import CONTROLS
from gmsnet.kernels.whole import jets
from gmsnet.kernels.whole import skin as kernels

Floats = NDArray[np.float64]


class Skin(NamedTuple):
    """The facets over which cubics stand: corner (F, 3, 3), normal (F, 3, 3) there; beside (F, 3), the facet across the
    edge from corner k to k + 1, else NOTHING; facet (N,), one at each node by id, else NOTHING."""

    corner: Floats
    normal: Floats
    beside: Longs
    facet: Longs


def skin_of(patches: Patches, points: Floats, kept: NDArray[np.bool_], normals: Floats | None = None) -> Skin:
    """The facets of the input that are kept (F,). normals: as ``normals_of`` finds them, where they are known."""
    normals = normals_of(patches, points) if normals is None else normals
    fewer = np.where(kept, np.cumsum(kept) - 1, NOTHING)
    facet = np.full(len(points), NOTHING, dtype=np.int64)
    facet[patches.rows[kept]] = fewer[kept, None]
    beside = patches.beside[kept]
    over = np.where(beside == NOTHING, NOTHING, fewer[beside])
    return Skin(points[patches.rows[kept]], normals[kept], over, facet)


def normals_of(patches: Patches, points: Floats) -> Floats:
    """(F, 3, 3) the unit normal of the surface at each corner of each facet.

    At a node, that is the mean of the normals of its facets in the patch, weighted so that it is exact on a sphere
    (Max: Weights for computing vertex normals from facet normals, 1999). At nodes of plane parts it is theirs.
    """
    rows, nodes = patches.rows, len(points)
    owner, numbers = np.empty(rows.shape, dtype=np.int64), np.full(rows.size + nodes, NOTHING, dtype=np.int64)
    count = kernels.number_corners(rows, patches.patch, nodes, numbers, numbers.copy(), owner)  # nodes in each patch
    total = np.zeros((count, 3))
    kernels.add_normals(points[rows], patches.unit, patches.area, owner, total)
    plane, parts = _planes(patches, owner, count)
    total[plane != NOTHING] = parts[plane[plane != NOTHING]]
    length = np.sqrt(dot(total, total))
    unit = np.divide(total, length[:, None], out=np.zeros_like(total), where=length[:, None] > 0.0)
    place = np.zeros((count, 3))
    place[owner] = points[rows]
    start, facets = np.zeros(count + 2, dtype=np.int64), np.empty(rows.size, dtype=np.int32)
    jets.list_facets(owner, start, facets)
    jets.fit_normals(place, owner, start, facets, (plane == NOTHING) & (length > 0.0), unit)
    normals: Floats = unit[owner]
    return normals


def _planes(patches: Patches, owner: Longs, count: int) -> tuple[Longs, Floats]:
    """The plane of each owner that lies in a plane part, else NOTHING; the normals of the parts.

    A part is what facets in one plane make up that have a node all of whose facets are in it: the two triangles of a
    quad are none.
    """
    part = linked(patches.beside, patches.flat)
    normals = summed(part, patches.unit * patches.area[:, None], int(part.max(initial=-1)) + 1)
    low, high = np.full(count, len(part)), np.full(count, NOTHING)
    np.minimum.at(low, owner, part[:, None])
    np.maximum.at(high, owner, part[:, None])
    inner = (low == high)[owner].any(axis=1)  # facets with such a node
    plane = np.full(count, NOTHING, dtype=np.int64)
    plane[owner[inner]] = part[inner, None]
    return plane, normals


def summed(owner: Longs, vectors: Floats, count: int) -> Floats:
    """(count, 3) the sums of vectors (K, 3) by their owners (K,), in their order."""
    return np.stack([np.bincount(owner, vectors[:, axis], count) for axis in range(3)], axis=1)


def controls_of(corner: Floats, normals: Floats) -> Floats:
    """(F, CONTROLS, 3) the inner control points of the cubics (kernels.star.surface) over facets (F, 3, 3)."""
    made = np.empty((len(corner), CONTROLS, 3))
    kernels.write_controls(np.ascontiguousarray(corner), np.ascontiguousarray(normals), made)
    return made


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
