"""The mesh as every part of the package sees it: points, cells by type, regions, markers. Frozen; operations copy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.arrays import plain_array
from gmsnet.mesh.cell_block import CellBlock, cells_in_words
from gmsnet.mesh.checks import (
    arrays_per_block,
    cell_blocks,
    finite_points,
    in_words,
    items_of,
    node_set_of,
    region_names_of,
    rows_of,
)
from gmsnet.mesh.display import amount, html_table, listed
from gmsnet.mesh.markers import marker_names
from gmsnet.mesh.plane import exponent_of, extents, flat_axes
from gmsnet.mesh.rounding import Rounding

FEW = 64  # cells by which most meshes show that they are in no plane
SOLIDS = ("hexahedron", "wedge", "pyramid")  # those whose edges are straight


class Source(Protocol):
    """The file that a mesh was read from: it can write itself again with new coordinates and nothing else changed."""

    @property
    def format(self) -> str:
        """Its name in the table of formats."""
        ...

    @property
    def normals(self) -> str:
        """Normals of facets or points in it that no field of the mesh holds, in words; "" for none."""
        ...

    @property
    def renewable(self) -> tuple[str, ...]:
        """Normals in it that ``renewing`` is for, in words. FormatError where they are damaged."""
        ...

    def renewing(self, point_data: dict[str, NDArray[Any]], cell_data: dict[str, tuple[NDArray[Any], ...]]) -> Source:
        """The same with these data, whose ``splice`` computes normals anew. Errors: see ``renewable``."""
        ...

    def images_in(self, mesh: Mesh) -> NDArray[np.int64]:
        """(n,) the nodes of periodic boundaries, if the mesh has the cells of the file: they must go on to match."""
        ...

    def splice(self, points: NDArray[np.float64]) -> Mapping[str, Iterable[bytes | memoryview]]:
        """The files (suffix → pieces) with the coordinates of ``points`` (N×dim) where they differ from the file's."""
        ...


