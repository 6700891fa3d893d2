"""Arrays, meshio, meshlane and PyVista objects as a Mesh, and back: the type that came in goes out.

Types are told by the names of their modules, so none of the libraries is imported here.
"""

from __future__ import annotations

import copy
import difflib
import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.cells.table import CELLS, face_name
from gmsnet.errors import InputError
from gmsnet.mesh.arrays import coordinates, plain_array, whole_numbers
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.region_fields import combined, names_a_region
from gmsnet.mesh.vtk_types import PIXEL, POLYLINE, POLYVERTEX, STRIP, VTK_KINDS, VTK_ORDERS

Restore = Callable[[NDArray[np.float64]], Any]

NOWHERE = np.zeros((), dtype=np.int64)  # the region of cells without any, once for all of them
NOWHERE.flags.writeable = False
UNKNOWN = -1  # the dimension of cells of a kind that is not known
VTK_CHAINS = {POLYVERTEX: ("vertex", 1), POLYLINE: ("line", 2)}  # of any number of nodes, taken as their pieces

# meshio's names of cells, those of higher order ("tetra35") included: their nodes are held.
FAMILIES = "|".join(kind.name for kind in CELLS.values() if kind.order == 1 and kind.dimension)
KIND = re.compile(rf"vertex|({FAMILIES})\d*|VTK_LAGRANGE_[A-Z]+")


def to_mesh(thing: Any) -> tuple[Mesh, Restore]:
    """A mesh in whatever form it came, and the way back.

    thing: ``(points, cells)`` arrays, with the cells an M×3 array of triangles, a mapping of kind → array or a list of
    (kind, array) pairs; a Mesh; a ``Mesh`` of meshio or meshlane; an ``UnstructuredGrid`` or ``PolyData`` of PyVista.
    Points in single precision give a Mesh with ``single`` set.

    restore(points): points (N×dim, float64) → the type that came in, with these coordinates and all else equal. The
    thing itself is never changed. Points come back as float64, or as float32 where they were float32.

    Raises InputError where the thing is none of these, or its arrays do not describe a mesh.
    """
    if isinstance(thing, Mesh):
        return thing, thing.with_points
    names = {(base.__module__.partition(".")[0], base.__name__) for base in type(thing).__mro__}
    if names & {("meshio", "Mesh"), ("meshlane", "Mesh")}:
        return _from_meshio(thing)
    if names & {("pyvista", "UnstructuredGrid"), ("pyvista", "PolyData")}:
        return _from_pyvista(thing)
    if isinstance(thing, (tuple, list)) and len(thing) == 2:
        return _from_arrays(thing)
    libraries = {library for library, _ in names}
    if "pyvista" in libraries:
        mend = "call its .cast_to_unstructured_grid() first (or .combine(), where it holds several blocks)"
    elif "vtkmodules" in libraries:
        mend = "wrap it with pyvista.wrap() first"
    elif isinstance(thing, str) or hasattr(thing, "__fspath__"):
        mend = "read the file first, with gmsnet.io.read()"
    else:
        mend = "give (points, cells) arrays, or a mesh of gmsnet, meshio, meshlane or PyVista"
    raise InputError(f"{type(thing).__module__}.{type(thing).__qualname__} is not a mesh that gmsnet knows: {mend}")


def _from_arrays(thing: Any) -> tuple[Mesh, Restore]:
    points, given = thing
    blocks = [_face(_known(kind), _indices(nodes, kind)) for kind, nodes in _pairs(given)]
    mesh, back = _mesh(points, blocks), _back(points)
    same = list if isinstance(thing, list) else tuple
    return mesh, lambda new: same((back(new), given))


def _from_meshio(thing: Any) -> tuple[Mesh, Restore]:
    blocks: list[tuple[str, NDArray[np.int64]]] = []
    for block in thing.cells:
        blocks += _even(block.type, block.data)
    cell_data = {
        name: np.concatenate([np.asarray(array) for array in arrays])
        for name, arrays in thing.cell_data.items()
        if arrays and not any(array is None for array in arrays)
    }
    names = {
        name: (int(np.ravel(value)[1]), int(np.ravel(value)[0]))  # meshio keeps (tag, dimension)
        for name, value in (thing.field_data or {}).items()
        if np.size(value) == 2 and np.asarray(value).dtype.kind in "iu"
    }
    start = np.cumsum([0, *(len(block.data) for block in thing.cells)])
    sets = {
        name: np.concatenate(
            [
                _members(ids, len(block.data), name) + at
                for ids, block, at in zip(per_block, thing.cells, start, strict=False)
            ]
            or [np.zeros(0, dtype=np.int64)]
        )
        for name, per_block in (thing.cell_sets or {}).items()
        if not name.startswith("gmsh:")  # meshio keeps other things of Gmsh under such names
    }
    node_sets = {name: _members(ids, len(thing.points), name) for name, ids in (thing.point_sets or {}).items()}
    mesh = _mesh(thing.points, blocks, cell_data, thing.point_data, names, sets, node_sets)
    return mesh, _refill(lambda: copy.deepcopy(thing), thing.points)


