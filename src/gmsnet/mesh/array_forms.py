"""Meshes given as arrays: (points, cells) pairs, and mappings that hold regions and markers besides."""

from __future__ import annotations

import difflib
import re
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.cells.table import CELLS, face_name
from gmsnet.errors import InputError
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.arrays import coordinates, plain_array, whole_numbers
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.checks import items_of
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.vtk_types import PIXEL, VTK_ORDERS

Restore = Callable[[NDArray[np.float64]], Any]
Blocks = list[tuple[str, NDArray[np.int64]]]

KEYS = ("points", "cells", "regions", "markers")  # of a mesh that is given as a mapping

# meshio's names of cells, those of higher order ("tetra35") included: their nodes are held.
FAMILIES = "|".join(kind.name for kind in CELLS.values() if kind.order == 1 and kind.dimension)
KIND = re.compile(rf"vertex|({FAMILIES})\d*|VTK_LAGRANGE_[A-Z]+")
UNKNOWN = -1  # the dimension of cells of a kind that is not known


def mesh_from_arrays(
    points: ArrayLike, cells: Any, regions: Any = None, markers: Mapping[str, ArrayLike] | None = None
) -> Mesh:
    """A Mesh of arrays.

    points: (N, 2) or (N, 3) coordinates; in single precision they give a Mesh with ``single`` set. cells: an (M, 3)
    array of triangles; with planar points (N, 2) an (M, 4) array of quads; a mapping of kind → array; or a list of
    (kind, array) pairs. Kinds have meshio's names ("triangle", "quad", "line", …), nodes are counted from 0.

    regions: the region of each cell, whole numbers or names, as one array over all cells, as one over the faces alone,
    or as a mapping of kind → array or a list of arrays, one for each array of cells. Edges between two regions are
    interfaces, whose nodes are held.

    markers: name → (E, 2) pairs of nodes, which become line cells of that name, whose nodes are held; or name →
    node ids (K,) or a mask (N,) of bools, which become a set of nodes that ``fixed`` can name.

    Raises InputError where the arrays do not describe a mesh.
    """
    array = coordinates(points)
    blocks = blocks_of(cells, array.shape[1])
    given, region_names = _regions(regions, blocks, cells)
    made = [CellBlock(kind, nodes, part) for (kind, nodes), part in zip(blocks, given, strict=True)]
    node_sets = {}
    lowest = 1 + max((int(part.max(initial=0)) for (kind, _), part in zip(blocks, given, strict=True)
                      if dimension_of(kind) == 1), default=0)  # fmt: skip
    for name, values in items_of({} if markers is None else markers, "markers"):
        if not isinstance(name, str):
            raise InputError(f"the name of a marker must be a text, got {name!r}")
        nodes = plain_array(values, f"marker {name!r}")
        if nodes.ndim == 2 and nodes.shape[1] == 2 and nodes.dtype.kind != "b":
            edges = indices(nodes, f"marker {name!r}")
            made.append(CellBlock("line", edges, np.full(len(edges), lowest)))
            region_names[1, lowest] = name
            lowest += 1
        elif nodes.ndim == 1:
            node_sets[name] = sorted_unique(members(nodes, len(array), f"marker {name!r}", "nodes"))
        else:
            raise InputError(
                f"marker {name!r} must be pairs of nodes (E, 2), node ids or a mask, got the shape {nodes.shape}"
            )
    single = array.dtype.kind == "f" and array.dtype.itemsize == 4
    return Mesh(array, tuple(made), region_names=region_names, node_sets=node_sets, single=single)


def from_pair(thing: Any) -> tuple[Mesh, Restore]:
    """Of (points, cells): a tuple or a list, as which it goes out."""
    points, cells = thing
    mesh, same = mesh_from_arrays(points, cells), list if isinstance(thing, list) else tuple
    back = in_precision_of(points)
    return mesh, lambda new: same((back(new), cells))


