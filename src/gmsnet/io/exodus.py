"""Exodus II meshes (``.e``, ``.exo``, …): netCDF of the classic form, or of version 4, which is HDF5 (needs h5py).

Only the coordinates are written again. Blocks of elements are regions, side sets are markers, node sets are kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io import netcdf3
from gmsnet.io.cell_table import check_range
from gmsnet.io.cells import sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.exodus_elements import ORDERS, kind_of, side_cells
from gmsnet.io.hdf5 import File
from gmsnet.io.splice import Points, Slots
from gmsnet.io.stored import Column, ColumnSlots, Part, coordinates
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "Exodus II"
suffixes: tuple[str, ...] = (".e",)


class Store(Protocol):
    """The variables of a file."""

    def has(self, name: str) -> bool:
        """Whether there is such a variable."""
        ...

    def integers(self, name: str) -> NDArray[np.int64]:
        """The whole numbers of a variable, in its shape."""
        ...

    def texts(self, name: str) -> list[str]:
        """The rows of a variable of letters."""
        ...

    def attribute(self, name: str, key: str) -> str:
        """An attribute of a variable, empty where there is none."""
        ...

    def points(self) -> tuple[Points, Slots, bool]:
        """The coordinates, their slots, and whether they are in single precision."""
        ...


class Classic:
    """See Store: of the classic form."""

    data: Data
    header: netcdf3.Header

    def __init__(self, data: Data) -> None:
        self.data, self.header = data, netcdf3.Header(data)

    def has(self, name: str) -> bool:
        """See Store."""
        return name in self.header.variables

    def integers(self, name: str) -> NDArray[np.int64]:
        """See Store."""
        values = self.header.array(name)
        if values.dtype.kind not in "iu":
            raise FormatError(f"the variable {name[:40]!r} is of no whole numbers")
        return values.astype(np.int64)

    def texts(self, name: str) -> list[str]:
        """See Store."""
        values = self.header.array(name)
        return _rows(values) if values.dtype.kind == "S" and values.ndim == 2 else []

    def attribute(self, name: str, key: str) -> str:
        """See Store."""
        return self.header.variables[name].attributes.get(key, "")

    def points(self) -> tuple[Points, Slots, bool]:
        """See Store."""
        names = ["coord"] if self.has("coord") else [key for key in ("coordx", "coordy", "coordz") if self.has(key)]
        tables, columns = list[NDArray[Any]](), list[Column]()
        for key in names:
            values, variable = self.header.array(key), self.header.variables[key]
            if values.dtype.kind != "f" or values.ndim != 1 + (key == "coord"):
                raise FormatError(f"the variable {key!r} is of no coordinates")
            for row in np.atleast_2d(values)[:4]:
                start = variable.begin + (len(tables) * values.shape[-1] * values.itemsize if key == "coord" else 0)
                columns.append(Column(start, values.itemsize, variable.dtype, len(tables)))
                tables.append(row)
        if len(tables) not in (2, 3) or len({len(table) for table in tables}) != 1:
            raise FormatError("coordx, coordy (or coord) are missing, or of different lengths")
        points = np.stack([table.astype(np.float64) for table in tables], axis=1)
        if not np.isfinite(points).all():
            raise FormatError("a coordinate is not a finite number")
        spans = sorted(column.start for column in columns)
        if any(b - a < len(points) * columns[0].stride for a, b in pairwise(spans)):
            raise FormatError("the coordinates of two axes share their bytes: the header is damaged")
        self.header.check_apart(names)
        return points, ColumnSlots(tuple(columns)), columns[0].dtype == ">f4"


class Modern:
    """See Store: of version 4."""

    data: Data
    file: File

    def __init__(self, data: Data) -> None:
        self.data, self.file = data, File(data)

    def has(self, name: str) -> bool:
        """See Store."""
        return self.file.root.get(name) is not None

    def integers(self, name: str) -> NDArray[np.int64]:
        """See Store."""
        return self.file.root.need(name).integers()

    def texts(self, name: str) -> list[str]:
        """See Store."""
        values = self.file.root.need(name).array("S")
        return _rows(values) if values.ndim == 2 else []

    def attribute(self, name: str, key: str) -> str:
        """See Store."""
        return str(self.file.root.need(name).attribute(key) or "")

    def points(self) -> tuple[Points, Slots, bool]:
        """See Store."""
        whole = self.file.root.get("coord")
        if whole is not None:
            shape = whole.shape()
            if len(shape) != 2 or shape[0] not in (2, 3):
                raise FormatError("coord has another shape than (dimensions, nodes)")
            return coordinates([Part(whole, tuple(range(shape[0])), by_axis=True)], self.data)
        axes = [found for key in "xyz" if (found := self.file.root.get(f"coord{key}")) is not None]
        if len(axes) not in (2, 3):
            raise FormatError("coordx and coordy (or coord) are missing")
        return coordinates([Part(node, (k,)) for k, node in enumerate(axes)], self.data)


def _rows(letters: NDArray[Any]) -> list[str]:
    return [
        "".join(c for c in row.tobytes().split(b"\0")[0].decode("utf-8", "replace") if c.isprintable()).strip()
        for row in letters
    ]


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".e"]
    store: Store = Classic(data) if bytes(data[:3]) == netcdf3.MAGIC else Modern(data)
    points, slots, single = store.points()
    cells, region_names, first = _blocks(store, points.shape)
    dimension = max((block.dimension or 0 for block in cells), default=0)
    sides, side_names, unread = _sides(store, first, dimension)
    names = {(dim, number): text for (dim, number), text in {**region_names, **side_names}.items() if text}
    for key in ("nod_var", "vals_nod_var", "vals_nod_var1", "vals_elem_var1eb1", "time_whole"):
        if store.has(key) and key != "nod_var":
            unread.append("results and times")
            break
    unread += [what for key, what in (("node_num_map", "numbers of nodes"), ("elem_num_map", "numbers of elements"))
               if store.has(key)]  # fmt: skip
    node_sets = _node_sets(store, len(points))
    return Parsed(points, cells + sides, slots, names, single=single, unread=unread, node_sets=node_sets)


def _ids(store: Store, key: str, count: int) -> list[int]:
    """The numbers that the file gives to its blocks or sets."""
    found = store.integers(key).reshape(-1).tolist() if store.has(key) else []
    return found if len(found) == count and len(set(found)) == count else list(range(1, count + 1))


def _count(store: Store, pattern: str) -> int:
    """How many variables there are with the numbers 1, 2, 3, … for the % of the pattern."""
    count = 0
    while store.has(pattern.replace("%", str(count + 1))):
        count += 1
    return count


def _named(store: Store, key: str, count: int) -> list[str]:
    found = store.texts(key) if store.has(key) else []
    return found if len(found) == count else [""] * count


_Firsts = list[tuple[int, CellBlock]]  # the number of the first element of each block, from 0


def _blocks(store: Store, shape: tuple[int, ...]) -> tuple[list[CellBlock], dict[tuple[int, int], str], _Firsts]:
    """The elements, the names of their blocks by (dimension, number), and where each block's elements begin."""
    count = _count(store, "connect%")
    ids, titles = _ids(store, "eb_prop1", count), _named(store, "eb_names", count)
    cells, names, first = list[CellBlock](), dict[tuple[int, int], str](), _Firsts()
    at = 0
    for k in range(count):
        key = f"connect{k + 1}"
        nodes = store.integers(key) - 1
        if nodes.ndim != 2:
            raise FormatError(f"the variable {key!r} has {nodes.ndim} dimensions instead of 2")
        kind = kind_of(store.attribute(key, "elem_type"), nodes.shape[1], shape[1])
        check_range(nodes.reshape(-1), shape[0], _blame(key))
        if kind in ORDERS:
            nodes = nodes[:, ORDERS[kind]]
        block = CellBlock(kind, sealed(np.ascontiguousarray(nodes)), np.full(len(nodes), ids[k]))
        cells.append(block)
        first.append((at, block))
        at += len(nodes)
        names[block.dimension or 0, ids[k]] = titles[k]
    return cells, names, first


