"""Sets of nodes and elements of an Abaqus deck: lists of numbers and of other sets, and ranges of numbers."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.abaqus_deck import Deck, Section
from gmsnet.io.abaqus_scopes import TOP, Scope, Scopes
from gmsnet.io.cells import counted, first_repeated, joined, places_of
from gmsnet.io.text import Starts, Text
from gmsnet.kernels.topology.sorted_unique import sorted_unique

Ints = NDArray[np.int64]
MOST_IN_STEPS = 50  # members of ranges with a step, for each that there is: the ranges must not be each other


class Numbers:
    """What a scope numbers: ids as the file has them, and the place of each in the mesh. what: for messages."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.parts: dict[Scope, list[tuple[Ints, int]]] = {}
        self.tables: dict[Scope, tuple[Ints, Ints]] = {}

    def add(self, scope: Scope, ids: Ints, first: int) -> None:
        """The ids of some more, the first of which has the place ``first``."""
        self.parts.setdefault(scope, []).append((ids, first))

    def table(self, scope: Scope) -> tuple[Ints, Ints]:
        """(n,) the ids of a scope and their places, as they are in the file; where one scope has all, those of that."""
        scope = next(iter(self.parts)) if len(self.parts) == 1 else scope
        if scope not in self.tables:
            parts = self.parts.get(scope, [])
            places = [np.arange(first, first + len(ids)) for ids, first in parts]
            self.tables[scope] = joined([ids for ids, _ in parts]), joined(places)
        return self.tables[scope]

    @property
    def count(self) -> int:
        """How many there are in all scopes."""
        return sum(len(ids) for parts in self.parts.values() for ids, _ in parts)

    def uncounted(self) -> list[str]:
        """That the numbers are others than 1, 2, 3, … in one scope, if they are."""
        if len(self.parts) == 1 and all(counted(self.table(scope)[0], 1) for scope in self.parts):
            return []
        return [f"the numbers of {self.what}s, which begin elsewhere, have gaps or another order"]

    def repeated(self) -> int:
        """The place of one whose number its scope has twice, or -1."""
        for scope in self.parts:
            ids, places = self.table(scope)
            if (twice := first_repeated(ids)) >= 0:
                return int(places[twice])
        return -1

    def places(self, deck: Deck, scope: Scope, starts: Starts, numbers: Ints) -> Ints:
        """The places of numbers. Raises FormatError, naming the line, for one that is not there."""
        ids, places = self.table(scope)
        if not numbers.size:
            return numbers
        found, bad = places_of(ids, numbers.copy())
        if bad >= 0:
            told = f"the {self.what} {numbers[bad]} is named here, but there is none of that number"
            deck.text.fail(int(starts.reshape(-1)[bad]), told)
        return places[found]

    def ranges(self, deck: Deck, scope: Scope, section: Section) -> Ints:
        """The places that rows of first, last and step mean, of those that there are."""
        rows = deck.full_rows(section)
        if len(bad := np.flatnonzero((rows.lengths < 2) | (rows.lengths > 3))):
            deck.text.fail(rows.where(int(bad[0])), "GENERATE takes first, last and step: two or three numbers")
        low, high = deck.text.integers(rows.column(0)), deck.text.integers(rows.column(1))
        step = np.ones(len(rows), dtype=np.int64)
        some = rows.lengths == 3
        step[some] = deck.text.integers(rows.starts[rows.first[:-1][some] + 2])
        if len(bad := np.flatnonzero(step < 1)):
            deck.text.fail(rows.where(int(bad[0])), f"the step is {step[bad[0]]}: it must be 1 or more")
        ids, places = self.table(scope)
        order = np.argsort(ids, kind="stable")
        known = ids[order]
        begin, end = np.searchsorted(known, low), np.searchsorted(known, high, side="right")
        end = np.maximum(begin, end)
        chosen = np.zeros(len(ids) + 1, dtype=np.int64)
        np.add.at(chosen, begin[step == 1], 1)
        np.add.at(chosen, end[step == 1], -1)
        inside = np.cumsum(chosen)[:-1] > 0
        if int((end - begin)[step > 1].sum()) > MOST_IN_STEPS * (len(ids) + 1):
            deck.text.fail(section.at, f"the ranges of *{section.name} name the same numbers again and again")
        for k in np.flatnonzero(step > 1).tolist():
            some_ids = slice(int(begin[k]), int(end[k]))
            inside[some_ids] |= (known[some_ids] - low[k]) % step[k] == 0
        return places[order[inside]]


