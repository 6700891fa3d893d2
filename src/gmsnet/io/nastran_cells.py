"""Which of Nastran's cards are cells, of which kind, and which name nodes that are held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.cell_table import Kind
from gmsnet.io.cells import places_of
from gmsnet.io.nastran_lines import LARGE, Bulk, Cards, Ints
from gmsnet.io.nastran_numbers import lenient, whole
from gmsnet.io.text import fail
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock

_TRIANGLE, _QUAD = {3: Kind("triangle")}, {4: Kind("quad")}
_WEDGE15 = Kind("wedge15", (*range(9), 12, 13, 14, 9, 10, 11))  # the nodes between the ends are before those on top
_HEX20 = Kind("hexahedron20", (*range(12), 16, 17, 18, 19, 12, 13, 14, 15))
_LINE = {2: Kind("line"), 1: Kind("vertex")}
# Name → the field of the first node, and the kinds by number of nodes.
CELLS: dict[str, tuple[int, dict[int, Kind]]] = {
    **dict.fromkeys(("CTRIA3", "CTRIAR", "CPLSTN3", "CPLSTS3"), (3, _TRIANGLE)),
    **dict.fromkeys(("CQUAD4", "CQUADR", "CSHEAR", "CPLSTN4", "CPLSTS4"), (3, _QUAD)),
    **dict.fromkeys(("CTRIA6", "CPLSTN6", "CPLSTS6"), (3, _TRIANGLE | {6: Kind("triangle6")})),
    **dict.fromkeys(("CQUAD8", "CPLSTN8", "CPLSTS8"), (3, _QUAD | {8: Kind("quad8")})),
    **dict.fromkeys(("CQUAD", "CQUAD9"), (3, _QUAD | {8: Kind("quad8"), 9: Kind("quad9")})),  # the second by Gmsh
    "CTRIAX6": (3, {6: Kind("triangle6", (0, 2, 4, 1, 3, 5))}),  # which goes round
    "CTETRA": (3, {4: Kind("tetra"), 10: Kind("tetra10")}),
    "CPENTA": (3, {6: Kind("wedge"), 15: _WEDGE15}),
    "CHEXA": (3, {8: Kind("hexahedron"), 20: _HEX20}),
    **dict.fromkeys(("CPYRAM", "CPYRA"), (3, {5: Kind("pyramid"), 13: Kind("pyramid13")})),
    **dict.fromkeys(("CROD", "CTUBE", "CBAR", "CBEAM", "CBUSH", "CVISC"), (3, _LINE)),
    **dict.fromkeys(("CONROD", "PLOTEL", "RBAR", "RROD"), (2, _LINE)),
}
WITHOUT_PROPERTY = ("CONROD", "PLOTEL", "RBAR", "RROD")
PROPERTIES = ("PSHELL", "PSOLID", "PCOMP", "PCOMPG", "PLPLANE", "PPLANE", "PLSOLID", "PSHEAR", "PROD", "PTUBE", "PBAR",
              "PBARL", "PBEAM", "PBEAML", "PBUSH", "PVISC")  # fmt: skip
# Cards that name nodes on purpose: those fields; None stands for all that could be one.
HELD: dict[str, tuple[int, ...] | None] = {
    **dict.fromkeys(("CONM1", "CONM2", "FORCE", "MOMENT", "FORCE1", "FORCE2"), (2,)),
    **dict.fromkeys(("SPC", "SPCD"), (2, 5)), **dict.fromkeys(("CELAS1", "CDAMP1", "CMASS1", "CELAS2", "CDAMP2",
                                                             "CMASS2"), (3, 5)),
    **dict.fromkeys(("RBE1", "RBE2", "RBE3", "MPC", "RSPLINE", "RSSCON", "RTRPLT"), None),
}  # fmt: skip
_NO_ELEMENTS = ("CORD", "CONV", "CLOAD", "CREEP", "CYAX", "CYJOIN", "CAERO", "CSCHD", "CSSCHD", "CMFREE", "CHACAB")


@dataclass(frozen=True)
class Found:
    """Cells of one card: numbers of nodes (n, nodes), 0 for none; their properties; where each card begins."""

    name: str
    nodes: Ints
    properties: Ints
    lines: Ints


def cells_of(bulk: Bulk, cards: Cards, *, with_properties: bool) -> Found:
    """The cells of cards whose name is in ``CELLS``.

    with_properties: the file has cards of properties. Then a blank field stands for the number of the element, as
    Nastran has it; else it would make a region of each cell, and stands for none.
    """
    first, kinds = CELLS[cards.name]
    columns = []
    for k in range(max(kinds)):
        starts, ends = bulk.field(cards, first + k)
        columns.append(whole(bulk, starts, ends, "the number of a node", blank=0))
    properties = np.zeros(len(cards.line), dtype=np.int64)
    number = whole(bulk, *bulk.field(cards, 1), "the number of an element")
    if cards.name not in WITHOUT_PROPERTY:
        properties = whole(bulk, *bulk.field(cards, 2), "the number of a property", blank=0)
        if with_properties:
            properties = np.where(properties == 0, number, properties)
    return Found(cards.name, np.stack(columns, axis=1), properties, cards.line)


def blocks_of(bulk: Bulk, found: Found, ids: Ints) -> list[CellBlock]:
    """The blocks of cells, those with the same number of nodes together.

    A cell of second order without some of its nodes is of no kind that is known, so it is held.
    """
    kinds, there = CELLS[found.name][1], found.nodes > 0
    blocks = []
    counts = there.sum(axis=1)
    leading = (np.cumsum(~there, axis=1) == 0).sum(axis=1)  # nodes before the first gap
    for count in np.unique(counts).tolist():
        if not count:
            line = int(found.lines[np.argmin(counts)])
            bulk.fail_at_line(line, f"{found.name} has no nodes: the card is cut off, or a line that continues it lost")
        for plain in (True, False):
            some = np.flatnonzero((counts == count) & ((leading == counts) == plain))
            if not len(some):
                continue
            kind = kinds.get(count) if plain else None
            if plain and count < min(kinds):
                bulk.fail_at_line(int(found.lines[some[0]]), f"{found.name} has {count} nodes, not {min(kinds)}: is a "
                                                             "line that continues it lost?")  # fmt: skip
            named = found.nodes[some][there[some]].reshape(len(some), count)
            nodes, bad = places_of(ids, named.ravel().copy())
            if bad >= 0:
                line = int(found.lines[some[bad // count]])
                bulk.fail_at_line(line, f"{found.name} names the node {named.flat[bad]}, but there is no such GRID")
            nodes = nodes.reshape(len(some), count)
            name = kind.name if kind else f"nastran:{found.name}"
            if kind and kind.order:
                nodes = nodes[:, list(kind.order)]
            blocks.append(CellBlock(name, nodes, found.properties[some]))
    return blocks


def held_nodes(bulk: Bulk, cards: Cards, ids: Ints) -> Ints | None:
    """The nodes that cards hold, by their places; None where the cards name no single nodes."""
    if cards.name == "SPC1":
        return _of_spc1(bulk, cards, ids)
    if cards.name in HELD:
        fields = HELD[cards.name]
    elif cards.name[:1] == "C" and cards.name not in CELLS and not cards.name.startswith(_NO_ELEMENTS):
        fields = None  # an element that is not known
    else:
        return None
    if fields is None:
        fields = tuple(range(3 if cards.name[:1] == "C" else 2, 1 + cards.per_line * int(cards.count.max())))
    if len(fields) > MOST_FIELDS:
        fail(bulk.data, int(bulk.starts[cards.line[np.argmax(cards.count)]]), f"{cards.name} goes on in more than "
                                                                             f"{MOST_FIELDS // 8} lines")  # fmt: skip
    parts = [lenient(bulk, *bulk.field(cards, field)) for field in fields]
    return _known(np.concatenate(parts), ids)


MOST_FIELDS = 80_000  # of one card


def _of_spc1(bulk: Bulk, cards: Cards, ids: Ints) -> Ints:
    """Set, components, then nodes, or first THRU last."""
    words = bulk.table(*bulk.field(cards, 4), LARGE).view(f"S{LARGE}").ravel()
    thru = np.char.upper(np.char.strip(words)) == b"THRU"
    parts = [np.empty(0, dtype=np.int64)]
    for line in np.flatnonzero(thru).tolist():
        one = Cards(cards.name, cards.line[line : line + 1], cards.count[line : line + 1], cards.large, cards.free)
        low, high = (int(whole(bulk, *bulk.field(one, k), "the number of a node")[0]) for k in (3, 5))
        parts.append(np.flatnonzero((ids >= low) & (ids <= high)))
        if len(parts) > MOST_RANGES:
            bulk.fail_at_line(int(one.line[0]), f"there are more than {MOST_RANGES} SPC1 with THRU")
    rest = cards.some(~thru)
    most = min(8 * int(rest.count.max(initial=0)), MOST_FIELDS)
    parts += [_known(lenient(bulk, *bulk.field(rest, field)), ids) for field in range(3, most + 1)]
    return sorted_unique(np.concatenate(parts))


MOST_RANGES = 1000


def _known(numbers: Ints, ids: Ints) -> Ints:
    """The places of those numbers that are nodes."""
    order = np.argsort(ids, kind="stable")
    at = np.searchsorted(ids, numbers, sorter=order).clip(max=len(ids) - 1)
    found: NDArray[np.int64] = sorted_unique(order[at[ids[order[at]] == numbers]])
    return found
