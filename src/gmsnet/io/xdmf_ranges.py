"""XDMF whose numbers are in an HDF5 file beside it, of which a process reads and writes some only."""

from __future__ import annotations

import math
import os

import numpy as np

from gmsnet.cells.table import CELLS, nodes_of
from gmsnet.io.cells import MOST_BLOCKS
from gmsnet.io.contents import Data
from gmsnet.io.hdf5 import File, Node
from gmsnet.io.hdf5_rows import numbers_of, rows_of, stored_points
from gmsnet.io.ranges import Column, Plan, Table, blocks_of
from gmsnet.io.rows import Listed, Ranges
from gmsnet.io.vtk_runs import Field, told_by
from gmsnet.io.xdmf_links import H5, links
from gmsnet.io.xdmf_tags import COUNTED, MIXED, TYPES, cell_word
from gmsnet.io.xml_tree import Element, check_plain, parse

TOGETHER = 1 << 18  # cells of a list of mixed types that are looked at together
_MOST = 1 << 22  # bytes of a text that only names numbers
_AXES = {"XYZ": 3, "XY": 2, "X_Y_Z": 1, "X_Y": 1}  # type of a geometry → numbers in a row of each of its items
_OF_ANY_SIZE = ("vertex", "line", "polygon")  # unless the text says of how many nodes


