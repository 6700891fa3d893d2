"""Nodes that a load, a support or an equation of an Abaqus deck names: they are where they are on purpose."""

from __future__ import annotations

import numpy as np

from gmsnet.io.abaqus_deck import Deck, Section
from gmsnet.io.abaqus_scopes import Scope, Scopes
from gmsnet.io.abaqus_sets import Ints, Sets, numeric
from gmsnet.io.text import Starts
from gmsnet.kernels.topology.sorted_unique import sorted_unique

KEYWORDS = ("BOUNDARY", "CLOAD", "CFLUX", "EQUATION", "MPC")


def named_nodes(deck: Deck, scopes: Scopes, scope: Scope, section: Section, sets: Sets) -> Ints:
    """The nodes that a section of one of ``KEYWORDS`` names by number, by ``INSTANCE.number`` or in a set.

    A set of all nodes says nothing of a place. Raises FormatError for what is not there.
    """
    starts = _words(deck, section)
    by_number = numeric(deck.text, starts) & ~np.array(
        [b"." in deck.text.token(s) for s in starts.tolist()], dtype=bool
    )
    plain = starts[by_number]
    parts = [sets.numbers.places(deck, scope, plain, deck.text.integers(plain))]
    for start in starts[~by_number].tolist():
        word = deck.text.token(start).decode("utf-8", "backslashreplace").strip('"')
        instance, _, number = word.partition(".")
        if number.isdigit() and number.isascii():
            one = np.array([int(number[:18])])
            parts.append(sets.numbers.places(deck, scopes.named(instance), np.array([start]), one))
        elif (members := sets.named(scopes, scope, word)) is None:
            deck.text.fail(start, f"no set of nodes is called {deck.text.word(start)} before here")
        elif len(sorted_unique(members)) < sets.numbers.count:
            parts.append(members)
    return sorted_unique(np.concatenate(parts))


def _words(deck: Deck, section: Section) -> Starts:
    """The tokens that name nodes: the first of each row; of *MPC all others; of *EQUATION every third of the terms."""
    rows = deck.rows(section)
    if section.name == "MPC":
        return np.delete(rows.starts, rows.first[:-1])
    if section.name == "EQUATION":  # a row with how many terms there are, then node, degree of freedom and factor
        return rows.starts[np.repeat(rows.lengths > 1, rows.lengths)][::3]
    return rows.starts[rows.first[:-1]]