def from_mapping(thing: Mapping[str, Any]) -> tuple[Mesh, Restore]:
    """Of {"points": …, "cells": …, "regions": …, "markers": …}, the last two if there are any. Out goes a dict."""
    for key in thing:
        if key not in KEYS:
            near = difflib.get_close_matches(str(key), KEYS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(map(repr, KEYS))}"
            raise InputError(f"a mesh given as a mapping has no {key!r}; {hint}")
    if lacking := [key for key in KEYS[:2] if key not in thing]:
        raise InputError(f"a mesh given as a mapping needs {lacking[0]!r}: give {{'points': …, 'cells': …}}")
    mesh = mesh_from_arrays(**thing)
    back = in_precision_of(thing["points"])
    return mesh, lambda new: {**thing, "points": back(new)}


def blocks_of(cells: Any, dimension: int) -> Blocks:
    """(kind, nodes) of what a user gives as cells. dimension: how many coordinates the points have."""
    return [face(known_kind(kind), indices(nodes, kind)) for kind, nodes in _pairs(cells, dimension)]


def _pairs(cells: Any, dimension: int) -> list[tuple[str, Any]]:
    if isinstance(cells, Mapping):
        return list(cells.items())
    if isinstance(cells, (list, tuple)) and len(cells):
        if all(hasattr(block, "type") and hasattr(block, "data") for block in cells):
            return [(block.type, block.data) for block in cells]
        if all(isinstance(block, (list, tuple)) and len(block) == 2 and isinstance(block[0], str) for block in cells):
            return [(kind, nodes) for kind, nodes in cells]
        if len(cells) == 2 and isinstance(cells[0], str):
            return [(cells[0], cells[1])]
    nodes = indices(cells, "cells")
    if nodes.size == 0:
        nodes = nodes.reshape(0, 3)
    columns = nodes.shape[1] if nodes.ndim == 2 else 0
    if columns == 4 and dimension == 3:
        raise InputError(
            "cells of four nodes may be quads or tetrahedra where points have three coordinates: "
            'give them by their kind, as [("quad", cells)] or [("tetra", cells)]'
        )
    if columns not in (3, 4):
        raise InputError(
            "cells must be an M×3 array of the nodes of triangles or an M×4 array of those of quads, "
            f'got shape {nodes.shape}: give other cells by their kind, such as [("triangle", …), ("quad", …)]'
        )
    return [("triangle" if columns == 3 else "quad", nodes)]


def _regions(regions: Any, blocks: Blocks, cells: Any) -> tuple[list[NDArray[np.int64]], dict[tuple[int, int], str]]:
    """The region of each cell of each block, and (dimension, region) → name where they are given as names."""
    counts = [len(nodes) for _, nodes in blocks]
    if regions is None:
        return [np.zeros(count, dtype=np.int64) for count in counts], {}
    values = _region_values(regions, blocks, cells)
    names: dict[tuple[int, int], str] = {}
    if values.dtype.kind == "U":
        found, values = np.unique(values, return_inverse=True)
        dimensions = {dimension_of(kind) for kind, _ in blocks}
        names = {(d, number): str(name) for d in dimensions for number, name in enumerate(found.tolist(), 1)}
        values = values + 1
    numbers = whole_numbers(values, "regions", bools=True)
    faces = np.repeat([dimension_of(kind) == 2 for kind, _ in blocks], counts).astype(bool)
    if len(numbers) == np.count_nonzero(faces) < len(faces):
        every = np.zeros(len(faces), dtype=np.int64)
        every[faces] = numbers
        numbers = every
    if len(numbers) != len(faces):
        raise InputError(
            f"regions must hold one number or name for each of the {len(faces):,} cells, got {len(numbers):,}"
        )
    return np.split(numbers, np.cumsum(counts)[:-1].tolist()) if blocks else [], names


