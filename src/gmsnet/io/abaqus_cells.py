"""Nodes and elements of an Abaqus deck, as its sections list them one after another."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import nodes_of
from gmsnet.errors import FormatError
from gmsnet.io.abaqus_deck import Deck, Section
from gmsnet.io.abaqus_scopes import Scope, Scopes
from gmsnet.io.abaqus_sets import Ints, Numbers
from gmsnet.io.abaqus_types import LEAST, kind_of
from gmsnet.io.cell_table import Kind
from gmsnet.io.cells import joined
from gmsnet.io.fields import short_in_abaqus
from gmsnet.io.places import ranges
from gmsnet.io.splice import TextSlots
from gmsnet.io.text import Starts

MOST_COORDINATES = 6  # of a row of *NODE: x, y, z and the cosines of a normal


@dataclass
class Elements:
    """The records of one ``*ELEMENT``: the tokens and numbers of all nodes, how many each cell has, and the type."""

    scope: Scope
    section: Section
    starts: Starts
    nodes: Ints
    sizes: Ints
    type: str
    first: int  # the place of the first of these cells among all


@dataclass
class Contents:
    """What the sections of a deck add up to, in their order.

    coordinates: the tokens of each ``*NODE``. later: the sections that name nodes and elements, which may follow them.
    """

    scopes: Scopes = field(default_factory=Scopes)
    nodes: Numbers = field(default_factory=lambda: Numbers("node"))
    elements: Numbers = field(default_factory=lambda: Numbers("element"))
    coordinates: list[Starts] = field(default_factory=list)
    cells: list[Elements] = field(default_factory=list)
    later: list[tuple[Scope, Section]] = field(default_factory=list)

    def take_nodes(self, deck: Deck, section: Section) -> None:
        """The rows of ``*NODE``: a number and two or three coordinates, as many in all rows of the file."""
        rows = deck.full_rows(section)
        if not len(rows):
            return
        width = self.coordinates[0].shape[1] if self.coordinates else 3 if rows.lengths[0] > 3 else 2
        least, most = (4, 1 + MOST_COORDINATES) if width == 3 else (3, 3)
        if len(bad := np.flatnonzero((rows.lengths < least) | (rows.lengths > most))):
            told = f"a node takes a number and {width} coordinates in this file, found {rows.lengths[bad[0]]} numbers"
            deck.text.fail(rows.where(int(bad[0])), f"{told}: write all of them")
        done = sum(map(len, self.coordinates))
        self.nodes.add(self.scopes.of(section), deck.text.integers(rows.column(0)), done)
        self.coordinates.append(rows.columns(1, width))
        self._name(section, "NSET")

    def take_elements(self, deck: Deck, section: Section) -> None:
        """The records of ``*ELEMENT``: a number, then the nodes."""
        told = section.get("TYPE").upper()
        if not told:
            deck.text.fail(section.at, "*ELEMENT without TYPE=")
        kind = kind_of(told)
        if kind is not None and _leaves_out(deck, section, kind):
            told, kind = f"{told} with fewer nodes", None
        if kind is not None:
            table = deck.records(section, 1 + nodes_of(kind.name))
            starts, sizes = table.reshape(-1), np.full(len(table), table.shape[1])
        else:
            starts, sizes = deck.continued_records(section)
            if (sizes < 2).any():
                deck.text.fail(section.at, f"an element of type {told[:24]!r} has no nodes")
        values, heads = deck.text.integers(starts), np.cumsum(sizes) - sizes
        first = sum(len(part.sizes) for part in self.cells[-1:]) + (self.cells[-1].first if self.cells else 0)
        scope = self.scopes.of(section)
        self.elements.add(scope, values[heads], first)
        nodes, tokens = np.delete(values, heads), np.delete(starts, heads)
        self.cells.append(Elements(scope, section, tokens, nodes, sizes - 1, told, first))
        self._name(section, "ELSET")

    def _name(self, section: Section, parameter: str) -> None:
        if section.get(parameter):
            self.later.append((self.scopes.of(section), section))

    def points(self, deck: Deck) -> tuple[NDArray[np.float64], TextSlots]:
        """The coordinates of all nodes, and where they stand. Raises FormatError for a number that is given twice."""
        starts = joined(self.coordinates)
        points, ends = deck.text.spans(starts)
        if (twice := self.nodes.repeated()) >= 0:
            deck.text.fail(int(starts[twice, 0]), "the number of this node was given to another one before")
        return points, TextSlots(starts, ends, keep=short_in_abaqus)

    def connectivity(self, deck: Deck) -> Connectivity:
        """The nodes of all cells by their places. Raises FormatError for a number that is not there, or twice."""
        codes: dict[str, int] = {}
        parts = []
        for part in self.cells:
            code = codes.setdefault(part.type, len(codes))
            nodes = self.nodes.places(deck, part.scope, part.starts, part.nodes)
            parts.append((nodes, np.full(len(part.sizes), code), part.sizes))
        if (twice := self.elements.repeated()) >= 0:
            raise FormatError(f"element {twice} (counted from 0) has a number that another one had before")
        kinds = {code: kind_of(told) or Kind(f"abaqus:{told}"[:32]) for told, code in codes.items()}
        nodes, all_codes, sizes = (joined([part[k] for part in parts]) for k in range(3))
        return Connectivity(kinds, all_codes, sizes, nodes)


def _leaves_out(deck: Deck, section: Section, kind: Kind) -> bool:
    """Whether some cells of a section lack nodes that their kind may lack."""
    if kind.name not in LEAST:
        return False
    _, sizes = deck.continued_records(section)
    return bool(((sizes > LEAST[kind.name]) & (sizes <= nodes_of(kind.name))).any())


@dataclass(frozen=True)
class Connectivity:
    """All cells: ``kinds[codes[k]]`` is the kind of cell k, which has the next ``sizes[k]`` of ``nodes``."""

    kinds: dict[int, Kind]
    codes: Ints
    sizes: Ints
    nodes: Ints

    def nodes_of(self, cells: Ints) -> Ints:
        """The nodes of some cells, one after another."""
        return self.nodes[ranges((np.cumsum(self.sizes) - self.sizes)[cells], self.sizes[cells])]
