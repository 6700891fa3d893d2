"""How the faces of a mesh are to be read, and the closed fan of faces around each node that has one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.topology import connectivity, winding
from gmsnet.topology.polygons import Faces, Ints, NearFaces, Offsets, offset_type

Floats = NDArray[np.float64]
Marks = NDArray[np.uint16]
Orientations = NDArray[np.int8]

NO_AREA = 1e-9  # of the sum of its faces' areas: the area of such a part (a closed surface pressed flat) is noise


def closed_fans(
    faces: NearFaces, points: Floats | None, marks: Marks, identity: Ints, hub: int
) -> tuple[Orientations, Offsets, Ints]:
    """The orientation of each face, and in CSR form the rings of the nodes without marks.

    faces: by places in memory. points: (N, 2) in memory order, or None where there is no plane. marks: (N,), to which
    those are added that follow from the faces (kernels.topology.connectivity). identity: (N,) id of each node. hub: as
    in ``walk_fans``. orientation: (F,) int8, −1 where a face has to be read backwards for all of its part to be wound
    alike with positive area. start: (N + 1,). ring: the nodes around, counter-clockwise, from the smallest id on; and
    WIDTH more.
    """
    orientation = _one_orientation(faces, points)
    if orientation is not None:
        start, ring, agrees = _walked(faces, orientation, marks, identity, hub)
        if agrees:
            return orientation, start, ring
        marks &= np.uint16(
            ~(connectivity.NOT_A_DISK | connectivity.HIGH_VALENCE) & 0xFFFF
        )  # as seen with a wrong orientation
    orientation = _orientations(faces, points, marks)
    start, ring, _ = _walked(faces, orientation, marks, identity, hub)
    return orientation, start, ring


def _one_orientation(faces: Faces, points: Floats | None) -> Orientations | None:
    """The orientation of all faces if all have areas of one sign, whatever the parts: so it is with most meshes."""
    count = len(faces)
    if points is None:
        return np.ones(count, dtype=np.int8)
    positive, negative = winding.count_signs(points, faces.first, faces.corner, count)
    if count in (positive, negative):
        return np.full(count, 1 if positive == count else -1, dtype=np.int8)
    return None


def _walked(
    faces: NearFaces, orientation: Orientations, marks: Marks, identity: Ints, hub: int
) -> tuple[Offsets, Ints, bool]:
    """Start and ring as in ``closed_fans``, and whether the faces agree in how they are read."""
    count = len(faces.corner)
    start = np.empty(len(marks) + 1, dtype=offset_type(count))
    ring = np.empty(count + connectivity.WIDTH, dtype=np.int32)
    link, lists = np.zeros(len(marks) + 1, dtype=np.int64), np.zeros(len(marks), dtype=np.int64)
    agrees = connectivity.walk_fans(
        faces.first,
        faces.corner,
        orientation,
        faces.region,
        faces.begin,
        identity,
        hub,
        marks,
        link,
        lists,
        start,
        ring,
    )
    ring[start[-1] : start[-1] + connectivity.WIDTH] = 0
    return start, ring, agrees


def _orientations(faces: Faces, points: Floats | None, marks: Marks) -> Orientations:
    """The orientation of each face, part by part. Marks the nodes of parts without an orientation, or without a
    positive side."""
    first, corner, face = faces.first, faces.corner, faces.face
    kind = offset_type(len(corner))
    twin, by_low, ends = np.empty(len(corner), dtype=kind), np.empty(len(corner), dtype=kind), np.empty_like(corner)
    winding.match(first, corner, len(faces), np.zeros(len(marks) + 2, dtype=kind), by_low, ends, twin)
    del by_low, ends
    part, orientation = np.full(len(faces), -1, dtype=np.int32), np.ones(len(faces), dtype=np.int8)
    consistent = winding.wind(first, corner, face, twin, part, orientation)
    if points is not None and first is not None and not consistent.all():  # a wrong order of corners may be why
        crossed = _crossed(faces, points)
        linked = _without_links(twin, np.repeat(crossed, np.diff(first)))
        part[:], orientation[:] = -1, 1
        consistent = winding.wind(first, corner, face, linked, part, orientation)
    bad = [(~consistent, connectivity.NON_ORIENTABLE)]
    if points is not None:
        area, extent = winding.part_areas(points, first, corner, part, orientation, len(consistent))
        orientation[area[part] < 0] *= -1
        bad.append((np.abs(area) <= NO_AREA * extent, connectivity.ZERO_AREA))
    for parts, mark in bad:
        if parts.any():
            of_corner = np.repeat(parts[part], 3 if first is None else np.diff(first))
            marks[corner[of_corner]] |= np.uint16(mark)
    return orientation


def _crossed(faces: Faces, points: Floats) -> NDArray[np.bool_]:
    """(F,) which faces of a plane are quads whose boundary crosses itself: two corners turn one way, two the other."""
    assert faces.first is not None
    quads = np.flatnonzero(np.diff(faces.first) == 4)
    corners = points[faces.corner[faces.first[quads][:, None] + np.arange(4)], :2]
    forth, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    turn = forth[..., 0] * back[..., 1] - forth[..., 1] * back[..., 0]
    found = np.zeros(len(faces), dtype=bool)
    found[quads] = ((turn > 0.0).sum(axis=1) == 2) & ((turn < 0.0).sum(axis=1) == 2)
    return found


def _without_links(twin: NDArray[Any], cut: NDArray[np.bool_]) -> NDArray[Any]:
    """The partners of half-edges where some are cut off from theirs."""
    found = twin.copy()
    found[cut] = winding.ALONE
    other = twin[cut & (twin >= 0)]
    found[other] = winding.ALONE
    return found