def _region_values(regions: Any, blocks: Blocks, cells: Any) -> NDArray[Any]:
    """Regions as one array (cells,), whatever form they are given in."""
    if isinstance(regions, Mapping):
        if not isinstance(cells, Mapping) or set(regions) != set(cells):
            raise InputError("regions given by kind need cells given by the same kinds, as {kind: array} both")
        regions = [regions[kind] for kind in cells]
    if isinstance(regions, (list, tuple)) and regions and not np.isscalar(regions[0]):
        parts = [plain_array(part, "regions") for part in regions]
        if [part.shape for part in parts] != [(len(nodes),) for _, nodes in blocks]:
            raise InputError("regions given as a list of arrays need one for each array of cells, and as long")
        return np.concatenate(parts)
    values = plain_array(regions, "regions")
    if values.ndim != 1:
        raise InputError(f"regions must hold one number or name for each cell, got shape {values.shape}")
    return values.astype(str) if values.dtype.kind == "O" else values


def indices(nodes: Any, what: str) -> NDArray[np.int64]:
    """Node indices as a read-only int64 array. Raises InputError, starting with ``what``, where they are none."""
    array = plain_array(nodes, what)
    if array.size and array.dtype.kind not in "iu":
        raise InputError(
            f"{what} must be whole numbers, got {array.dtype}: give node indices, such as cells.astype(int)"
        )
    return whole_numbers(array, what)


def dimension_of(kind: str) -> int:
    """0 to 3, UNKNOWN for kinds that are not in ``CELLS``."""
    return CELLS[kind].dimension if kind in CELLS else UNKNOWN


def known_kind(kind: Any) -> str:
    """The name of a type of cells. Raises InputError where it is none that meshio has either: it is misspelt."""
    if isinstance(kind, str) and KIND.fullmatch(kind):
        return kind
    near = difflib.get_close_matches(str(kind).lower(), CELLS, n=2, cutoff=0.5)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"known are {', '.join(CELLS)}"
    raise InputError(f"unknown type of cells {kind!r}; {hint}")


def face(kind: str, nodes: NDArray[np.int64]) -> tuple[str, NDArray[np.int64]]:
    """A face by the name that a Mesh has for it."""
    if kind == "pixel":  # VTK counts its corners row by row
        return "quad", nodes[:, VTK_ORDERS[PIXEL]]
    if kind.startswith("polygon") and nodes.ndim == 2:
        return face_name(nodes.shape[1]), nodes
    return kind, nodes


def in_precision_of(points: Any) -> Callable[[NDArray[np.float64]], NDArray[Any]]:
    """How new coordinates become the points of the object that came in: in its own precision.

    Tensors of other libraries, on the CPU, come back as such, by DLPack.
    """
    dtype = np.asarray(points).dtype
    kept = dtype if dtype.kind == "f" and dtype.itemsize == 4 else np.dtype(np.float64)
    library = sys.modules.get(type(points).__module__.partition(".")[0])
    if not isinstance(points, np.ndarray) and hasattr(points, "__dlpack__") and hasattr(library, "from_dlpack"):
        return lambda new: library.from_dlpack(np.array(new, dtype=kept))  # type: ignore[union-attr]
    return lambda new: np.array(new, dtype=kept)


def members(ids: Any, count: int, what: str, of: str = "") -> NDArray[np.int64]:
    """The ids of a named set, which may be a mask. count: how many there are to choose from."""
    array = np.zeros(0, dtype=np.int64) if ids is None else np.ravel(plain_array(ids, what))
    if array.dtype.kind == "b" and len(array) == count:
        return np.flatnonzero(array)
    chosen = indices(array, what)
    if chosen.size and (chosen.min() < 0 or chosen.max() >= count):
        wrong = int(chosen[np.argmax(np.abs(chosen))])
        raise InputError(f"{what} names {wrong}, but there are only {count}{f' {of}' if of else ''}")
    return chosen
