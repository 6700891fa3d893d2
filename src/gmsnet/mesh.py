"""The mesh as every part of the package sees it: points, cells by type, regions, markers. Frozen; operations copy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError

DIMENSION = {  # of the cell types that are known by name (meshio's names); all others count as volumes
    "vertex": 0,
    **dict.fromkeys(("line", "line3", "line4"), 1),
    **dict.fromkeys(("triangle", "triangle6", "triangle7", "triangle10"), 2),
    **dict.fromkeys(("quad", "quad8", "quad9", "polygon"), 2),
}
CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "triangle10": 3, "quad": 4, "quad8": 4, "quad9": 4}
NODES = {"vertex": 1, "line": 2, "line3": 3, "line4": 4, "triangle": 3, "triangle6": 6, "triangle7": 7,
         "triangle10": 10, "quad": 4, "quad8": 8, "quad9": 9, "tetra": 4, "tetra10": 10, "hexahedron": 8,
         "hexahedron20": 20, "wedge": 6, "pyramid": 5}  # fmt: skip


class Source(Protocol):
    """The file that a mesh was read from: it can write itself again with new coordinates and nothing else changed."""

    @property
    def format(self) -> str:
        """Its name in the table of formats."""
        ...

    def splice(self, points: NDArray[np.float64]) -> Mapping[str, bytes]:
        """The files (suffix → bytes) with the coordinates of ``points`` (N×dim) where they differ from the file's."""
        ...


@dataclass(frozen=True, eq=False)
class CellBlock:
    """Cells of one type.

    kind: meshio's name of the type ("triangle", "line", "vertex", "quad", "triangle6", …; "polygon" for five nodes
    or more). nodes: (cells × nodes per cell), indices into the points. regions: (cells,) the region of each cell;
    for lines and vertices this is the marker that they belong to.
    """

    kind: str
    nodes: NDArray[np.int64]
    regions: NDArray[np.int64]

    def __post_init__(self) -> None:
        nodes = np.array(self.nodes, dtype=np.int64, copy=True)
        regions = np.array(self.regions, dtype=np.int64, copy=True)
        if nodes.ndim != 2:
            raise InputError(f"cells of type {self.kind!r} must be an array (cells × nodes), got shape {nodes.shape}")
        if nodes.shape[1] != NODES.get(self.kind, nodes.shape[1]):
            raise InputError(f"a cell of type {self.kind!r} has {NODES[self.kind]} nodes, got {nodes.shape[1]}")
        if regions.shape != (len(nodes),):
            raise InputError(f"{len(nodes)} {self.kind} cells need one region each, got shape {regions.shape}")
        object.__setattr__(self, "nodes", _read_only(nodes))
        object.__setattr__(self, "regions", _read_only(regions))

    @property
    def dimension(self) -> int:
        """0 for vertices, 1 for lines, 2 for faces, 3 for volumes."""
        return DIMENSION.get(self.kind, 3)


@dataclass(frozen=True, eq=False)
class Mesh:
    """An unstructured mesh.

    points: (N × 2 or N × 3) float64. cells: blocks in file order. region_names: (dimension, region) → name, the
    dimension 1 for markers made of lines, 2 for regions made of faces. point_data: name → (N, …). cell_data: name →
    one array per block. single: the file keeps coordinates in single precision, so results must be exact in float32.
    source: the file it was read from, None if it was made in memory. node_sets: name → node ids, named groups of nodes
    beside those that the cells make (meshio's point sets).

    Raises InputError where a coordinate is not finite or a cell names a node that does not exist.
    """

    points: NDArray[np.float64]
    cells: tuple[CellBlock, ...]
    region_names: Mapping[tuple[int, int], str] = field(default_factory=dict)
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, tuple[NDArray[Any], ...]] = field(default_factory=dict)
    single: bool = False
    source: Source | None = None
    node_sets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64, order="C", copy=True)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise InputError(f"points must be an array of N×2 or N×3 numbers, got shape {points.shape}")
        finite = np.isfinite(points).all(axis=1)
        if not finite.all():
            bad = int(np.flatnonzero(~finite)[0])
            raise InputError(f"node {bad} (counted from 0) has a coordinate that is not finite: {points[bad].tolist()}")
        cells = tuple(self.cells)
        for block in cells:
            if block.nodes.size and (block.nodes.min() < 0 or block.nodes.max() >= len(points)):
                wrong = ((block.nodes < 0) | (block.nodes >= len(points))).any(axis=1)
                row = int(np.flatnonzero(wrong)[0])
                raise InputError(
                    f"{block.kind} {row} (counted from 0) names the nodes {block.nodes[row].tolist()}, "
                    f"but the mesh has the nodes 0 to {len(points) - 1}"
                )
        for name, values in self.point_data.items():
            if len(values) != len(points):
                raise InputError(f"point data {name!r} has {len(values)} rows for {len(points)} points")
        for name, arrays in self.cell_data.items():
            if [len(a) for a in arrays] != [len(b.nodes) for b in cells]:
                raise InputError(f"cell data {name!r} does not have one row for each cell of each block")
        object.__setattr__(self, "points", _read_only(points))
        object.__setattr__(self, "cells", cells)
        for name in ("region_names", "point_data", "cell_data", "node_sets"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def with_points(self, points: NDArray[np.float64]) -> Mesh:
        """The same mesh with other coordinates (same shape as ``points``)."""
        if np.shape(points) != self.points.shape:
            raise InputError(f"new points must have the shape {self.points.shape}, got {np.shape(points)}")
        return replace(self, points=points)

    @cached_property
    def plane(self) -> tuple[int, int] | None:
        """The two axes in which a planar mesh varies, or None if no coordinate is constant.

        Constant means: up to 1e-9 of the largest extent, over the nodes that cells use.
        """
        if self.points.shape[1] == 2:
            return (0, 1)
        used = np.zeros(len(self.points), dtype=bool)
        for block in self.cells:
            used[block.nodes] = True
        if not used.any():
            return (0, 1)
        extent = np.ptp(self.points[used], axis=0)
        for flat in (2, 1, 0):
            if extent[flat] <= 1e-9 * extent.max():
                return {2: (0, 1), 1: (0, 2), 0: (1, 2)}[flat]
        return None

    @property
    def markers(self) -> dict[str, NDArray[np.int64]]:
        """Name of each marker, region and node set → its node ids. One without a name goes by its number."""
        nodes: dict[str, list[NDArray[np.int64]]] = {name: [ids] for name, ids in self.node_sets.items()}
        for block in self.cells:
            for region in np.unique(block.regions).tolist():
                name = self.region_names.get((block.dimension, region), str(region))
                nodes.setdefault(name, []).append(block.nodes[block.regions == region].ravel())
        return {name: np.unique(np.concatenate(ids)) for name, ids in nodes.items()}


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array
