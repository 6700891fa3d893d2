"""Normals of faces and points that a mesh or its file holds, computed anew where nodes have moved.

That of a face is its vector area, of length 1. That of a point is the sum of those of its faces, by their angles there:
so it does not depend on how a polygon is cut (Thürmer, Wüthrich, Computing vertex normals from polygonal facets, 1998).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

AXES = ("nx", "ny", "nz")  # how PLY calls the components of a normal
_NAME = re.compile(r"((point|vertex|node|nodal|cell|face|facet|element|surface)s?[ _-]?)?normals?", re.IGNORECASE)

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]


def names_normals(name: str) -> bool:
    """Whether data of this name are normals: ``Normals``, ``point_normals``, …; ``NormalStress`` are none."""
    return _NAME.fullmatch(name) is not None or name in AXES


@dataclass(frozen=True)
class FaceCorners:
    """The corners of all faces of a mesh, one after another in the order of its blocks.

    node: (C,) of each; face: (C,) which of the faces, cell: (C,) which of all cells, each counted from 0.
    """

    node: Ids
    face: Ids
    cell: Ids

    @classmethod
    def of(cls, cells: Sequence[CellBlock]) -> FaceCorners:
        """Those of the faces among cells."""
        node, face, cell = ([np.empty(0, dtype=np.int64)] for _ in range(3))
        faces = before = 0
        for block in cells:
            count = len(block.nodes)
            if block.dimension == 2:
                node.append(block.nodes[:, : block.corners].reshape(-1))
                face.append(np.repeat(np.arange(faces, faces + count), block.corners))
                cell.append(np.repeat(np.arange(before, before + count), block.corners))
                faces += count
            before += count
        return cls(*map(np.concatenate, (node, face, cell)))


def corner_normals(cells: Sequence[CellBlock], points: Floats) -> Floats:
    """(C, 3) at each corner of the faces the unit normal of its face times its angle there; nan where there is none.

    points: (N, 3).
    """
    parts = [np.empty((0, 3))]
    for block in cells:
        if block.dimension != 2:
            continue
        places = points[block.nodes[:, : block.corners]]
        with np.errstate(all="ignore"):  # what is no number stays as it is in the end
            from_first = places - places[:, :1]
            normal = np.cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1)
            normal /= np.linalg.norm(normal, axis=1)[:, None]
            one, other = np.roll(places, -1, axis=1) - places, np.roll(places, 1, axis=1) - places
            angle = np.arctan2(np.linalg.norm(np.cross(one, other), axis=2), np.einsum("ijk,ijk->ij", one, other))
            parts.append((angle[..., None] * normal[:, None]).reshape(-1, 3))
    return np.concatenate(parts)


def renewed(stored: Floats, row: Ids, cells: Sequence[CellBlock], old: Floats, new: Floats) -> Floats:
    """(R, 3) normals as they are once nodes have moved; those of faces whose nodes stay keep their bits.

    stored: (R, 3) as they were. row: (C,) which of them each corner of the faces has, -1 for none. old, new: (N, 3)
    the points before and now. A normal keeps the side of its faces that it was on. One of length 0, which says that
    there is none, stays so, as does one whose faces have no area.
    """
    corners = FaceCorners.of(cells)
    moved = (old != new).any(axis=1)
    faces = np.zeros(int(corners.face.max(initial=-1)) + 1, dtype=bool)
    faces[corners.face[moved[corners.node]]] = True
    known = row >= 0
    touched = np.zeros(len(stored), dtype=bool)
    touched[row[known & faces[corners.face]]] = True
    before, after = (_summed(row[known], corner_normals(cells, points)[known], len(stored)) for points in (old, new))
    with np.errstate(all="ignore"):
        after /= np.linalg.norm(after, axis=1)[:, None]
        after[np.einsum("ij,ij->i", stored, before) < 0.0] *= -1.0
    touched &= np.isfinite(after).all(axis=1) & np.isfinite(stored).all(axis=1) & (stored != 0.0).any(axis=1)
    result = stored.copy()
    result[touched] = after[touched]
    return result


def _summed(row: Ids, vectors: Floats, count: int) -> Floats:
    """(count, 3) the sums of the vectors of each row, those that are no numbers left out."""
    there = np.isfinite(vectors).all(axis=1)
    return np.stack([np.bincount(row[there], vectors[there, k], minlength=count) for k in range(3)], axis=1)


Fields = Mapping[str, NDArray[Any]]
CellFields = Mapping[str, tuple[NDArray[Any], ...]]
PointData = dict[str, NDArray[Any]]
CellData = dict[str, tuple[NDArray[Any], ...]]


def renewed_fields(
    point_data: Fields, cell_data: CellFields,
    cells: Sequence[CellBlock], old: Floats, new: Floats,
) -> tuple[PointData, CellData]:  # fmt: skip
    """The data of points and cells with those that are normals computed anew. old, new: (N, 3)."""
    corners = FaceCorners.of(cells)
    points = dict(point_data) | _renewed(point_data, corners.node, cells, old, new)
    changed = _renewed(whole_of(cell_data), corners.cell, cells, old, new)
    cuts = np.cumsum([len(block.nodes) for block in cells])[:-1]
    faces = dict(cell_data) | {name: tuple(np.split(array, cuts)) for name, array in changed.items()}
    return points, faces


def whole_of(cell_data: CellFields) -> PointData:
    """The data of cells as one array each."""
    return {name: np.concatenate(arrays) for name, arrays in cell_data.items() if arrays}


def _renewed(data: Fields, row: Ids, cells: Sequence[CellBlock], old: Floats, new: Floats) -> dict[str, NDArray[Any]]:
    """Those of the data that are normals, computed anew."""
    found = {}
    for names in normals_among(data):
        stored = np.column_stack([data[name] for name in names]).astype(np.float64)
        fresh = renewed(stored, row, cells, old, new)
        for name, part in zip(names, np.split(fresh, len(names), axis=1), strict=True):
            found[name] = part.reshape(data[name].shape).astype(data[name].dtype)
    return found


def normals_among(data: Fields) -> Iterator[tuple[str, ...]]:
    """The names of data that are normals: of an array (n, 3), or of three arrays (n,) for the three axes."""
    for name, array in data.items():
        if _NAME.fullmatch(name) and np.asarray(array).shape[1:] == (3,) and np.asarray(array).dtype.kind == "f":
            yield (name,)
    if all(axis in data and np.asarray(data[axis]).dtype.kind == "f" for axis in AXES):
        yield AXES


def fields_in(point_data: Fields, cell_data: CellFields) -> list[str]:
    """The normals among the data of points and cells, in words."""
    return [", ".join(names) for data in (point_data, whole_of(cell_data)) for names in normals_among(data)]


def renewed_mesh(mesh: Mesh, points: Floats) -> Mesh:
    """A surface with other points (N, 3), and with normals computed anew: its data, and those in its file.

    Raises FormatError where normals in the file are no numbers.
    """
    moved = mesh.with_points(points)
    point_data, cell_data = renewed_fields(mesh.point_data, mesh.cell_data, mesh.cells, mesh.points, moved.points)
    source = None if mesh.source is None else mesh.source.renewing(point_data, cell_data)
    return replace(moved, point_data=point_data, cell_data=cell_data, source=source)


def normals_in(mesh: Mesh) -> list[str]:
    """The normals of a mesh and its file that ``renewed_mesh`` computes, in words. Errors: see there."""
    fields = fields_in(mesh.point_data, mesh.cell_data)
    found = () if mesh.source is None else mesh.source.renewable
    return list(dict.fromkeys([*fields, *found]))