def _from_pyvista(thing: Any) -> tuple[Mesh, Restore]:
    # A PolyData as a grid has its cells in the same order: vertices, lines, faces, strips.
    grid = thing if hasattr(thing, "celltypes") else thing.cast_to_unstructured_grid()
    types = np.asarray(grid.celltypes)
    # Older releases of PyVista call the same array "offset".
    offsets = np.asarray(grid.cell_offsets if hasattr(type(grid), "cell_offsets") else grid.offset)
    sizes = np.diff(offsets)
    connectivity = np.asarray(grid.cell_connectivity, dtype=np.int64)
    change = (np.diff(types) != 0) | (np.diff(sizes) != 0)
    ends = [*(np.flatnonzero(change) + 1).tolist(), len(types)] if len(types) else []
    blocks: list[tuple[str, NDArray[np.int64]]] = []
    source: list[NDArray[np.int64]] = []  # the cell of the grid that each cell of the mesh came from
    start = 0
    for end in ends:
        code, size = int(types[start]), int(sizes[start])
        nodes = connectivity[offsets[start] : offsets[end]].reshape(end - start, size)
        cells = np.arange(start, end)
        if code in VTK_CHAINS:
            kind, width = VTK_CHAINS[code]
            nodes = np.lib.stride_tricks.sliding_window_view(nodes, width, axis=1).reshape(-1, width)
            cells = np.repeat(cells, size - width + 1)
        elif code == STRIP:
            raise InputError(f"cell {start} (counted from 0) is a triangle strip: call .triangulate() first")
        else:
            kind = VTK_KINDS.get(code, f"VTK type {code}")
            if code in VTK_ORDERS:
                nodes = nodes[:, VTK_ORDERS[code]]
        blocks.append(_face(kind, nodes))
        source.append(cells)
        start = end
    taken = np.concatenate(source) if source else np.zeros(0, dtype=np.int64)
    cell_data = {name: np.asarray(values)[taken] for name, values in thing.cell_data.items()}
    point_data = {name: np.asarray(values) for name, values in thing.point_data.items()}
    points = np.asarray(thing.points)
    return _mesh(points, blocks, cell_data, point_data), _refill(lambda: thing.copy(deep=True), points)


def _mesh(
    points: ArrayLike,
    blocks: Sequence[tuple[str, NDArray[np.int64]]],
    cell_data: Mapping[str, NDArray[Any]] | None = None,
    point_data: Mapping[str, NDArray[Any]] | None = None,
    names: Mapping[str, tuple[int, int]] | None = None,
    cell_sets: Mapping[str, NDArray[np.int64]] | None = None,
    node_sets: Mapping[str, NDArray[np.int64]] | None = None,
) -> Mesh:
    """cell_data: one array over all cells. names: name → (dimension, tag of gmsh:physical). cell_sets: name → cells."""
    array = coordinates(points)
    cell_data, node_sets = cell_data or {}, dict(node_sets or {})
    counts = [len(nodes) for _, nodes in blocks]
    region: NDArray[np.int64] = np.broadcast_to(NOWHERE, sum(counts))
    region_names: dict[tuple[int, int], str] = {}
    if cell_data or cell_sets:
        region = np.zeros(len(region), dtype=np.int64)
        dimensions = [CELLS[kind].dimension if kind in CELLS else UNKNOWN for kind, _ in blocks]
        dimension = np.repeat(dimensions, counts).astype(np.int64)
        physical = cell_data.get("gmsh:physical")
        for dim in np.unique(dimension).tolist():
            of_dim = np.flatnonzero(dimension == dim)
            fields = [values[of_dim] for name, values in cell_data.items() if names_a_region(name)]
            # The outline of a named set of faces is a shape that the user has drawn, as much as the one of a region.
            fields += [np.isin(of_dim, cells) for cells in (cell_sets or {}).values()] if dim == 2 else []
            region[of_dim] = combined(fields, len(of_dim))
            for name, (named_dim, tag) in (names or {}).items():
                if physical is not None and named_dim == dim:
                    tagged = of_dim[np.ravel(physical[of_dim]) == tag]
                    region_names.update({(dim, number): name for number in np.unique(region[tagged]).tolist()})
    region.flags.writeable = False  # so that it need not be copied
    breaks = np.cumsum(counts)[:-1].tolist()
    for name, ids in (cell_sets or {}).items():
        parts = np.split(np.isin(np.arange(len(region)), ids), breaks)
        nodes = [nodes[part].ravel() for (_, nodes), part in zip(blocks, parts, strict=True)]
        node_sets[name] = np.unique(np.concatenate([node_sets.get(name, np.zeros(0, dtype=np.int64)), *nodes]))
    cells = tuple(
        CellBlock(kind, nodes, part)
        for (kind, nodes), part in zip(blocks, np.split(region, breaks), strict=bool(blocks))
    )
    return Mesh(
        points=array,
        cells=cells,
        region_names=region_names,
        point_data=dict(point_data or {}),
        cell_data={name: tuple(np.split(values, breaks)) if blocks else () for name, values in cell_data.items()},
        node_sets=node_sets,
        single=array.dtype.kind == "f" and array.dtype.itemsize == 4,
    )


