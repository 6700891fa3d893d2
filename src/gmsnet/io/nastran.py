"""Nastran's bulk data (``.bdf``, ``.nas``, ``.dat``, ``.fem``): GRID cards and elements; all other cards stay.

The regions of cells are their properties. Nodes that loads, supports, springs, rigid elements or unknown elements name
become vertex cells, so they are held. Where a GRID has no z, the mesh has two coordinates. New coordinates fit the
fields of the old ones: of 8 columns, or of 16.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.cells import counted, first_repeated, sealed
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed
from gmsnet.io.nastran_cells import CELLS, PROPERTIES, blocks_of, cells_of, held_nodes
from gmsnet.io.nastran_lines import Bulk, Cards, Ints
from gmsnet.io.nastran_numbers import reals, rounding_of, whole
from gmsnet.io.nastran_slots import AXES, FieldSlots, places_of_grids
from gmsnet.io.nastran_writer import name, suffixes, write
from gmsnet.mesh.cell_block import CellBlock

__all__ = ["name", "read", "suffixes", "write"]

ELSEWHERE = ("INCLUDE", "EGRID", "SPOINT", "GRIDB", "RINGAX", "EPOINT")  # nodes that are listed elsewhere or otherwise


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    bulk = Bulk(files[".bdf"])
    groups: dict[str, list[Cards]] = {}
    for cards in bulk.cards():
        groups.setdefault(cards.name, []).append(cards)
    _refuse(bulk, groups)
    grids = groups.get("GRID", [])
    elements = [cards for key in groups if key in CELLS for cards in groups[key]]
    if not grids or not elements:
        raise FormatError(f"no {'elements are' if grids else 'GRID is'} in this file: it is cut off, or no bulk data")
    for cards in (*grids, *elements):
        bulk.check(cards)
    ids, points, slots = _nodes(bulk, grids)
    properties = _properties(bulk, groups)
    found = [cells_of(bulk, cards, with_properties=bool(properties)) for cards in elements]
    blocks = [block for cells in found for block in blocks_of(bulk, cells, ids)]
    names = {(block.dimension, region): properties[region] for block in blocks for region in
             np.unique(block.regions).tolist() if block.dimension is not None and region in properties}  # fmt: skip
    taken = {int(region) for block in blocks for region in np.unique(block.regions).tolist()}
    for key, nodes in _held(bulk, groups, ids).items():
        number = max(taken) + 1
        taken.add(number)
        blocks.append(CellBlock("vertex", nodes[:, None], np.full(len(nodes), number)))
        names[0, number] = key
    unread = [f"the card {key}" for key in groups if key != "GRID" and key not in CELLS]
    if not counted(ids, 1):
        unread.append("the numbers of nodes, which begin elsewhere, have gaps or another order")
    return Parsed(points, blocks, slots, names, unread=unread, rounding=rounding_of(slots.widths, points))


def _refuse(bulk: Bulk, groups: Mapping[str, list[Cards]]) -> None:
    """Raises FormatError where nodes stand elsewhere, or in other coordinates."""
    for key in ELSEWHERE:
        if key in groups:
            line = int(groups[key][0].line[0])
            bulk.fail_at_line(line, f"{key}: only nodes of GRID cards in this file are read: put them here")
    for cards in groups.get("GRDSET", []):
        if (whole(bulk, *bulk.field(cards, 2), "a coordinate system", blank=0) != 0).any():
            bulk.fail_at_line(int(cards.line[0]), "GRDSET puts all nodes into another coordinate system: write GRID "
                                                  "cards in that of the model (0)")  # fmt: skip


def _nodes(bulk: Bulk, grids: list[Cards]) -> tuple[Ints, NDArray[np.float64], FieldSlots]:
    """The numbers, the coordinates and the slots of all GRID cards, in the order of the file."""
    lines = np.concatenate([cards.line for cards in grids])
    order = np.argsort(lines, kind="stable")
    lines = lines[order]
    ids = np.concatenate([whole(bulk, *bulk.field(cards, 1), "the number of a node") for cards in grids])[order]
    systems = [whole(bulk, *bulk.field(cards, 2), "a coordinate system", blank=0) for cards in grids]
    if len(bad := np.flatnonzero(np.concatenate(systems)[order] != 0)):
        told = f"the node {ids[bad[0]]} is in another coordinate system (CP): write it in that of the model (0)"
        bulk.fail_at_line(int(lines[bad[0]]), told)
    if (twice := first_repeated(ids)) >= 0:
        bulk.fail_at_line(int(lines[twice]), f"the node {ids[twice]} is given twice")
    found = places_of_grids(bulk, grids)
    slots = FieldSlots(*(sealed(np.ascontiguousarray(part[order])) for part in (
        found.starts, found.ends, found.widths, found.free)))  # fmt: skip
    if len(bad := np.flatnonzero((slots.starts[:, : AXES - 1] < 0).any(axis=1))):
        bulk.fail_at_line(int(lines[bad[0]]), f"the node {ids[bad[0]]} has fewer than two coordinates")
    points = reals(bulk, slots.starts.ravel(), slots.ends.ravel()).reshape(-1, AXES)
    missing = slots.starts[:, AXES - 1] < 0
    if not missing.any():
        return ids, points, slots
    if points[:, AXES - 1].any():
        told = "has no field for z, which other nodes have: write it"
        bulk.fail_at_line(int(lines[np.argmax(missing)]), f"the node {ids[np.argmax(missing)]} {told}")
    flat = replace(slots, starts=slots.starts[:, : AXES - 1], ends=slots.ends[:, : AXES - 1])
    return ids, np.ascontiguousarray(points[:, : AXES - 1]), flat


def _properties(bulk: Bulk, groups: Mapping[str, list[Cards]]) -> dict[int, str]:
    """The names of regions: the card of the property and its number."""
    return {
        number: f"{key} {number}"
        for key in PROPERTIES
        for cards in groups.get(key, [])
        for number in whole(bulk, *bulk.field(cards, 1), "the number of a property").tolist()
    }


def _held(bulk: Bulk, groups: Mapping[str, list[Cards]], ids: Ints) -> dict[str, Ints]:
    """The nodes that are held, by the card that names them; cards that name all nodes say nothing of a place."""
    held: dict[str, Ints] = {}
    for key, several in groups.items():
        for cards in several:
            nodes = held_nodes(bulk, cards, ids)
            if nodes is not None and len(nodes):
                held[key] = np.union1d(held.get(key, nodes), nodes)
    return {key: nodes for key, nodes in held.items() if len(nodes) < len(ids) or key not in ("SPC", "SPC1")}
