"""The variables of Exodus II files, in the classic form of netCDF or in HDF5, and what they list.

Source: L. A. Schoof and V. R. Yarberry, EXODUS II: A Finite Element Data Model, SAND92-2137.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError
from gmsnet.io import netcdf3
from gmsnet.io.cell_table import check_range
from gmsnet.io.contents import Data
from gmsnet.io.exodus_elements import Sides, sides_of
from gmsnet.io.hdf5 import File
from gmsnet.io.hdf5_rows import rows_of
from gmsnet.io.rows import Listed, Rows
from gmsnet.io.splice import Points, Slots
from gmsnet.io.stored import Column, ColumnSlots, Part, coordinates
from gmsnet.kernels.topology.sorted_unique import sorted_unique


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

    def rows(self, name: str) -> Listed | None:
        """Where the numbers of a variable stand, as its rows; None where that cannot be told."""
        ...

    def check_apart(self, names: Sequence[str]) -> None:
        """Raises FormatError where bytes of these variables are of something else, too."""
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

    def rows(self, name: str) -> Listed | None:
        """See Store."""
        found = self.header.placed(name)
        size = np.dtype(found.dtype).itemsize
        if len(found.shape) not in (1, 2):
            return None
        width = found.shape[1] if len(found.shape) == 2 else 1
        return Rows(found.begin, found.shape[0], width * size, found.dtype, width)

    def check_apart(self, names: Sequence[str]) -> None:
        """See Store."""
        spans = sorted((each.begin, each.size) for each in (self.header.variables[name] for name in names))
        if any(other - one < size for (one, size), (other, _) in pairwise(spans)):
            raise FormatError("the coordinates of two axes share their bytes: the header is damaged")
        self.header.check_apart(names)

    def points(self) -> tuple[Points, Slots, bool]:
        """See Store."""
        names = coordinates_in(self)
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
        self.check_apart(names)
        return points, ColumnSlots(tuple(columns)), columns[0].dtype == ">f4"


class Modern:
    """See Store: of version 4."""

    file: File

    def __init__(self, file: File) -> None:
        self.file = file

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
            return coordinates([Part(whole, tuple(range(shape[0])), by_axis=True)], self.file.data)
        axes = [found for key in "xyz" if (found := self.file.root.get(f"coord{key}")) is not None]
        if len(axes) not in (2, 3):
            raise FormatError("coordx and coordy (or coord) are missing")
        return coordinates([Part(node, (k,)) for k, node in enumerate(axes)], self.file.data)

    def rows(self, name: str) -> Listed | None:
        """See Store."""
        return rows_of(self.file.root.need(name))

    def check_apart(self, names: Sequence[str]) -> None:
        """See Store: data sets are."""


def coordinates_in(store: Store) -> list[str]:
    """The variables of the coordinates: one of all axes, or one of each."""
    return ["coord"] if store.has("coord") else [key for key in ("coordx", "coordy", "coordz") if store.has(key)]


def _rows(letters: NDArray[Any]) -> list[str]:
    return [
        "".join(c for c in row.tobytes().split(b"\0")[0].decode("utf-8", "replace") if c.isprintable()).strip()
        for row in letters
    ]


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


class Block(NamedTuple):
    """A block of elements, or a set of sides. key: of its variable, or what it ends with. number: of its region."""

    key: str
    number: int
    title: str


def element_blocks(store: Store) -> list[Block]:
    """The blocks of elements."""
    count = _count(store, "connect%")
    ids, titles = _ids(store, "eb_prop1", count), _named(store, "eb_names", count)
    return [Block(f"connect{k + 1}", ids[k], titles[k]) for k in range(count)]


class SideSet(NamedTuple):
    """sides: by the kind of cell that they are. left: how many are not kept."""

    number: int
    name: tuple[int, str]  # with the dimension of the sides
    sides: dict[str, list[Sides]]
    left: int


def side_sets(store: Store, blocks: Sequence[tuple[str, int]]) -> Iterator[SideSet]:
    """Sides of elements as cells of one dimension less. blocks: the kind of the elements of each, and how many."""
    count, dimension = _count(store, "elem_ss%"), max((CELLS[kind].dimension for kind, _ in blocks), default=0)
    ids, titles = _ids(store, "ss_prop1", count), _named(store, "ss_names", count)
    for k in range(count):
        elements, key = store.integers(f"elem_ss{k + 1}").reshape(-1) - 1, f"side_ss{k + 1}"
        sides = store.integers(key).reshape(-1) - 1 if store.has(key) else np.empty(0, dtype=np.int64)
        if len(sides) != len(elements):
            raise FormatError(f"elem_ss{k + 1} and {key} have different lengths")
        name = dimension - 1, titles[k] or str(ids[k])
        yield SideSet(ids[k], name, *sides_of(blocks, elements, sides, dimension))


def node_sets(store: Store, count: int) -> dict[str, NDArray[np.int64]]:
    """Lists of nodes by name. count: of all nodes."""
    sets = _count(store, "node_ns%")
    ids, titles = _ids(store, "ns_prop1", sets), _named(store, "ns_names", sets)
    found = {}
    for k in range(sets):
        nodes = store.integers(f"node_ns{k + 1}").reshape(-1) - 1
        check_range(nodes, count, blame(f"node_ns{k + 1}"))
        title = titles[k] if titles[k] and titles[k] not in found else f"node set {ids[k]}"
        found[title] = sorted_unique(nodes)
    return found


def blame(key: str) -> Any:
    """What raises FormatError for a number of a variable."""

    def fail(index: int, message: str) -> None:
        raise FormatError(f"the variable {key!r}: {message} (counted from 0)")

    return fail
