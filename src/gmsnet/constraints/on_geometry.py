"""What nodes in space slide on where the user has the true shape: facets and pieces through places that it gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.facets import Facets
from gmsnet.constraints.features import dot, lengths_of
from gmsnet.constraints.geometry import Entity, Geometry, checked, named
from gmsnet.constraints.outline import Flags, Longs
from gmsnet.constraints.patches import NOTHING, Patches
from gmsnet.constraints.smooth_patches import Skin
from gmsnet.errors import InputError

Floats = NDArray[np.float64]
PER_EDGE = 2  # edges of the skin, or pieces of a curve, for each edge of the mesh


@dataclass(frozen=True, eq=False)
class OnGeometry:
    """A geometry and the surface whose patches (dimension 2) and curves (dimension 1) it knows by their names.

    exponent: points of the surface are those of the mesh over 2 to the power of it.
    """

    geometry: Geometry
    facets: Facets
    exponent: int

    def skin(self, patches: Patches, points: Floats, kept: Flags) -> Skin:
        """Four facets for each one that is kept (F,): through its corners and the middles of its edges.

        Raises InputError where the places that the geometry gives are on the other side of the mesh's own facets.
        """
        rows, patch = patches.rows[kept], patches.patch[kept]
        vertices, number = np.unique(patch[:, None] * len(points) + rows, return_inverse=True)
        number = number.reshape(-1, 3)
        ends = np.sort(np.stack([number, np.roll(number, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
        edges, middle = np.unique(ends, axis=0, return_inverse=True)
        middle = middle.reshape(-1, 3) + len(vertices)
        at = points[vertices % len(points)]
        places = np.concatenate([at, at[edges].mean(axis=1)])
        a, b, c = number.T
        ab, bc, ca = middle.T
        finer = np.stack(
            [np.column_stack(row) for row in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))], axis=1
        )
        finer = finer.reshape(-1, 3)
        owner = np.zeros(len(places), dtype=np.int64)
        owner[finer] = np.repeat(patch, 4)[:, None]
        normals = np.zeros_like(places)
        for one in np.unique(patch).tolist():
            mine = np.flatnonzero(owner == one)
            longest = lengths_of(at[edges[:, 0]] - at[edges[:, 1]])[owner[len(at) :] == one].max()
            places[mine], normals[mine] = self._asked(one, patches, places[mine], longest)
        unit = np.repeat(patches.unit[kept], 4, axis=0)
        own = np.cross(places[finer[:, 1]] - places[finer[:, 0]], places[finer[:, 2]] - places[finer[:, 0]])
        towards = np.zeros_like(places)
        for k in range(3):
            np.add.at(towards, finer[:, k], own)
        normals *= np.where(dot(normals, towards) < 0.0, -1.0, 1.0)[:, None]
        turned = np.flatnonzero((dot(own, unit) <= 0.0) & unit.any(axis=1))
        if len(turned):
            entity = self._patch(int(np.repeat(patch, 4)[turned[0]]), patches)
            raise InputError(
                f"the places that geometry.project gives for {named(entity)} turn {len(turned):,} pieces of its facets "
                "over: take a geometry that lies nearer to the mesh, or leave this patch out of slide"
            )
        at = np.full(len(points), NOTHING, dtype=np.int64)
        at[rows] = 4 * np.arange(len(rows))[:, None] + np.arange(3)
        facet = np.column_stack([finer, _beside(finer)]).astype(np.int32)
        return Skin(np.column_stack([places, normals]), facet, at)

    def chain(self, patches: Patches, curve: int, p: Floats) -> tuple[Floats, Floats]:
        """Places (2K − 1, 3) for a chain of K points and the middles between, its ends as they are, and tangents."""
        entity = Entity(1, curve, patches.curves.names[curve])
        wanted = np.empty((2 * len(p) - 1, 3))
        wanted[::2], wanted[1::2] = p, 0.5 * (p[1:] + p[:-1])
        places, tangents = self._places(entity, wanted, 1)
        if not patches.curves.closed[curve]:
            places[0], places[-1] = p[0], p[-1]
        ahead = np.diff(places, axis=0)
        along = np.diff(wanted, axis=0)
        around = ahead[:1] if patches.curves.closed[curve] else ahead[-1:]
        backward = dot(np.vstack([ahead, around]), tangents) < 0.0
        tangents = np.where(backward[:, None], -tangents, tangents)
        if (dot(ahead, along) <= 0.0).any() or not lengths_of(tangents).all():
            raise InputError(
                f"the places that geometry.project gives for {named(entity)} do not follow each other as its nodes do: "
                "take a geometry that lies nearer to the mesh, or leave this curve out of slide"
            )
        return places, tangents

    def _patch(self, patch: int, patches: Patches) -> Entity:
        label = int(self.facets.label[np.flatnonzero(patches.patch == patch)[0]])
        return Entity(2, patch, self.facets.names[label])

    def _asked(self, patch: int, patches: Patches, wanted: Floats, most: float) -> tuple[Floats, Floats]:
        """The places on a patch and unit normals there. most: how far they may be from what is wanted."""
        entity = self._patch(patch, patches)
        places, tangents = self._places(entity, wanted, 2)
        far = lengths_of(places - wanted).max()
        if far > most:
            raise InputError(
                f"the places that geometry.project gives for {named(entity)} are up to {far / most:.3g} of its longest "
                "edge away from the mesh: take a geometry that lies nearer to it, or leave this patch out of slide"
            )
        normal = np.cross(tangents[:, 0], tangents[:, 1])
        length = lengths_of(normal)
        if not length.all():
            raise InputError(
                f"the tangents that geometry gives for {named(entity)} span no plane at {places[length == 0.0][0]}: "
                "give two that do (K, 2, 3)"
            )
        return places, normal / length[:, None]

    def _places(self, entity: Entity, wanted: Floats, dimension: int) -> tuple[Floats, Floats]:
        places, parameters = self.geometry.project(entity, np.ldexp(wanted, self.exponent))
        places = np.ldexp(checked(places, wanted.shape, "places", entity), -self.exponent)
        shape = wanted.shape if dimension == 1 else (len(wanted), 2, 3)
        return places, checked(self.geometry.tangent(entity, parameters), shape, "tangents", entity)


def _beside(rows: Longs) -> Longs:
    """(F, 3) the facet across the edge from corner k to k + 1, NOTHING where there is none."""
    ends = np.sort(np.stack([rows, np.roll(rows, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    order = np.lexsort(ends.T)
    same = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
    found = np.full(len(ends), NOTHING, dtype=np.int64)
    one, other = order[same], order[same + 1]
    found[one], found[other] = other // 3, one // 3
    return found.reshape(-1, 3)
