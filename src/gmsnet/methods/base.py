"""What a smoother is: it proposes shifts; the guard in the kernels alone moves nodes."""

from __future__ import annotations

import math
import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.block import Blocks
from gmsnet.kernels.compile import LANES
from gmsnet.kernels.guard import STAR, VALID, WORST, Guard, Precision, StarGuard, most_ratios, plain_guard, star_floors
from gmsnet.topology import Topology
from gmsnet.workers import Share, serial

Tally = NDArray[np.int64]  # (3,) counts of moved, truncated and dropped shifts (kernels.stars)


@dataclass(eq=False)
class Field:
    """What is smoothed. points: (N, 2) in memory order, changed in place by the guard alone. level: of the guard."""

    points: NDArray[np.float64]
    topology: Topology
    precision: Precision
    level: int = VALID
    floor: Floor = field(default_factory=lambda: Floor())

    def guard(self, share: Share) -> Guard:
        """What must be kept from now on, with the floors of the level as the points are. To be asked for per sweep."""
        guard = plain_guard(self.precision)
        if self.level == WORST:
            floor = self.floor.of(self.points, self.topology, self.precision, share)
            return guard._replace(floor=floor)
        if self.level == STAR:
            floors = np.empty(len(self.points))
            triangles, turn = self.topology.changeable
            star_floors(self.points, triangles, turn, self.topology.near_ringed, guard.unit, guard.grain, floors)
            return StarGuard(*guard, floors)
        return guard


class Floor:
    """The floor of the level WORST. Any cell's D/L is an upper bound of the worst one's, and so a floor that keeps it.

    Which blocks of triangles hold the worst changes slowly. Therefore all are looked at only every LOOKS-th time, and
    between only those that were the worst then, one in SHARE. A floor that is too high by that holds a few stars back
    until the next look at all. A method that knows the worst cells can name them instead (``watch``).
    """

    LOOKS, SHARE, FEWEST = 4, 16, 64
    WATCHED = 64  # cells

    def __init__(self) -> None:
        self.asked = 0
        self.blocks = np.empty(0, dtype=np.int32)

    def watch(self, cells: NDArray[np.int32], shape: NDArray[np.floating[Any]]) -> None:
        """From now on looks at the blocks of the worst of these cells (rows of ``Topology.changeable``), by their 1/q.

        The worst of all must be among them.
        """
        few = min(self.WATCHED, len(cells)) - 1
        self.blocks = np.unique(cells[np.argpartition(shape, few)[: few + 1]] // LANES)
        self.asked = 1

    def of(self, points: NDArray[np.float64], topology: Topology, precision: Precision, share: Share) -> float:
        """An upper bound of the least D/L of the triangles with a free node, as the points are now."""
        triangles, turn = topology.changeable
        count = -(-len(triangles) // LANES)
        everywhere = self.asked % self.LOOKS == 0
        self.asked += 1
        blocks = np.arange(count, dtype=np.int32) if everywhere else self.blocks
        least = np.empty(len(blocks))

        def look(first: int, last: int) -> None:
            most_ratios(points, triangles, turn, blocks, precision.unit, precision.grain, first, last, least)

        share(look, 0, len(blocks))
        if everywhere:
            worst = max(self.FEWEST, count // self.SHARE)
            self.blocks = blocks if worst >= count else np.sort(np.argpartition(least, worst)[:worst]).astype(np.int32)
        return float(least.min(initial=math.inf))


class Smoother(ABC):
    """A method ready for one run.

    settled: it has its own rule when to stop, and that has come true. reached: so has the target that it was made for.
    looks: the mesh is worth measuring after the last sweep. idle_ends: a sweep that moved nothing is the last. stage:
    what of the method the last sweep was, "" for methods of one stage.
    """

    settled = False
    reached = False
    looks = True
    idle_ends = True
    stage = ""

    @abstractmethod
    def sweep(self, field: Field, share: Share, test: Callable[[], bool]) -> Tally:
        """Visits the mesh once: about as many shifts as there are free nodes. Returns what happened to them.

        share: runs kernels on ranges, on threads where that pays. test: measures the mesh as it stands, keeps it if it
        is the best so far, and tells whether it is; for methods that look more often than after each sweep.
        """


class StarSmoother(Smoother):
    """A method that looks at one star at a time: a sweep visits colour after colour."""

    @abstractmethod
    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """Visits the stars of the blocks first…last, all of one colour, once; without the GIL. Adds to the tally."""

    def sweep(self, field: Field, share: Share, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        stars, guard, tally = field.topology.stars, field.guard(share), np.zeros(3, dtype=np.int64)

        def visit(first: int, last: int) -> Tally:
            counts = np.zeros(3, dtype=np.int64)
            self.visit(field.points, stars.blocks, first, last, guard, counts)
            return counts

        if share is serial:  # colour after colour, too: in that order the blocks stand
            return visit(0, int(stars.first[-1]))
        for colour in range(stars.colours):
            tally += sum(share(visit, int(stars.first[colour]), int(stars.first[colour + 1])))
        return tally


@dataclass(frozen=True)
class Options:
    """What a user may tell a method.

    variant, objective: one of those that the method has, or "" where it has none. weights: a safetensors file instead
    of the shipped one.
    """

    variant: str = ""
    objective: str = ""
    weights: str | os.PathLike[str] | None = None
    seed: int = 0


@dataclass(frozen=True)
class Method:
    """A row of the table of methods.

    variants, objectives: the names that may be chosen from, the default first. weighted: it takes weights.
    """

    name: str
    summary: str
    source: str
    create: Callable[[Options], Smoother]
    variants: tuple[str, ...] = ()
    objectives: tuple[str, ...] = ()
    weighted: bool = False
