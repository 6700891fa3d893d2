"""Abaqus and CalculiX decks (``.inp``): nodes, elements and sets; all else of the deck stays as it is.

The regions of cells are the element sets that sections (``*SOLID SECTION``) name, else those of ``*ELEMENT, ELSET=``.
All other sets are names of nodes. Nodes that a load, a support or an equation names become vertex cells.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io.abaqus_cells import Connectivity, Contents
from gmsnet.io.abaqus_deck import Deck, Section
from gmsnet.io.abaqus_held import KEYWORDS, named_nodes
from gmsnet.io.abaqus_scopes import ENDS, refuse_other_places
from gmsnet.io.abaqus_sets import Ints, Sets
from gmsnet.io.abaqus_writer import name, suffixes, write
from gmsnet.io.cell_table import table_blocks
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed
from gmsnet.io.fields import of_abaqus
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock

__all__ = ["name", "read", "suffixes", "write"]

MESH = ("NODE", "ELEMENT", "NSET", "ELSET", "PART", "ASSEMBLY", "INSTANCE", "HEADING", *ENDS)


def read(files: Mapping[str, Data]) -> Parsed:
    """See Format."""
    deck, found, others = Deck(files[".inp"]), Contents(), dict[str, None]()
    for section in deck.sections():
        refuse_other_places(deck, section)
        if found.scopes.enter(deck, section):
            continue
        _take(deck, section, found)
        if section.name not in MESH:
            others[section.name] = None
    if not found.coordinates or not found.elements.count:
        missing = "*ELEMENT" if found.coordinates else "*NODE"
        raise FormatError(f"no {missing} is in this file: it is cut off, or no Abaqus or CalculiX deck with a mesh")
    points, slots = found.points(deck)
    cells = found.connectivity(deck)
    node_sets, element_sets, held = _sets(deck, found, cells)
    regions, names = _regions(deck, found, element_sets, len(cells.sizes))
    blocks, _ = table_blocks(cells.kinds, cells.codes, cells.sizes, cells.nodes, regions, {})
    region_names = {
        (block.dimension, region): names[region]
        for block in blocks
        for region in np.unique(block.regions).tolist()
        if block.dimension is not None and region in names
    }
    sets = node_sets.by_name()
    for told, members in element_sets.by_name({*sets, *names.values()}).items():
        sets[told] = sorted_unique(cells.nodes_of(members))
    for number, (key, nodes) in enumerate(held.items(), len(names) + 1):
        blocks.append(CellBlock("vertex", nodes[:, None], np.full(len(nodes), number)))
        region_names[0, number] = key
    unread = [f"the keyword *{key}" for key in others] + found.nodes.uncounted()
    return Parsed(points, blocks, slots, region_names, unread=unread, node_sets=sets, rounding=of_abaqus(points))


def _take(deck: Deck, section: Section, found: Contents) -> None:
    if section.name == "NODE":
        found.take_nodes(deck, section)
    elif section.name == "ELEMENT":
        found.take_elements(deck, section)
    elif section.name in ("NSET", "ELSET", *KEYWORDS) or _gives_regions(section):
        found.later.append((found.scopes.of(section), section))


def _gives_regions(section: Section) -> bool:
    return section.name.endswith("SECTION") and bool(section.get("ELSET"))


def _sets(deck: Deck, found: Contents, cells: Connectivity) -> tuple[Sets, Sets, dict[str, Ints]]:
    """The sets of nodes, those of elements, and the nodes that keywords hold, by keyword."""
    nodes, elements, held = Sets(found.nodes), Sets(found.elements), dict[str, Ints]()
    records = {part.section.at: part for part in found.cells}
    for scope, section in found.later:
        key, label = section.name, section.get("NSET" if section.name in ("NODE", "NSET") else "ELSET")
        if key == "NODE":
            starts = deck.rows(section).column(0)
            nodes.add(scope, label, found.nodes.places(deck, scope, starts, deck.text.integers(starts)))
        elif key == "ELEMENT":
            part = records[section.at]
            elements.add(scope, label, np.arange(part.first, part.first + len(part.sizes)))
        elif key in ("NSET", "ELSET"):
            sets = nodes if key == "NSET" else elements
            if not label:
                deck.text.fail(section.at, f"this set has no name: {key}= is missing")
            if key == "NSET" and section.get("ELSET"):
                members = cells.nodes_of(_named(deck, found, elements, section))
            else:
                members = sets.read(deck, found.scopes, scope, section)
            sets.add(found.scopes.of(section) if key == "NODE" else scope, label, members)
        elif key in KEYWORDS:
            members = named_nodes(deck, found.scopes, scope, section, nodes)
            if len(members):
                held[key] = np.union1d(held.get(key, members), members)
    return nodes, elements, held


def _named(deck: Deck, found: Contents, elements: Sets, section: Section) -> Ints:
    """The elements of the set that a section names by ELSET=."""
    scope = next(scope for scope, other in found.later if other is section)
    members = elements.named(found.scopes, scope, section.get("ELSET"))
    if members is None:
        deck.text.fail(section.at, f"no set of elements is called {section.get('ELSET')[:24]!r} in this file")
    return members


def _regions(deck: Deck, found: Contents, elements: Sets, count: int) -> tuple[Ints, dict[int, str]]:
    """(count,) the region of each cell, counted from 1, and the names of regions; 0 for cells of none."""
    regions, names, numbers = np.zeros(count, dtype=np.int64), dict[int, str](), dict[object, int]()
    chosen = [pair for pair in found.later if _gives_regions(pair[1])]
    for scope, section in chosen or [pair for pair in found.later if pair[1].name == "ELEMENT"]:
        number = numbers.setdefault((scope, section.get("ELSET").upper()), len(numbers) + 1)
        regions[_named(deck, found, elements, section)] = number
        names[number] = section.get("ELSET")
    return regions, names
