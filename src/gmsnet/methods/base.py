"""What a smoother is: it proposes shifts; the guard in the kernels alone moves nodes."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gmsnet.kernels.star.block import Blocks, Visit
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.star.guard import (
    STAR,
    VALID,
    WORST,
    Guard,
    MeshGuard,
    Precision,
    StarGuard,
    plain_guard,
    star_floors,
)
from gmsnet.kernels.star.guard3 import star_floors3
from gmsnet.kernels.star.shell import ShellBlocks, ShellStars
from gmsnet.kernels.star.shell_simplices import star_floors_of_shell
from gmsnet.kernels.star.space_blocks import SpaceBlocks
from gmsnet.kernels.star.surface import Surface
from gmsnet.methods.floor import Floor
from gmsnet.parallel.executor import Executor
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.shell import Shell
from gmsnet.topology.stars import Stars
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

CELLS = ("triangle", "quad")  # the kinds of cells whose nodes may move
ALL_CELLS = (*CELLS, "tetra", "hexahedron", "wedge", "pyramid")
TRIANGLES = ("triangle",)
Tally = NDArray[np.int64]  # (3,) counts of moved, truncated and dropped shifts (kernels.star.stars)


@dataclass(eq=False)
class Field:
    """What is smoothed. points: (N, 2) in memory order, changed in place by the guard alone; of volumes (N, 4).

    level: of the guard.
    """

    points: NDArray[np.float64]
    topology: Topology | Volume
    precision: Precision
    level: int = VALID
    floor: Floor = field(default_factory=Floor)
    constraint: Constraint | Surface | None = None

    @property
    def planar(self) -> Topology:
        """The topology of a mesh in a plane, for what is done in a plane alone."""
        assert isinstance(self.topology, Topology)
        assert not isinstance(self.topology, Shell)
        return self.topology

    def written(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (N, 2) as the file will keep them, where they are others than those of the field."""
        if not self.precision.single:
            return points
        return np.where(points == self.points, points, self.precision.rounded(points))

    def guard(self, executor: Executor) -> Guard:
        """What must be kept from now on, with the floors of the level as the points are. To be asked for per sweep."""
        if isinstance(self.topology, MixedVolume):
            self.topology.lend_slack(self)
        if self.level == WORST:
            floor = self.floor.of(self.points, self.topology, self.precision, executor)
            return MeshGuard(*self.precision, floor, self.constraint)
        guard = plain_guard(self.precision, self.constraint)
        if self.level == STAR:
            floors = np.empty(len(self.points))
            ringed = self.topology.near_ringed
            of_stars = star_floors3 if isinstance(self.topology, Volume) else star_floors
            of_stars = star_floors_of_shell if isinstance(self.topology, Shell) else of_stars
            of_stars(self.points, self.topology.changeable, ringed, guard.unit, guard.grain, floors)
            executor.exchange(floors)
            return StarGuard(*guard, floors)
        return guard


class Smoother(ABC):
    """A method ready for one run.

    settled: it has its own rule when to stop, and that has come true. reached: so has the target that it was made for.
    looks: the mesh is worth measuring after the last sweep. stops_when_idle: a sweep that moved nothing is the last,
    and the run ends after many without a gain; else ``converged`` alone tells. shared_out: each rank can do the same
    with a part of the mesh (gmsnet.distributed), else one does all. phase: what of the method the last sweep was, ""
    for methods of one phase.
    """

    converged = False
    target_reached = False
    looks = True
    stops_when_idle = True
    shared_out = False
    phase = ""

    @abstractmethod
    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """Visits the mesh once: about as many shifts as there are free nodes. Returns what happened to them.

        executor: runs kernels on ranges, on threads where that pays, and is told where a colour ends. test: measures
        the mesh as it stands, keeps it if it is the best so far, and tells whether it is; for methods that look more
        often than after each sweep.
        """


