"""XDMF meshes: XML with the numbers inside, or in an HDF5 file beside it (needs h5py).

Only the points are written again. The first grid with a geometry is read; of grids that include
its points, as dolfinx writes tags, cells of fewer dimensions are markers, and tags of its own cells are regions.
Source: the XDMF model and format, version 3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io import xdmf_ranges
from gmsnet.io.cell_table import check_range, table_blocks
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.hdf5 import File, Node
from gmsnet.io.places import ranges
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Ranges
from gmsnet.io.splice import Points, Slots, TextSlots
from gmsnet.io.stored import Part, coordinates
from gmsnet.io.text import Text
from gmsnet.io.xdmf_links import H5
from gmsnet.io.xdmf_tags import COUNTED, MIXED, TABLE, TYPES, Mark, Tags, cell_word
from gmsnet.io.xml_tree import Element, blame, check_plain, parse
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.region_fields import combined, regions_of

name = "XDMF"
suffixes: tuple[str, ...] = (".xdmf",)

Ints = NDArray[np.int64]


class Items:
    """The numbers of the items of a file."""

    data: Data
    text: Text
    h5: File | None

    def __init__(self, files: Mapping[str, Data]) -> None:
        self.data, self.text = files[".xdmf"], Text(files[".xdmf"], ends=b"<")
        self.h5 = File(files[H5]) if H5 in files else None

    def shape(self, item: Element) -> tuple[int, ...]:
        """The dimensions of an item."""
        words = item.get("Dimensions").split()
        if not words or any(not word.isdigit() or len(word) > 15 for word in words):
            blame(self.data, item, f"Dimensions are {item.get('Dimensions')[:40]!r}")
        return tuple(map(int, words))

    def node(self, item: Element) -> Node:
        """The data set that an item names."""
        first, stop = check_plain(self.data, item)
        text = self.data[first:stop].decode("utf-8", "replace").strip()
        path = text.partition(":")[2]
        if self.h5 is None or not path:
            blame(self.data, item, "an HDF5 file and the path in it were expected")
        return self.h5.root.need(path)

    def starts(self, item: Element) -> NDArray[Any]:
        """The tokens of an item in the text."""
        first, stop = check_plain(self.data, item)
        found, _ = self.text.until(stop).tokens(first)
        if len(found) != math.prod(self.shape(item)):
            blame(self.data, item, f"{len(found)} numbers do not fit the Dimensions {item.get('Dimensions')[:40]}")
        return found

    def inside(self, item: Element) -> bool:
        """Whether the numbers stand in the text. Raises FormatError for items that are kept elsewhere."""
        how = item.get("Format", default="XML")
        if how not in ("XML", "HDF") or item.get("ItemType", default="Uniform") != "Uniform" or item.get("Reference"):
            blame(self.data, item, "only items of Format XML or HDF are read, which hold their numbers themselves")
        return how == "XML"

    def numbers(self, item: Element, kinds: str) -> NDArray[Any]:
        """The numbers of an item in its shape. kinds: ``iu`` for whole numbers alone, ``iuf`` for any."""
        shape = self.shape(item)
        if not self.inside(item):
            values = self.node(item).array(kinds)
            if values.size != math.prod(shape):
                blame(self.data, item, f"{values.size} numbers do not fit its Dimensions")
            return values.reshape(shape)
        starts = self.starts(item)
        whole = item.get("NumberType", "DataType", default="Float") in ("Int", "UInt", "Char", "UChar", "Short")
        if not whole and kinds == "iu":
            whole = True
        return (self.text.integers(starts) if whole else self.text.any_floats(starts)).reshape(shape)


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".xdmf"]
    root, items = parse(data, "Xdmf"), Items(files)
    grids = [grid for grid in root.all("Grid") if grid.of("Geometry") and grid.of("Geometry")[0].of("DataItem")]
    if not grids:
        raise FormatError("no Grid has a Geometry with its own DataItem")
    if len({_called(data, grid) for grid in grids}) > 1:
        raise FormatError("several grids have points of their own: only files of one mesh are smoothed")
    grid = grids[0]
    points, slots, single, inside = _geometry(items, grid.of("Geometry")[0])
    if len(grid.of("Topology")) != 1:
        blame(data, grid, "a Topology is missing")
    codes, sizes, nodes = _topology(items, grid.of("Topology")[0])

    def fail(index: int, message: str) -> NoReturn:
        blame(data, grid.of("Topology")[0], f"{message} (counted from 0)")

    check_range(nodes, len(points), fail)
    fields = [_fields(items, grid, center, count) for center, count in (("Node", len(points)), ("Cell", len(codes)))]
    regions, tags = regions_of(fields[1].items(), len(codes)), Tags(codes, sizes, nodes)
    others = [other for other in root.all("Grid") if other is not grid]
    marks = [mark for other in others if (mark := _mark(items, other, len(points))) is not None]
    for mark in marks:
        regions = tags.apply(mark, regions)
    cells, cell_data = table_blocks(TABLE, codes, sizes, nodes, regions, fields[1])
    cells += tags.lower
    unread = [f"{len(others) - tags.used} other grids"] * (len(others) > tags.used)
    return Parsed(points, cells, slots, {}, fields[0], cell_data, single, unread, main="" if inside else H5)


def plan(file: Ranges) -> Plan | None:
    """See ``xdmf_ranges.plan``."""
    return xdmf_ranges.plan(file)


def _mark(items: Items, grid: Element, count: int) -> Mark | None:
    """The cells of a grid that includes the points of another one, and the number that each has; None for others."""
    if grid.of("Geometry") or not grid.of("include") or len(grid.of("Topology")) != 1:
        return None
    if not grid.of("Topology")[0].of("DataItem"):
        return None
    codes, sizes, nodes = _topology(items, grid.of("Topology")[0])

    def fail(index: int, message: str) -> NoReturn:
        blame(items.data, grid.of("Topology")[0], f"{message} (counted from 0)")

    check_range(nodes, count, fail)
    values = [field for field in _fields(items, grid, "Cell", len(codes)).values() if field.ndim == 1]
    return Mark(codes, sizes, nodes, combined(values, len(codes)))


def _called(data: Data, grid: Element) -> bytes:
    """The texts of a geometry, by which two of them are told apart."""
    return b" ".join(bytes(data[slice(*check_plain(data, item))]).strip() for item in grid.of("Geometry")[0].of(
        "DataItem"))  # fmt: skip


def _geometry(items: Items, geometry: Element) -> tuple[Points, Slots, bool, bool]:
    """The points, their slots, whether they are in single precision, and whether they stand in the text."""
    how, found = geometry.get("GeometryType", "Type", default="XYZ").upper(), geometry.of("DataItem")
    wanted = {"XYZ": 1, "XY": 1, "X_Y_Z": 3, "X_Y": 2}
    if how not in wanted or len(found) != wanted[how]:
        blame(items.data, geometry, f"a geometry {how[:16]!r} of {len(found)} items is not read: write it as XYZ")
    inside, width = items.inside(found[0]), len(how.replace("_", ""))
    if not inside:
        axes = [tuple(range(width))] if len(found) == 1 else [(k,) for k in range(width)]
        parts = [Part(items.node(item), each) for item, each in zip(found, axes, strict=True)]
        assert items.h5 is not None
        return *coordinates(parts, items.h5.data), False
    if len(found) > 1:
        blame(items.data, geometry, "points in the text must be of type XYZ or XY")
    starts = items.starts(found[0])
    if len(starts) % width:
        blame(items.data, geometry, f"{len(starts)} coordinates do not make points of {width}")
    points, ends = items.text.spans(np.ascontiguousarray(starts.reshape(-1, width)))
    return points, TextSlots(starts.reshape(-1, width), ends), False, True


def _topology(items: Items, topology: Element) -> tuple[Ints, Ints, Ints]:
    """The type and the number of nodes of each cell, and the nodes of all cells one after another."""
    word = cell_word(topology)
    found = topology.of("DataItem")
    if len(found) != 1 or topology.get("BaseOffset", default="0").strip() != "0":
        blame(items.data, topology, f"{len(found)} items, or nodes that are not counted from 0, are not read")
    listed = items.numbers(found[0], "iu").astype(np.int64, copy=False).reshape(-1)
    if word == "mixed":
        return _mixed(items, topology, listed)
    if word not in TYPES:
        blame(items.data, topology, f"cells of type {word[:24]!r} are not read")
    code, kind = TYPES[word]
    given = topology.get("NodesPerElement", default="0").strip()
    least = 2 if kind == "line" else 1
    width = nodes_of(kind) if kind != "polygon" and code not in COUNTED else (
        int(given) if given.isdigit() and 0 < len(given) < 10 and int(given) else least)  # fmt: skip
    if kind in ("vertex", "line") and width != least:
        blame(items.data, topology, f"cells of type {word!r} with {width} nodes are not read")
    if kind == "polygon" and width < 3:
        blame(items.data, topology, "NodesPerElement of polygons is missing, or less than 3")
    if len(listed) % width:
        blame(items.data, topology, f"{len(listed)} nodes do not make cells of {width}")
    count = len(listed) // width
    return np.full(count, code), np.full(count, width), listed


def _mixed(items: Items, topology: Element, listed: Ints) -> tuple[Ints, Ints, Ints]:
    """Of a list in which each cell has its type in front, and some the number of their nodes behind it."""
    codes, sizes, first = list[int](), list[int](), list[int]()
    values, at = listed.tolist(), 0
    while at < len(values):
        code = values[at]
        if code not in MIXED:
            blame(items.data, topology, f"cell {len(codes)} (counted from 0) has the type {code}, which is not read")
        counted = code in COUNTED
        size = (values[at + 1] if at + 1 < len(values) else 0) if counted else nodes_of(MIXED[code])
        if size < 1 or (code < 3 and size != code) or (code == 3 and size < 3) or at + 1 + counted + size > len(values):
            blame(items.data, topology, f"cell {len(codes)} (counted from 0) has {size} nodes, or the list ends")
        codes.append(code)
        sizes.append(size)
        first.append(at + 1 + counted)
        at += 1 + counted + size
    count = np.array(sizes, dtype=np.int64)
    return np.array(codes, dtype=np.int64), count, listed[ranges(np.array(first, dtype=np.int64), count)]


def _fields(items: Items, grid: Element, center: str, count: int) -> dict[str, NDArray[Any]]:
    """The data of nodes or cells."""
    found = {}
    for k, attribute in enumerate(grid.of("Attribute")):
        if attribute.get("Center", default="Node") != center or len(attribute.of("DataItem")) != 1:
            continue
        values = items.numbers(attribute.of("DataItem")[0], "iuf")
        if not values.ndim or values.size % max(1, count) or not count:
            blame(items.data, attribute, f"{values.size} numbers do not fit {count} rows")
        values = values.reshape(count, -1)
        title = "".join(c for c in attribute.get("Name") if c.isprintable()) or f"{center} {k}"
        found[title] = values[:, 0] if values.shape[1] == 1 else values
    return found


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