class Numbers:
    """The items of a text, as rows of the file beside it."""

    def __init__(self, data: Data, file: Ranges, root: Node) -> None:
        self.data, self.file, self._root = data, file, root

    def node(self, item: Element) -> Node | None:
        """The data set of an item; None where its numbers are elsewhere."""
        kind, how = item.get("ItemType", default="Uniform"), item.get("Format", default="XML")
        if (kind, how) != ("Uniform", "HDF") or item.get("Reference"):
            return None
        first, stop = check_plain(self.data, item)
        path = bytes(self.data[first:stop]).decode("utf-8", "replace").strip().partition(":")[2]
        node = self._root.get(path) if path else None
        if node is None or not node.is_data or not node.numeric() or math.prod(node.shape()) != _told(item):
            return None
        return node

    def rows(self, item: Element, width: int) -> Listed | None:
        """Its numbers, so many in a row; None where they do not fill rows."""
        node = self.node(item)
        found = None if node is None else numbers_of(node)
        return None if found is None or found.rows % width else found.cut(0, found.rows // width, width, width)


def _told(item: Element) -> int:
    """How many numbers an item has by its dimensions, 0 where these cannot be understood."""
    words = item.get("Dimensions").split()
    return math.prod(int(word) if word.isdigit() and len(word) < 16 else 0 for word in words) if words else 0


def plan(file: Ranges) -> Plan | None:
    """How the numbers lie; None where some stand in the text, or where only a reader of the whole can tell."""
    if file.size > _MOST:
        return None
    data = bytes(file.read(0, file.size))
    name = links(data).get(H5)
    if name is None:
        return None
    grids = list(parse(data, "Xdmf").all("Grid"))
    with_points = [grid for grid in grids if grid.of("Geometry")]
    if len(with_points) != 1 or len(with_points[0].of("Geometry")) != 1:
        return None
    (own,) = with_points
    numbers = Ranges(os.path.join(os.path.dirname(file.path), name))
    with File.opened(numbers.path) as opened:
        others = [each for each in grids if each is not own]
        return _planned(Numbers(data, numbers, opened.root), name, own, others)


def _planned(numbers: Numbers, name: str, grid: Element, others: list[Element]) -> Plan | None:
    """name: of the file with the numbers. grid: with points of its own."""
    columns, main = _points(numbers, grid.of("Geometry")[0]), _cells(numbers, grid)
    if not columns or not main:
        return None
    counts = (next(iter(columns.values())).rows.rows, sum(nodes.rows for _, nodes in main))
    told = told_by(numbers.file, _fields(numbers, grid, "Node"), _fields(numbers, grid, "Cell"), counts)
    if told is None:
        return None
    tables, first = list[Table](), 0
    for kind, nodes in main:
        own = None if told.regions is None else told.regions.cut(first, nodes.rows, 1, 1)
        tables.append(Table(kind, nodes, 0, regions=own))
        first += nodes.rows
    blocks = blocks_of(tables)
    for other in others:
        if not other.of("include") or len(other.of("Topology")) != 1 or not other.of("Topology")[0].of("DataItem"):
            continue  # no marks
        table = _mark(numbers, other, max(CELLS[table.kind].dimension for table in tables))
        if table is None:
            return None
        blocks.append([table])
    points = list(columns.values())
    single = all(column.rows.dtype[1:] == "f4" for column in points)
    return Plan(points, blocks, single, fixed=told.fixed, encoded=stored_points([columns]), beside=name)


def _points(numbers: Numbers, geometry: Element) -> dict[str, Column]:
    """Path of a data set → the coordinates in it; none where these cannot be told."""
    how, items = geometry.get("GeometryType", "Type", default="XYZ").upper(), geometry.of("DataItem")
    width, axes = _AXES.get(how, 0), len(how.replace("_", ""))
    nodes = [numbers.node(item) for item in items]
    found = [None if node is None else rows_of(node) for node in nodes]
    columns = {
        node.path: Column(rows, axis=axis) for axis, (node, rows) in enumerate(zip(nodes, found, strict=True))
        if node is not None and rows is not None and rows.width == width and rows.dtype[1:] in ("f4", "f8")
    }  # fmt: skip
    counts = {column.rows.rows for column in columns.values()}
    return columns if width and len(columns) == len(items) == axes // width and len(counts) == 1 else {}


def _cells(numbers: Numbers, grid: Element) -> list[tuple[str, Listed]]:
    """The kind and the nodes of each run of cells of one type; none where these cannot be told."""
    topologies = grid.of("Topology")
    if len(topologies) != 1 or len(topologies[0].of("DataItem")) != 1:
        return []
    topology, word = topologies[0], cell_word(topologies[0])
    if topology.get("BaseOffset", default="0").strip() != "0":
        return []
    if word == "mixed":
        return _mixed(numbers, topology.of("DataItem")[0])
    kind, given = TYPES.get(word, (0, ""))[1], topology.get("NodesPerElement", default="0").strip()
    width = nodes_of(kind) if kind and kind not in _OF_ANY_SIZE else {"vertex": 1, "line": 2}.get(kind, 0)
    if not width or (kind in _OF_ANY_SIZE and given not in ("0", str(width))):
        return []
    nodes = numbers.rows(topology.of("DataItem")[0], width)
    return [(kind, nodes)] if nodes is not None and nodes.rows and nodes.dtype[1] in "iu" else []


def _mixed(numbers: Numbers, item: Element) -> list[tuple[str, Listed]]:
    """The same of a list in which each cell has its type in front, and some the number of their nodes behind it.

    None where runs are many, for each is a block, and where cells are polygons.
    """
    listed, runs, at = numbers.rows(item, 1), list[tuple[str, Listed]](), 0
    if listed is None or listed.dtype[1] not in "iu":
        return []
    while at < listed.rows:
        code = int(listed.of(numbers.file, at, at + 1)[0, 0])
        kind = MIXED.get(code, "polygon")
        if kind == "polygon" or len(runs) == MOST_BLOCKS:
            return []
        begin = [code, code] if code in COUNTED else [code]  # vertices have one node, lines two
        width = code if code in COUNTED else nodes_of(kind)
        step = len(begin) + width
        cells = listed.cut(at, (listed.rows - at) // step, step, len(begin))
        count = _alike(numbers.file, cells, begin)
        if not count:
            return []
        runs.append((kind, listed.cut(at + len(begin), count, step, width)))
        at += count * step
    return runs


def _alike(file: Ranges, rows: Listed, numbers: list[int]) -> int:
    """How many of the rows up to the first other one are these numbers, some looked at at a time."""
    for first in range(0, rows.rows, TOGETHER):
        found = (rows.of(file, first, min(first + TOGETHER, rows.rows)) == numbers).all(axis=1)
        if not found.all():
            return first + int(np.argmin(found))
    return rows.rows


def _fields(numbers: Numbers, grid: Element, center: str) -> list[Field]:
    """The data of nodes or cells. The last of one name counts, as in a reader of the whole."""
    found = dict[str, Listed | None]()
    for attribute in grid.of("Attribute"):
        items = attribute.of("DataItem")
        if attribute.get("Center", default="Node") == center and len(items) == 1:
            node = numbers.node(items[0])
            name = "".join(c for c in attribute.get("Name") if c.isprintable())
            found[name] = None if node is None else rows_of(node)
    return [Field(name, rows) for name, rows in found.items()]


def _mark(numbers: Numbers, grid: Element, dimension: int) -> Table | None:
    """Cells of fewer dimensions that another grid lists, each with its number; None for others."""
    main = _cells(numbers, grid)
    if len(main) != 1 or CELLS[main[0][0]].dimension >= dimension:
        return None
    ((kind, nodes),) = main
    values = [field.rows for field in _fields(numbers, grid, "Cell")]
    told = told_by(numbers.file, [], [Field("region", rows) for rows in values], (0, nodes.rows))
    return None if told is None else Table(kind, nodes, 0, regions=told.regions)