@dataclass(frozen=True, eq=False)
class Mesh:
    """An unstructured mesh.

    points: (N × 2 or N × 3) float64. cells: blocks in file order. region_names: (dimension, region) → name, the
    dimension 1 for markers made of lines, 2 for regions made of faces. point_data: name → (N, …). cell_data: name →
    one array per block. single: the file keeps coordinates in single precision, so results must be exact in float32.
    source: the file it was read from, None if it was made in memory. node_sets: name → node ids, named groups of nodes
    beside those that the cells make (meshio's point sets). rounding: what the file keeps of new coordinates where that
    is less than float64, but not single precision.

    All arrays are read-only and share no memory with anything writable; those that are so already are not copied. So a
    mesh is its own copy. It can be pickled, its file with it.

    Raises InputError where a coordinate is not finite, a cell or a node set names a node that does not exist, data do
    not have one row for each point or cell, or an argument is of the wrong type.
    """

    points: NDArray[np.float64]
    cells: tuple[CellBlock, ...]
    region_names: Mapping[tuple[int, int], str] = field(default_factory=dict)
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, tuple[NDArray[Any], ...]] = field(default_factory=dict)
    single: bool = False
    source: Source | None = field(default=None, repr=False)
    node_sets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    rounding: Rounding | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        points = finite_points(self.points)
        cells = cell_blocks(self.cells)
        if not isinstance(self.single, (bool, np.bool_)):
            raise InputError(f"single must be True or False, got {self.single!r}")
        for block in cells:
            # Seen as unsigned numbers, negative ones are larger than any node.
            if block.nodes.size and block.nodes.view(np.uint64).max() >= len(points):
                wrong = ((block.nodes < 0) | (block.nodes >= len(points))).any(axis=1)
                row = int(np.flatnonzero(wrong)[0])
                raise InputError(
                    f"{block.kind} {row} (counted from 0) names the nodes {block.nodes[row].tolist()}, "
                    f"but the mesh has {in_words(len(points))}"
                )
        counts = [len(block.nodes) for block in cells]
        checked: dict[str, Mapping[Any, Any]] = {
            "region_names": region_names_of(self.region_names),
            "point_data": {
                name: rows_of(values, f"point data {name!r}", len(points))
                for name, values in items_of(self.point_data, "point_data")
            },
            "cell_data": {
                name: arrays_per_block(arrays, f"cell data {name!r}", counts)
                for name, arrays in items_of(self.cell_data, "cell_data")
            },
            "node_sets": {
                name: node_set_of(ids, f"node set {name!r}", len(points))
                for name, ids in items_of(self.node_sets, "node_sets")
            },
        }
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "cells", cells)
        for field_name, value in checked.items():
            object.__setattr__(self, field_name, MappingProxyType(value))

    def __repr__(self) -> str:
        """One line: how many nodes and cells of which kind, and what has a name."""
        return f"<Mesh: {'; '.join(self._in_words())}>"

    def _repr_html_(self) -> str:
        """For a notebook: the same, a line each."""
        nodes, *others = self._in_words()
        return html_table("Mesh", [[nodes], *([line] for line in others)])

    def _in_words(self) -> list[str]:
        names = dict.fromkeys([*self.region_names.values(), *self.node_sets])
        lines = [f"{amount(len(self.points), 'node')} in {self.points.shape[1]}D", *cells_in_words(self.cells)]
        return [*lines, f"named {listed(names)}"] if names else lines

    def __copy__(self) -> Mesh:
        """Itself: nothing can change it."""
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Mesh:
        """Itself: nothing can change it."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the mesh is made, and checked, anew."""
        fields = (
            self.points, self.cells, dict(self.region_names), dict(self.point_data), dict(self.cell_data), self.single,
            self.source, dict(self.node_sets), self.rounding,
        )  # fmt: skip
        return Mesh, fields, None if self.cells else {"plane": self.plane, "has_volumes": self.has_volumes}

    def _twin(self) -> Mesh:
        """Another mesh that shares everything with this one."""
        made = object.__new__(Mesh)
        made.__dict__.update(self.__dict__)
        return made

    def with_points(self, points: NDArray[np.float64]) -> Mesh:
        """The same mesh with other coordinates (same shape as ``points``)."""
        array = plain_array(points, "points")
        if array.shape != self.points.shape:
            raise InputError(f"new points must have the shape {self.points.shape}, got {array.shape}")
        made = self._twin()  # all else has been checked
        if self.cells:  # without any (``without_cells``), it is the plane of those that there were
            made.__dict__.pop("plane", None)
        for name in ("exponent", "exact"):
            made.__dict__.pop(name, None)
        object.__setattr__(made, "points", finite_points(array))
        return made

    def with_one_region(self) -> Mesh:
        """The same mesh, its cells of the highest dimension in one region, 0: no interface lies between them."""
        highest = max((block.dimension or 0 for block in self.cells), default=0)
        cells = tuple(block.in_one_region() if block.dimension == highest else block for block in self.cells)
        made = self._twin()
        object.__setattr__(made, "cells", cells)
        return made

    def without_cells(self) -> Mesh:
        """The points alone, in the same plane: all that is needed of a mesh once its connectivity is known."""
        made = self._twin()
        nothing: dict[str, Any] = {"cells": (), "point_data": {}, "cell_data": {}, "node_sets": {}, "source": None}
        for name, value in nothing.items():
            object.__setattr__(made, name, value)
        made.__dict__["plane"], made.__dict__["has_volumes"] = self.plane, self.has_volumes
        made.__dict__.pop("has_solids", None)
        return made

    @cached_property
    def plane(self) -> tuple[int, int] | None:
        """The two axes in which a planar mesh varies, or None if no coordinate is constant.

        Constant means: up to 1e-9 of the largest extent, over the nodes that cells use.
        """
        if self.points.shape[1] == 2:
            return (0, 1)
        if (self.points[:, 2] == self.points[:1, 2]).all():  # quickly told: so it is in most files
            return (0, 1)
        few = [block.nodes[:FEW].ravel() for block in self.cells]
        if few and (extents(self.points[np.concatenate(few)]) > 1e-8 * extents(self.points).max()).all():
            return None  # quickly told, too: of nearly all others
        used = np.zeros(len(self.points), dtype=bool)
        for block in self.cells:
            used[block.nodes] = True
        if not used.any():
            return (0, 1)
        return flat_axes(extents(self.points[used]))

    @cached_property
    def box(self) -> NDArray[np.float64] | None:
        """None; of a part of a mesh see ``as_part``."""
        return None

    def as_part(
        self, plane: tuple[int, int] | None, kinds: tuple[bool, bool, bool], exponent: int, exact: bool,
        box: NDArray[np.float64] | None,
    ) -> Mesh:  # fmt: skip
        """The same as a part of a mesh with this plane and exponent, exact or not, and of whose nodes these are.

        kinds: see ``kinds_there``. box: (2, D) the least and the greatest coordinates of all its nodes, in the plane if
        there is one, over 2 to the power of the exponent; None of a whole mesh. They are numbered in memory as in the
        whole mesh: nodes that come first come first.
        """
        made = self._twin()
        made.__dict__.update(plane=plane, exponent=exponent, exact=exact, box=box)
        made.__dict__["has_volumes"], made.__dict__["has_quads"], made.__dict__["has_solids"] = kinds
        return made

    def in_frame_of(self, other: Mesh) -> Mesh:
        """The same in the plane and by the exponent of a mesh of the same cells, whose nodes were elsewhere."""
        return self.as_part(other.plane, other.kinds_there, other.exponent, other.exact, other.box)

    @cached_property
    def exact(self) -> bool:
        """Whether coordinates are the same numbers to whoever reads the file.

        Text of single precision is read as float32 by some, and as more by others.
        """
        if not self.single:
            return True
        with np.errstate(over="ignore"):
            return bool((self.points == self.points.astype(np.float32)).all())

    @property
    def kinds_there(self) -> tuple[bool, bool, bool]:
        """Whether it has_volumes, has_quads and has_solids."""
        return self.has_volumes, self.has_quads, self.has_solids

    @cached_property
    def has_volumes(self) -> bool:
        """Whether cells fill space; faces, lines and vertices are then marks on them."""
        return any(block.dimension == 3 and len(block.nodes) for block in self.cells)

    @cached_property
    def has_quads(self) -> bool:
        """Whether some faces have four corners."""
        return any(block.dimension == 2 and block.corners == 4 and len(block.nodes) for block in self.cells)

    @cached_property
    def has_solids(self) -> bool:
        """Whether some cells are hexahedra, wedges or pyramids with straight edges."""
        return any(block.kind in SOLIDS and len(block.nodes) for block in self.cells)

    @cached_property
    def exponent(self) -> int:
        """See ``exponent_of``."""
        return exponent_of(self.points, self.plane, self.single)

    @property
    def markers(self) -> dict[str, NDArray[np.int64]]:
        """Name of each marker, region and node set → its node ids.

        A marker of lines or vertices without a name goes by its number; regions of faces and volumes need a name. Cells
        in several groups, a region "a + b", are in "a" and in "b" as well.
        """
        nodes: dict[str, list[NDArray[np.int64]]] = {name: [ids] for name, ids in self.node_sets.items()}
        for block in self.cells:
            for region in np.unique(block.regions).tolist():
                for name in marker_names(self.region_names, block.dimension, region):
                    nodes.setdefault(name, []).append(block.nodes[block.regions == region].ravel())
        return {name: sorted_unique(np.concatenate(ids)) for name, ids in nodes.items()}