class StarSmoother(Smoother):
    """A method that looks at one star at a time: a sweep visits colour after colour."""

    shared_out = True

    @property
    def in_plane(self) -> Visit | None:
        """What visits stars in a plane in this sweep; None where ``visit`` says it otherwise."""
        return None

    def visit(
        self, points: NDArray[np.float64], blocks: Blocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """Visits the stars of the blocks first…last, all of one colour, once; without the GIL. Adds to the tally."""
        if self.in_plane is None:
            raise NotImplementedError
        kernel, arguments, _ = self.in_plane
        kernel(points, blocks, first, last, guard, *arguments, tally)

    def in_space(self, guard: Guard) -> Visit | None:
        """What visits stars in space in this sweep, of methods that have "tetra" among their cells."""
        return None

    def visit_in_space(
        self, points: NDArray[np.float64], blocks: SpaceBlocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """As ``visit``, of stars in space."""
        if (visit := self.in_space(guard)) is None:
            raise NotImplementedError
        visit.kernel(points, blocks, first, last, guard, *visit.arguments, tally)

    def visit_on_surface(
        self, points: NDArray[np.float64], stars: ShellStars, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """The same of stars of a surface in space, of methods that are for surfaces."""
        raise NotImplementedError

    @property
    def in_lanes(self) -> bool:
        """Are stars of surfaces of triangles visited in blocks?"""
        return False

    def visit_in_lanes(
        self, points: NDArray[np.float64], lanes: ShellBlocks, first: int, last: int, guard: Guard, tally: Tally
    ) -> None:
        """The same in blocks, of methods with ``in_lanes``."""
        raise NotImplementedError

    def sweep(self, field: Field, executor: Executor, test: Callable[[], bool]) -> Tally:
        """See Smoother."""
        stars, guard = self._stars(field), field.guard(executor)
        blocks = stars.blocks

        def visit(first: int, last: int) -> Tally:
            counts = np.zeros(3, dtype=np.int64)
            if isinstance(blocks, SpaceBlocks):
                self.visit_in_space(field.points, blocks, first, last, guard, counts)
            elif isinstance(blocks, ShellBlocks):
                self.visit_in_lanes(field.points, blocks, first, last, guard, counts)
            elif isinstance(blocks, ShellStars):
                self.visit_on_surface(field.points, blocks, first, last, guard, counts)
            else:
                self.visit(field.points, blocks, first, last, guard, counts)
            return counts

        own = self.in_space(guard) if isinstance(blocks, SpaceBlocks) else None
        own = self.in_plane if isinstance(blocks, Blocks) else own
        tally = None if own is None else executor.swept(own, stars, field.points, guard)
        if tally is None:
            tally = by_colour(executor, visit, stars, field.points)
        field.floor.swept(tally)
        return tally

    def _stars(self, field: Field) -> Stars:
        """Those that a sweep visits. At the level STAR moves are judged star by star anyway."""
        topology = field.topology
        if self.in_lanes and isinstance(topology, Shell) and field.level != STAR:
            return topology.in_lanes or topology.stars
        return topology.stars


def by_colour(
    executor: Executor, visit: Callable[[int, int], Tally], stars: Stars, points: NDArray[np.float64]
) -> Tally:
    """Visits the blocks of all stars, colour after colour, and adds up what happened to their shifts."""
    if executor.sequential:  # colour after colour, too: in that order the blocks stand
        return sum(executor.map(visit, 0, int(stars.first[-1])), np.zeros(3, dtype=np.int64))
    tally = np.zeros(3, dtype=np.int64)
    for colour in range(stars.colours):
        tally += sum(executor.map(visit, int(stars.first[colour]), int(stars.first[colour + 1])))
        executor.after_colour(colour, points)
    return executor.total(tally)


def over_stars(
    visit: Callable[[SpaceBlocks, int, int, Tally], None], stars: Stars, points: NDArray[np.float64], executor: Executor
) -> Tally:
    """The same over some stars in space, by what visits a range of blocks and adds to a tally."""
    blocks = stars.blocks
    assert isinstance(blocks, SpaceBlocks)

    def counted(first: int, last: int) -> Tally:
        counts = np.zeros(3, dtype=np.int64)
        visit(blocks, first, last, counts)
        return counts

    return by_colour(executor, counted, stars, points)


@dataclass(frozen=True)
class MethodOptions:
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

    variants, objectives: the names that may be chosen from, the default first. weighted: it takes weights. cells: the
    kinds of cells whose nodes it moves; limits: of objectives or variants with which it moves fewer kinds, those.
    slides: it can let nodes slide along curves. surfaces: it moves nodes of surfaces in space.
    """

    name: str
    summary: str
    source: str
    create: Callable[[MethodOptions], Smoother]
    variants: tuple[str, ...] = ()
    objectives: tuple[str, ...] = ()
    weighted: bool = False
    slides: bool = False
    surfaces: bool = False
    cells: tuple[str, ...] = CELLS
    limits: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False)

    def moves(self, kind: str, choice: str | None = None) -> bool:
        """Does it move the nodes of cells of this kind, with this objective or variant (None: the default one)?"""
        return kind in self.limits.get(choice or self.default, self.cells)

    def moves_surfaces(self, choice: str | None = None) -> bool:
        """Does it move nodes of surfaces in space, with this objective or variant?"""
        return self.surfaces and (choice or self.default) not in self.limits

    @property
    def default(self) -> str:
        """The objective, or else the variant, that is used if none is chosen; "" where there are none."""
        return (*self.objectives, *self.variants, "")[0]
