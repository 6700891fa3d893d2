"""Exodus II meshes (``.e``, ``.exo``, …): netCDF of the classic form, or of version 4, which is HDF5 (needs h5py).

Only the coordinates are written again. Blocks of elements are regions, side sets are markers, node sets are kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io import netcdf3
from gmsnet.io.cell_table import check_range
from gmsnet.io.cells import sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.exodus_elements import ORDERS, kind_of
from gmsnet.io.exodus_ranges import planned
from gmsnet.io.exodus_store import Classic, Modern, Store, blame, element_blocks, node_sets, side_sets
from gmsnet.io.hdf5 import File
from gmsnet.io.ranges import Plan
from gmsnet.io.rows import Head, Ranges
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

name = "Exodus II"
suffixes: tuple[str, ...] = (".e",)


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    data = files[".e"]
    store: Store = Classic(data) if bytes(data[:3]) == netcdf3.MAGIC else Modern(File(data))
    points, slots, single = store.points()
    cells, region_names = _blocks(store, points.shape)
    sides, side_names, unread = _sides(store, cells)
    names = {(dim, number): text for (dim, number), text in {**region_names, **side_names}.items() if text}
    for key in ("nod_var", "vals_nod_var", "vals_nod_var1", "vals_elem_var1eb1", "time_whole"):
        if store.has(key) and key != "nod_var":
            unread.append("results and times")
            break
    unread += [what for key, what in (("node_num_map", "numbers of nodes"), ("elem_num_map", "numbers of elements"))
               if store.has(key)]  # fmt: skip
    sets = node_sets(store, len(points))
    return Parsed(points, cells + sides, slots, names, single=single, unread=unread, node_sets=sets)


def _blocks(store: Store, shape: tuple[int, ...]) -> tuple[list[CellBlock], dict[tuple[int, int], str]]:
    """The elements, and the names of their blocks by (dimension, number)."""
    cells, names = list[CellBlock](), dict[tuple[int, int], str]()
    for key, number, title in element_blocks(store):
        nodes = store.integers(key) - 1
        if nodes.ndim != 2:
            raise FormatError(f"the variable {key!r} has {nodes.ndim} dimensions instead of 2")
        kind = kind_of(store.attribute(key, "elem_type"), nodes.shape[1], shape[1])
        check_range(nodes.reshape(-1), shape[0], blame(key))
        if kind in ORDERS:
            nodes = nodes[:, ORDERS[kind]]
        block = CellBlock(kind, sealed(np.ascontiguousarray(nodes)), np.full(len(nodes), number))
        cells.append(block)
        names[block.dimension or 0, number] = title
    return cells, names


def _sides(store: Store, blocks: Sequence[CellBlock]) -> tuple[list[CellBlock], dict[tuple[int, int], str], list[str]]:
    """The sides of all side sets as cells, and the names of the sets."""
    cells, names, left = list[CellBlock](), dict[tuple[int, int], str](), 0
    for each in side_sets(store, [(block.kind, len(block.nodes)) for block in blocks]):
        for kind, parts in each.sides.items():
            nodes = np.concatenate([blocks[of].nodes[rows][:, list(corners)] for of, rows, corners in parts])
            cells.append(CellBlock(kind, nodes, np.full(len(nodes), each.number)))
        names[each.name[0], each.number], left = each.name[1], left + each.left
    return cells, names, [f"{left} sides of side sets"] * bool(left)


def plan(file: Ranges) -> Plan | None:
    """How the numbers of a file lie; see ``planned``."""
    if bytes(file.read(0, min(file.size, len(netcdf3.MAGIC)))) == netcdf3.MAGIC:
        return planned(Classic(cast(Data, Head(file))))
    with File.opened(file.path) as opened:
        return planned(Modern(opened))


def write(mesh: Mesh) -> Written:
    """Raises FormatError: only files of this format are written again."""
    return own_files_only(name)