def numeric(text: Text, starts: Starts) -> NDArray[np.bool_]:
    """(n,) whether tokens begin with a digit: then they are numbers, for names begin with a letter."""
    first = text.raw[starts] if len(starts) else np.empty(0, dtype=np.uint8)
    digits: NDArray[np.bool_] = (first >= ord("0")) & (first <= ord("9"))
    return digits


class Sets:
    """The sets of nodes or of elements, by scope and name in capitals; members: places in the mesh."""

    def __init__(self, numbers: Numbers) -> None:
        self.numbers = numbers
        self.found: dict[tuple[Scope, str], list[Ints]] = {}
        self.shown: dict[tuple[Scope, str], str] = {}

    def add(self, scope: Scope, name: str, members: Ints) -> None:
        """Puts members into a set, which may be there already."""
        key = scope, name.upper()
        if len(members) > self.numbers.count:  # sets of sets may name each of them again and again
            members = sorted_unique(members)
        self.found.setdefault(key, []).append(members)
        self.shown.setdefault(key, name)

    def get(self, scope: Scope, name: str) -> Ints | None:
        """The members of a set so far; None where there is none of that name."""
        parts = self.found.get((scope, name.upper()))
        if parts is None:
            return None
        if len(parts) > 1:
            parts[:] = [np.concatenate(parts)]
        return parts[0]

    def named(self, scopes: Scopes, scope: Scope, word: str) -> Ints | None:
        """The members of what a word of the file names: a set of this scope or, as ``INSTANCE.name``, of another.

        Outside of parts it may be any set whose name is there once. None where there is no such set.
        """
        if (own := self.get(scope, word)) is not None:
            return own
        instance, dot, name = word.partition(".")
        if dot and instance.upper() in scopes.of_instance:
            return self.get(scopes.named(instance), name)
        others = [key for key, name in self.found if name == word.upper()] if scope == TOP else []
        return self.get(others[0], word) if len(others) == 1 else None

    def read(self, deck: Deck, scopes: Scopes, scope: Scope, section: Section) -> Ints:
        """The members that a section lists."""
        if "GENERATE" in section.parameters:
            return self.numbers.ranges(deck, scope, section)
        return self.listed(deck, scopes, scope, deck.rows(section).starts)

    def listed(self, deck: Deck, scopes: Scopes, scope: Scope, starts: Starts) -> Ints:
        """The members that tokens name: numbers, and sets. Raises FormatError for what is not there."""
        digits = numeric(deck.text, starts)
        parts = [self.numbers.places(deck, scope, starts[digits], deck.text.integers(starts[digits]))]
        for start in starts[~digits].tolist():
            word = deck.text.token(start).decode("utf-8", "backslashreplace").strip('"')
            members = self.named(scopes, scope, word)
            if members is None:
                deck.text.fail(start, f"no set of {self.numbers.what}s is called {deck.text.word(start)} before here")
            parts.append(members)
        return np.concatenate(parts)

    def by_name(self, others: Iterable[str] = ()) -> dict[str, Ints]:
        """Name → members of all sets, those of one name in several scopes together; but for the ``others``."""
        out: dict[str, list[Ints]] = {}
        for key, name in self.shown.items():
            members = self.get(*key)
            if name not in others and members is not None and len(members):
                out.setdefault(name, []).append(members)
        return {name: sorted_unique(np.concatenate(parts)) for name, parts in out.items()}
