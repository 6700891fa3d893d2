"""The mesh of a live model: read through Gmsh's functions, with what each node lies on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.io.gmsh_sections import KINDS
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Ints = NDArray[np.int64]
TITLES = ("point", "curve", "surface", "volume")
TAGS = "gmsh:node"  # the point data with Gmsh's tags


class Part(NamedTuple):
    """The nodes of one entity, without those of its boundary: rows ``first`` to ``last`` of the mesh.

    on: the dimension of the shape that they lie on, which of interfaces between partitions is that of their parent.
    discrete: there is no geometry, only the mesh itself.
    """

    dimension: int
    tag: int
    on: int
    discrete: bool
    first: int
    last: int


@dataclass(frozen=True, eq=False)
class Live:
    """mesh: rows in the order of ``parts``, Gmsh's tags of the nodes as point data. tags: (N,) the same. dimension: 2
    or 3, of the cells to smooth."""

    mesh: Mesh
    tags: Ints
    parts: list[Part]
    dimension: int

    @property
    def planar(self) -> bool:
        """Whether the cells to smooth are those of a mesh in a plane along two axes."""
        return self.dimension == 2 and self.mesh.plane is not None

    @property
    def curved(self) -> bool:
        """Whether the cells to smooth are those of a surface in space, inside of which nodes leave the CAD."""
        return self.dimension == 2 and self.mesh.plane is None

    def below(self, dimension: int) -> NDArray[np.bool_]:
        """(N,) the nodes that lie on shapes of lower dimension: points, and curves, and surfaces."""
        return np.concatenate(
            [np.zeros(0, dtype=bool), *(np.full(p.last - p.first, p.on < dimension) for p in self.parts)]
        )

    def rows(self, tags: Any) -> Ints:
        """The rows of nodes by their tags. Raises InputError for a tag that no node has."""
        return _rows(self.tags, np.asarray(tags, dtype=np.int64).ravel())


def read(gmsh: Any, dim: int | None) -> Live:
    """The mesh of the current model. dim: the dimension of the cells to smooth, None: the highest that there is.

    Cells of an entity are a region of their own, named "curve 3", "surface 1" or "volume 1"; physical groups with a
    name are sets of nodes. Interfaces between partitions are no cells. Raises InputError where there are no cells of
    the dimension, and for surfaces alone of a model that has volume elements.
    """
    entities = gmsh.model.getEntities()
    parts, tags, points = _nodes(gmsh, entities)
    cells, names = _cells(gmsh, parts, tags)
    highest = max((block.dimension or 0 for block in cells), default=0)
    if highest < 2:
        raise InputError("the model has no surface or volume elements: call gmsh.model.mesh.generate(2) or (3) first")
    if dim is not None and dim != highest:
        raise InputError(
            f"dim must be {highest}, the dimension of the model's elements, or None, got {dim!r}: nodes of "
            "surfaces cannot move alone where volume elements hang on them"
        )
    mesh = Mesh(points, tuple(cells), region_names=names, point_data={TAGS: tags}, node_sets=_groups(gmsh, tags, names))
    return Live(mesh, tags, parts, highest)


def _nodes(gmsh: Any, entities: Any) -> tuple[list[Part], Ints, NDArray[np.float64]]:
    parts: list[Part] = []
    tags, points, at = [np.zeros(0, dtype=np.int64)], [np.zeros(0)], 0
    for dimension, tag in entities:
        found, coordinates, _ = gmsh.model.mesh.getNodes(dimension, tag, False, False)
        parent, _ = gmsh.model.getParent(dimension, tag)
        kind = gmsh.model.getType(dimension, tag)
        discrete = kind.startswith(("Discrete", "Partition", "Ghost"))
        parts.append(Part(dimension, tag, max(dimension, parent), discrete, at, at + len(found)))
        tags.append(np.asarray(found).astype(np.int64))
        points.append(np.asarray(coordinates, dtype=np.float64))
        at += len(found)
    return parts, np.concatenate(tags), np.concatenate(points).reshape(-1, 3)


def _cells(gmsh: Any, parts: list[Part], tags: Ints) -> tuple[list[CellBlock], dict[tuple[int, int], str]]:
    cells: list[CellBlock] = []
    names: dict[tuple[int, int], str] = {}
    for part in parts:
        if part.on > part.dimension:
            continue
        parent, region = gmsh.model.getParent(part.dimension, part.tag)
        region = part.tag if parent < 0 else region
        types, elements, nodes = gmsh.model.mesh.getElements(part.dimension, part.tag)
        for code, ids, flat in zip(types, elements, nodes, strict=True):
            table = _rows(tags, np.asarray(flat).astype(np.int64)).reshape(len(ids), -1)
            kind = KINDS.get(int(code))
            if kind is not None and kind.order is not None:
                table = table[:, list(kind.order)]
            name = kind.name if kind is not None else f"Gmsh type {code}"
            cells.append(CellBlock(name, table, np.full(len(ids), region)))
            names[part.dimension, int(region)] = f"{TITLES[part.dimension]} {region}"
    return cells, names


def _groups(gmsh: Any, tags: Ints, taken: Mapping[tuple[int, int], str]) -> dict[str, Ints]:
    """Name of a physical group → the rows of its nodes. Groups of one name, of two dimensions, are one set."""
    found: dict[str, list[Ints]] = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag)
        if name and name not in taken.values():
            nodes, _ = gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)
            found.setdefault(name, []).append(_rows(tags, np.asarray(nodes).astype(np.int64)))
    return {name: sorted_unique(np.concatenate(rows)) for name, rows in found.items()}


def _rows(tags: Ints, wanted: Ints) -> Ints:
    order = np.argsort(tags)
    place = np.searchsorted(tags[order], wanted)
    place[place == len(tags)] = 0
    if len(wanted) and (not len(tags) or (tags[order[place]] != wanted).any()):
        wrong = wanted[tags[order[place]] != wanted] if len(tags) else wanted
        raise InputError(f"the model has no node with the tag {wrong[0]}")
    return order[place] if len(wanted) else wanted
