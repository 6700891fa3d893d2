"""Volumes by their facets: which of them meet at a corner, and how their centres make a cell regular."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.kind import CellKind, Nodes

Floats = NDArray[np.float64]


@cache
def facets_around(kind: CellKind) -> tuple[Nodes, ...]:
    """Of each corner the facets at it, in order, counter-clockwise as seen from outside."""
    return tuple(_facets_at(kind, corner) for corner in range(kind.corners or 0))


def _facets_at(kind: CellKind, corner: int) -> Nodes:
    after = {}  # by the next corner of a facet: the one before, where the next facet begins, and the facet
    for number, facet in enumerate(kind.facets):
        if corner in facet:
            place = facet.index(corner)
            after[facet[(place + 1) % len(facet)]] = facet[place - 1], number
    here, found = next(iter(after)), []
    for _ in after:
        here, number = after[here]
        found.append(number)
    return tuple(found)


def ideal_corners(kind: CellKind) -> Floats:
    """(corners, 3) of an ideal cell, from its first corner on."""
    spokes = np.linalg.inv(np.array(kind.ideal[0]))
    first, one, two, up = kind.simplices[0]
    places = np.zeros((kind.corners or 0, 3))
    known = {first}
    for column, node in enumerate((one, two, up)):
        places[node] = spokes[:, column]
        known.add(node)
    while len(known) < len(places):  # facets are parallelograms
        for facet in kind.facets:
            missing = [k for k, node in enumerate(facet) if node not in known]
            if len(facet) == 4 and len(missing) == 1:
                k = missing[0]
                places[facet[k]] = places[facet[k - 1]] + places[facet[(k + 1) % 4]] - places[facet[k - 2]]
                known.add(facet[k])
    return places


def dual_places(kind: CellKind, corners: Floats) -> tuple[Floats, Floats]:
    """(corners, 3) the mean c of the centres of the facets at each corner, and n/√|n|.

    n is the area vector of the polygon between these centres. It points outward where the cell is valid.
    """
    centres = np.array([corners[list(facet)].mean(axis=0) for facet in kind.facets])
    means, normals = np.empty_like(corners), np.empty_like(corners)
    for corner, facets in enumerate(facets_around(kind)):
        around = centres[list(facets)]
        means[corner] = around.mean(axis=0)
        area = 0.5 * np.cross(around, np.roll(around, -1, axis=0)).sum(axis=0)
        normals[corner] = area / np.sqrt(np.linalg.norm(area))
    return means, normals


@cache
def regularising(kind: CellKind, free: float) -> float:
    """σ such that the ideal cell keeps its shape where its corners go to c + σ·n/√|n|.

    free: what it is where the ideal cell keeps its shape with any σ.
    """
    corners = ideal_corners(kind)
    means, normals = (each - each.mean(axis=0) for each in dual_places(kind, corners))
    corners = corners - corners.mean(axis=0)
    unknown = np.column_stack([normals.ravel(), -corners.ravel()])
    (sigma, _), _, rank, _ = np.linalg.lstsq(unknown, -means.ravel(), rcond=1e-9)
    return round(float(sigma), 14) if rank == 2 else free  # the last bits depend on which processor LAPACK runs on