def _blame(key: str) -> Any:
    def fail(index: int, message: str) -> None:
        raise FormatError(f"the variable {key!r}: {message} (counted from 0)")

    return fail


def _sides(
    store: Store, first: _Firsts, dimension: int
) -> tuple[list[CellBlock], dict[tuple[int, int], str], list[str]]:
    """The sides of all side sets as cells of one dimension less, and the names of the sets."""
    count = _count(store, "elem_ss%")
    ids, titles = _ids(store, "ss_prop1", count), _named(store, "ss_names", count)
    cells, names, left = list[CellBlock](), dict[tuple[int, int], str](), 0
    for k in range(count):
        elements, key = store.integers(f"elem_ss{k + 1}").reshape(-1) - 1, f"side_ss{k + 1}"
        sides = store.integers(key).reshape(-1) - 1 if store.has(key) else np.empty(0, dtype=np.int64)
        if len(sides) != len(elements):
            raise FormatError(f"elem_ss{k + 1} and {key} have different lengths")
        found, unknown = side_cells(first, elements, sides, dimension)
        cells += [CellBlock(kind, nodes, np.full(len(nodes), ids[k])) for kind, nodes in found.items()]
        names[dimension - 1, ids[k]], left = titles[k] or str(ids[k]), left + unknown
    return cells, names, [f"{left} sides of side sets"] * bool(left)


def _node_sets(store: Store, count: int) -> dict[str, NDArray[np.int64]]:
    sets = _count(store, "node_ns%")
    ids, titles = _ids(store, "ns_prop1", sets), _named(store, "ns_names", sets)
    found = {}
    for k in range(sets):
        nodes = store.integers(f"node_ns{k + 1}").reshape(-1) - 1
        check_range(nodes, count, _blame(f"node_ns{k + 1}"))
        title = titles[k] if titles[k] and titles[k] not in found else f"node set {ids[k]}"
        found[title] = np.unique(nodes)
    return found


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
