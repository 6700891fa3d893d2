"""Facets so thin that their own normals say nothing of the surface, and what the surface is like beyond them.

A thin facet may turn by any angle though its nodes lie on a smooth surface, and its edges then look sharp. Such an edge
is one of the surface only if it is sharp between what lies beyond the thin facets, too. So a rim stays one where thin
facets lie along it, for beyond them is its own face; and a narrow ledge, which is made of thin facets alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.features import lengths_of
from gmsnet.constraints.outline import Flags, Longs

Floats = NDArray[np.float64]

THIN = 0.1  # of its longest edge is the height of a thin facet
DEPTH = 6  # thin facets beside each other are looked across


def free_edges(
    corner: Floats, unit: Floats, area: Floats, one: Longs, other: Longs, gentle: Flags, alike: Flags, least: float
) -> tuple[Flags, Floats]:
    """(E,) bool, which of the edges that are alike but not gentle turn beyond thin facets by less than the angle of the
    cosine ``least``; and unit normals (F, 3), those of thin facets at such edges being of what is beyond all edges.

    corner: (F, 3, 3) points. unit: (F, 3) normals. area: (F,) twice the area. one, other: (E,) an edge as 3f + k, from
    corner k of facet f on, in either facet. alike: (E,) bool, edges across which the surface is looked at. gentle: (E,)
    bool, those which are not sharp.
    """
    edge = np.stack([lengths_of(corner[:, k - 2] - corner[:, k]) for k in range(3)], axis=1)
    thin = area <= THIN * edge.max(axis=1) ** 2
    across, easy = np.full(3 * len(unit), -1, dtype=np.int64), np.zeros(3 * len(unit), dtype=bool)
    across[one[alike]], across[other[alike]] = other[alike], one[alike]
    easy[one[gentle]] = easy[other[gentle]] = True
    seen = _beyond(unit, edge, thin, across.reshape(-1, 3), easy.reshape(-1, 3)).reshape(-1, 3)
    freed = alike & ~gentle & (thin[one // 3] | thin[other // 3]) & ((seen[one] * seen[other]).sum(axis=1) >= least)
    at = np.zeros(len(unit), dtype=bool)
    at[one[freed] // 3] = at[other[freed] // 3] = True
    return freed, np.where((at & thin)[:, None], _unit(seen.reshape(-1, 3, 3).sum(axis=1)), unit)


def _beyond(unit: Floats, edge: Floats, thin: Flags, across: Longs, gentle: Flags) -> Floats:
    """(F, 3, 3) the unit normal of what each facet is part of, as seen from its edge k.

    Of a facet that is not thin, that is its own; of another one the mean of those beyond its two other edges, by the
    edges' lengths; of gentle ones alone, if it has any. across: (F, 3) the same edge in the facet beyond, or −1.
    """
    seen = np.repeat(np.where(thin[:, None], 0.0, unit)[:, None], 3, axis=1)
    easy = gentle[thin]
    share = edge[thin] * (easy | ~easy.any(axis=1, keepdims=True))
    other = across[thin]
    for _ in range(DEPTH):
        found = np.where((other >= 0)[..., None], seen.reshape(-1, 3)[other], 0.0) * share[..., None]
        seen[thin] = _unit(np.roll(found, -1, axis=1) + np.roll(found, 1, axis=1))
    unknown = ~seen.any(axis=2)
    seen[unknown] = np.repeat(unit[:, None], 3, axis=1)[unknown]
    return seen


def _unit(vectors: Floats) -> Floats:
    """Of length 1, or 0."""
    length = lengths_of(vectors)[..., None]
    unit: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
    return unit
