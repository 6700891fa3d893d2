"""How the cells of a volume mesh are to be read, so that all of a part are read alike and have a positive volume."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import connectivity
from gmsnet.kernels.topology import solids as kernels
from gmsnet.kernels.topology.facets import ALONE
from gmsnet.kernels.topology.solids import FACETS, NONE, Tables
from gmsnet.topology.fans import Marks
from gmsnet.topology.polygons import Ints

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]


def wound(
    points: Floats, near: Ints, kind: NDArray[np.uint8], tables: Tables, twin: Ints, marks: Marks
) -> NDArray[np.int8]:
    """The orientation of each cell; marks the nodes of what cannot be wound, or has no volume."""
    count = len(near)
    piece, orientation = np.full(count, -1, dtype=np.int32), np.ones(count, dtype=np.int8)
    consistent = kernels.wind_solids(near, kind, tables, twin, piece, orientation)
    wrong = np.zeros(count, dtype=bool)
    if not consistent.all():
        wrong = _in_wrong_order(near, kind, tables, twin)
        piece[:], orientation[:] = -1, 1
        consistent = kernels.wind_solids(near, kind, tables, _without_links(twin, wrong), piece, orientation)
    volume, extent = np.zeros((2, count))
    kernels.volumes(points, near, kind, tables, volume, extent)
    parts = len(consistent)
    signed = np.bincount(piece, orientation * volume, parts)
    orientation[signed[piece] < 0.0] *= -1
    for found, mark in (
        (~consistent, connectivity.NON_ORIENTABLE),
        (np.abs(signed) <= 1e-9 * np.bincount(piece, extent, parts), connectivity.ZERO_AREA),
    ):
        marks[near[found[piece]].ravel()] |= np.uint16(mark)
    if wrong.any():  # one by one nothing tells how they are to be read
        orientation[wrong] = 1 if (orientation[~wrong] > 0).sum() >= (orientation[~wrong] < 0).sum() else -1
    return orientation


def _in_wrong_order(near: Ints, kind: NDArray[np.uint8], tables: Tables, twin: Ints) -> Flags:
    """(T,) which cells have their corners in a wrong order.

    Such a cell shares the four nodes of a quadrilateral with another one, but not their order around it. It is the one
    of the two that does so at more of its facets, or both.
    """
    number = np.flatnonzero(twin >= 0)
    nodes, across = (_facet_nodes(near, kind, tables, each) for each in (number, twin[number]))
    at = np.argmax(across == nodes[:, :1], axis=1)
    opposite = np.take_along_axis(across, ((at + 2) % 4)[:, None], axis=1)[:, 0]
    twisted = (nodes[:, 3] >= 0) & (opposite != nodes[:, 2])
    one, other = number[twisted] // FACETS, twin[number[twisted]] // FACETS
    count, wrong = np.bincount(one, minlength=len(near)), np.zeros(len(near), dtype=bool)
    wrong[one[count[one] >= count[other]]] = True
    return wrong


def _without_links(twin: Ints, cut: Flags) -> Ints:
    """The facet across each, but for those between some cells (T,) and others."""
    own = np.arange(len(twin)) // FACETS
    linked = (twin >= 0) & ~cut[own] & ~cut[np.maximum(twin, 0) // FACETS]
    return np.where(linked, twin, np.int32(ALONE))


def _facet_nodes(
    near: Ints, kind: NDArray[np.uint8], tables: Tables, number: NDArray[np.integer[Any]]
) -> NDArray[np.int64]:
    """(n, 4) the nodes of some facets, −1 behind those of triangles."""
    corners = tables.facets[kind[number // FACETS], number % FACETS]
    nodes = near[(number // FACETS)[:, None], np.maximum(corners, 0)]
    return np.where(corners == NONE, -1, nodes)