def _pairs(cells: Any) -> list[tuple[str, Any]]:
    """The (kind, nodes) pairs of what a user gives as cells."""
    if isinstance(cells, Mapping):
        return list(cells.items())
    if isinstance(cells, (list, tuple)) and cells:
        if all(hasattr(block, "type") and hasattr(block, "data") for block in cells):
            return [(block.type, block.data) for block in cells]
        if all(isinstance(block, (list, tuple)) and len(block) == 2 and isinstance(block[0], str) for block in cells):
            return [(kind, nodes) for kind, nodes in cells]
    nodes = _indices(cells, "cells")
    if nodes.size == 0:
        nodes = nodes.reshape(0, 3)
    if nodes.ndim != 2 or nodes.shape[1] != 3:
        raise InputError(
            f"cells must be an M×3 array of the nodes of triangles, got shape {nodes.shape}: "
            'give other cells by their kind, such as {"triangle": …, "quad": …}'
        )
    return [("triangle", nodes)]


def _indices(nodes: Any, what: str) -> NDArray[np.int64]:
    array = plain_array(nodes, what)
    if array.size and array.dtype.kind not in "iu":
        raise InputError(
            f"{what} must be whole numbers, got {array.dtype}: give node indices, such as cells.astype(int)"
        )
    return whole_numbers(array, what)


def _known(kind: Any) -> str:
    """The name of a type of cells. Raises InputError where it is none that meshio has either: it is misspelt."""
    if isinstance(kind, str) and KIND.fullmatch(kind):
        return kind
    near = difflib.get_close_matches(str(kind).lower(), CELLS, n=2, cutoff=0.5)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"known are {', '.join(CELLS)}"
    raise InputError(f"unknown type of cells {kind!r}; {hint}")


def _back(points: Any) -> Callable[[NDArray[np.float64]], NDArray[Any]]:
    """How new coordinates become the points of the object that came in: in its own precision."""
    dtype = np.asarray(points).dtype
    kept = dtype if dtype.kind == "f" and dtype.itemsize == 4 else np.dtype(np.float64)
    return lambda new: np.array(new, dtype=kept)


def _refill(copied: Callable[[], Any], points: Any) -> Restore:
    back = _back(points)

    def restore(new: NDArray[np.float64]) -> Any:
        made = copied()
        made.points = back(new)
        return made

    return restore


def _even(kind: str, data: Any) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """A block of meshio, cut where the number of nodes changes (its polygons may be lists of different lengths)."""
    if kind.startswith("polyhedron"):
        raise InputError("the mesh has polyhedra, which are volumes: gmsnet smooths planar meshes")
    if isinstance(data, np.ndarray):
        yield _face(kind, _indices(data, f"{kind} cells"))
        return
    for _, run in itertools.groupby(data, key=len):
        yield _face(kind, _indices(list(run), f"{kind} cells"))


def _face(kind: str, nodes: NDArray[np.int64]) -> tuple[str, NDArray[np.int64]]:
    """A face by the name that a Mesh has for it."""
    if kind == "pixel":  # VTK counts its corners row by row
        return "quad", nodes[:, VTK_ORDERS[PIXEL]]
    if kind.startswith("polygon") and nodes.ndim == 2:
        return face_name(nodes.shape[1]), nodes
    return kind, nodes


def _members(ids: Any, count: int, name: str) -> NDArray[np.int64]:
    """The ids of a named set, which may be a mask."""
    array = np.zeros(0, dtype=np.int64) if ids is None else np.ravel(plain_array(ids, f"set {name!r}"))
    if array.dtype.kind == "b" and len(array) == count:
        return np.flatnonzero(array)
    members = _indices(array, f"set {name!r}")
    if members.size and (members.min() < 0 or members.max() >= count):
        raise InputError(f"set {name!r} names {int(members[np.argmax(np.abs(members))])}, but there are only {count}")
    return members
