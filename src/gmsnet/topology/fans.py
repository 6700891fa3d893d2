"""How the faces of a mesh are to be read, and the closed fan of faces around each node that has one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import connectivity, winding
from gmsnet.topology.polygons import Faces, Ints, NearFaces, Offsets, offset_type

Floats = NDArray[np.float64]
Marks = NDArray[np.uint16]
Turns = NDArray[np.int8]

NO_AREA = 1e-9  # of the sum of its faces' areas: the area of such a part (a closed surface pressed flat) is noise


def closed_fans(
    faces: NearFaces, points: Floats | None, marks: Marks, identity: Ints, hub: int
) -> tuple[Turns, Offsets, Ints]:
    """The turn of each face, and in CSR form the rings of the nodes without marks.

    faces: by places in memory. points: (N, 2) in memory order, or None where there is no plane. marks: (N,), to which
    those are added that follow from the faces (kernels.topology.connectivity). identity: (N,) id of each node. hub: as
    in ``walk_fans``. turn: (F,) int8, −1 where a face has to be read backwards for all of its part to be wound alike
    with positive area. start: (N + 1,). ring: the nodes around, counter-clockwise, from the smallest id on; and WIDTH
    more.
    """
    turn = _one_turn(faces, points)
    if turn is not None:
        start, ring, agrees = _walked(faces, turn, marks, identity, hub)
        if agrees:
            return turn, start, ring
        marks &= np.uint16(~(connectivity.TORN | connectivity.HUB) & 0xFFFF)  # as seen with a wrong turn
    turn = _turns(faces, points, marks)
    start, ring, _ = _walked(faces, turn, marks, identity, hub)
    return turn, start, ring


def _one_turn(faces: Faces, points: Floats | None) -> Turns | None:
    """The turn of all faces if all have areas of one sign, whatever the parts: so it is with most meshes."""
    count = len(faces)
    if points is None:
        return np.ones(count, dtype=np.int8)
    positive, negative = winding.count_signs(points, faces.first, faces.corner, count)
    if count in (positive, negative):
        return np.full(count, 1 if positive == count else -1, dtype=np.int8)
    return None


def _walked(faces: NearFaces, turn: Turns, marks: Marks, identity: Ints, hub: int) -> tuple[Offsets, Ints, bool]:
    """Start and ring as in ``closed_fans``, and whether the faces agree in how they are read."""
    count = len(faces.corner)
    start = np.empty(len(marks) + 1, dtype=offset_type(count))
    ring = np.empty(count + connectivity.WIDTH, dtype=np.int32)
    link, lists = np.zeros(len(marks) + 1, dtype=np.int64), np.zeros(len(marks), dtype=np.int64)
    agrees = connectivity.walk_fans(
        faces.first, faces.corner, turn, faces.region, faces.begin, identity, hub, marks, link, lists, start, ring
    )
    ring[start[-1] : start[-1] + connectivity.WIDTH] = 0
    return start, ring, agrees


def _turns(faces: Faces, points: Floats | None, marks: Marks) -> Turns:
    """The turn of each face, part by part. Marks the nodes of parts without a turn, or without a positive side."""
    first, corner, face = faces.first, faces.corner, faces.face
    kind = offset_type(len(corner))
    twin, by_low, ends = np.empty(len(corner), dtype=kind), np.empty(len(corner), dtype=kind), np.empty_like(corner)
    winding.match(first, corner, len(faces), np.zeros(len(marks) + 2, dtype=kind), by_low, ends, twin)
    del by_low, ends
    part, turn = np.full(len(faces), -1, dtype=np.int32), np.ones(len(faces), dtype=np.int8)
    consistent = winding.wind(first, corner, face, twin, part, turn)
    bad = [(~consistent, connectivity.UNWOUND)]
    if points is not None:
        area, extent = winding.part_areas(points, first, corner, part, turn, len(consistent))
        turn[area[part] < 0] *= -1
        bad.append((np.abs(area) <= NO_AREA * extent, connectivity.SIDELESS))
    for parts, mark in bad:
        if parts.any():
            of_corner = np.repeat(parts[part], 3 if first is None else np.diff(first))
            marks[corner[of_corner]] |= np.uint16(mark)
    return turn
