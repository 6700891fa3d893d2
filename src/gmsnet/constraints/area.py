"""By how much the areas that boundaries and interfaces enclose change when their nodes slide, in exact sums."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.outline import NON_MANIFOLD, Flags, Longs, heads, sides, twins
from gmsnet.kernels.simplex.exact import SPLITTER
from gmsnet.kernels.topology import winding
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.polygons import Faces

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Borders:
    """The half-edges around each region, the region on their left.

    tail, head: (S,) node ids. region: (S,) its place in ``regions``. regions: the numbers of the regions, ascending.
    """

    tail: Longs
    head: Longs
    region: Longs
    regions: tuple[int, ...]


def borders_of(mesh: Mesh, points: Floats, bounded_at: Flags | None = None) -> Borders:
    """The borders of the regions of a mesh whose nodes lie at points (N, 2). bounded_at: see ``outline.sides``.

    Faces of a part that can be wound consistently are read so that its area is positive, all others as they are
    written.
    """
    faces = Faces.of(mesh)
    twin, head = twins(faces, len(points)), heads(faces)
    part, turn = np.full(len(faces), -1, dtype=np.int32), np.ones(len(faces), dtype=np.int8)
    consistent = winding.wind(faces.first, faces.corner, faces.face, twin, part, turn)
    turn[~consistent[part]] = 1
    area, _ = winding.part_areas(points, faces.first, faces.corner, part, turn, len(consistent))
    turn[area[part] < 0.0] *= -1
    halves, kinds, _ = sides(faces, twin, bounded_at)
    if not consistent.all() or (kinds == NON_MANIFOLD).any():
        halves = np.arange(len(twin))  # what does not cancel between faces must be added
    face = halves // 3 if faces.face is None else faces.face[halves]
    region = None
    if len(faces.region):
        ids, region = np.unique(faces.region, return_inverse=True)
    else:  # one region, or no face
        blocks = [block.regions[:1] for block in mesh.cells if block.dimension == 2 and len(block.nodes)]
        ids = np.concatenate([*blocks, np.zeros(1, dtype=np.int64)])[:1]
    forth = turn[face] > 0
    tail = np.where(forth, faces.corner[halves], head[halves]).astype(np.int64)
    return Borders(
        tail=tail,
        head=np.where(forth, head[halves], faces.corner[halves]).astype(np.int64),
        region=np.zeros(len(halves), dtype=np.int64) if region is None else region.reshape(-1)[face],
        regions=tuple(ids.tolist()),
    )


def areas(borders: Borders, points: Floats) -> Floats:
    """(regions,) the area of each region with its nodes at points (N, 2): half the sum of x₁y₂ − x₂y₁ over its border.

    The sum is that of the exact products, rounded once, as long as no product under- or overflows.
    """
    p, q = points[borders.tail], points[borders.head]
    terms = np.stack([*_product(p[:, 0], q[:, 1]), *_product(-p[:, 1], q[:, 0])], axis=1)
    order = np.argsort(borders.region, kind="stable")
    ends = np.cumsum(np.bincount(borders.region, minlength=len(borders.regions)))
    return np.array([0.5 * math.fsum(rows.ravel().tolist()) for rows in np.split(terms[order], ends[:-1])])


def area_changes(borders: Borders, before: Floats, after: Floats) -> Floats:
    """(regions,) by what share of it the area of each region changed; 0 for a region without an area."""
    was, now = areas(borders, before), areas(borders, after)
    return np.where(was != 0.0, (now - was) / np.where(was != 0.0, was, 1.0), 0.0)


def _product(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """x·y as floats and what rounding has taken away (Dekker 1971)."""
    p = x * y
    xh = SPLITTER * x - (SPLITTER * x - x)
    yh = SPLITTER * y - (SPLITTER * y - y)
    xl, yl = x - xh, y - yh
    return p, xl * yl - (((p - xh * yh) - xl * yh) - xh * yl)
