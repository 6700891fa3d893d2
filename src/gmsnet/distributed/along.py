"""What nodes slide on, over ranks: the first one finds it, and all have it.

It looks at the whole mesh, or at the cells at the boundary of volumes (distributed/skin.py).

Its shape is one for all ranks, while each has the places of its own nodes on it. On a surface in space it tells also on
which side each cell shows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.rail import Rail, positions_on
from gmsnet.constraints.shell import FEATURE
from gmsnet.constraints.sliding import Sliding
from gmsnet.constraints.sliding_in_space import SurfaceSliding
from gmsnet.distributed.agreement import raise_everywhere
from gmsnet.distributed.gathered import Whole, brought
from gmsnet.distributed.piece import Ids, Piece
from gmsnet.distributed.winding import Winding
from gmsnet.errors import GmsnetError
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.star.surface import Surface
from gmsnet.kernels.topology.places import places_in
from gmsnet.measure.judged import Judged
from gmsnet.measure.report import measure
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.measure.worst import Place, places_of, unmet
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods import Smoother
from gmsnet.parallel.threads import serial
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import bound_note, compared_of, greatest_angle, ranking
from gmsnet.run.set_up import first_state
from gmsnet.run.state import State
from gmsnet.topology.mixed_volume import volume_of, wound_of
from gmsnet.topology.ordering import near_points
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


# The totals of a mesh, how many cells miss the target, the greatest angle where that has one, by what it was compared,
# and the worst cells of a RankResult.
Figures = tuple[Totals | None, int | None, float, Judged, tuple[Place, ...]]


@dataclass(frozen=True, eq=False)
class Along:
    """What nodes of the whole mesh slide on.

    rail: it, without the nodes; None where none slides. ids: (R,) the global id of the node of each of its rows;
    slides: (R,) bool, which of them do. ring: (M, 2) of a Surface, by global ids. linked: the stars in a plane, or of a
    surface, are told by links. sides: of a surface (C, 3) float32, the vector n of each cell of the mesh.
    """

    rail: Rail | None
    ids: Ids
    slides: Flags
    ring: Ids
    linked: bool
    sides: NDArray[np.float32] | None

    @classmethod
    def of(cls, base: Topology | Volume, sliding: Any, ids: Ids) -> Along:
        """Of what nodes of the whole mesh slide on. ids: (N,) of its nodes, ascending."""
        linked = isinstance(base, Topology) and base.patterns is not None
        sides = None
        if isinstance(base, Shell):
            cells = base.cells_of(np.arange(len(base.near), dtype=np.intp))
            sides = np.zeros((int(cells.max(initial=-1)) + 1, 3), dtype=np.float32)
            sides[cells] = base.near_side
        rail = None if sliding is None else sliding.constraint
        if rail is None or not isinstance(sliding, Sliding | SurfaceSliding):
            nothing = np.empty(0, dtype=np.int64)
            return cls(None, nothing, nothing > 0, nothing.reshape(0, 2), linked, sides)
        at = np.flatnonzero(rail.row >= 0)
        node = np.empty(len(at), dtype=np.int64)
        node[rail.row[at]] = base.memory[at]
        ring = np.empty((0, 2), dtype=np.int64)
        if isinstance(rail, Surface):
            ring = ids[base.memory[rail.ring]]
            rail = rail._replace(ring=rail.ring[:0])
        rail = rail._replace(row=rail.row[:0])
        return cls(rail, ids[node], sliding.nodes[node], ring, linked, sides)

    def slides_at(self, ids: Ids) -> Flags:
        """(n,) bool, which of these nodes slide."""
        return np.isin(ids, self.ids[self.slides])

    def connectivity(self, mesh: Mesh, held: Flags, ids: Ids, numbers: Ids) -> Topology | Volume:
        """That of some cells. ids: (n,) of their nodes, ascending; numbers: (C,) their places among all cells."""
        slides = self.slides_at(ids)
        if mesh.has_volumes:
            return volume_of(wound_of(mesh, held), slides)
        topology = Topology.of(mesh, held, sliding=slides, linked=self.linked)
        if self.sides is None:
            return topology
        cells = topology.cells_of(np.arange(len(topology.near), dtype=np.intp))
        return Shell.made(topology, self.sides[numbers[cells]])

    def holding_others(self, topology: Topology | Volume, ids: Ids) -> Topology | Volume:
        """Of a surface, the connectivity with those nodes held that do not slide. ids: (n,) as above."""
        return topology.holding(~self.slides_at(ids), FEATURE) if isinstance(topology, Shell) else topology

    def at(self, topology: Topology | Volume, ids: Ids, moves: Flags) -> Rail | None:
        """The rail of some nodes. ids: (n,) ascending. moves: (n,) by places in memory, those whose stars are here."""
        rail = self.rail
        if rail is None:
            return None
        order = np.argsort(self.ids)
        place = np.minimum(places_in(self.ids[order], ids), len(order) - 1)
        row = np.where(self.ids[order][place] == ids, order[place], -1).astype(np.int32)[topology.memory]
        if isinstance(rail, Constraint):
            return rail._replace(row=row, parameter=rail.parameter.copy())
        here = np.zeros(len(self.ids), dtype=bool)
        here[row[moves & (row >= 0)]] = True
        count = np.diff(rail.start)
        chosen = np.repeat(here, count)
        start = np.zeros_like(rail.start)
        np.cumsum(np.where(here, count, 0), out=start[1:])
        ring = topology.places[places_in(ids, self.ring[chosen])].astype(np.int32)
        return rail._replace(row=row, place=rail.place.copy(), start=start, ring=ring, own=rail.own[chosen])


def where_on(rail: Rail) -> Floats:
    """(N,) by places in memory, where on it each node is, a parameter, facet or piece; 0 of nodes that are not."""
    found: Floats = np.where(rail.row >= 0, positions_on(rail)[rail.row], 0).astype(np.float64)
    return found


def put_on(rail: Rail, where: Floats) -> None:
    """Takes note of these (N,)."""
    on = rail.row >= 0
    positions_on(rail)[rail.row[on]] = where[on]


@dataclass(frozen=True, eq=False)
class Found:
    """What the first rank has found. why: it cannot be shared out, "" if it can. before, remarks: of the input, where
    it was seen whole. whole: what was seen; base, sliding: of it; state: of a whole mesh. These on the first rank.
    """

    along: Along
    before: Totals | None = None
    remarks: tuple[str, ...] | None = None
    why: str = ""
    whole: Whole | None = None
    base: Topology | Volume | None = None
    sliding: Any = None
    state: State | None = None

    def judged(self, points: Floats, piece: Piece, options: SmoothOptions, comm: Any) -> tuple[bool, Figures]:
        """Of a surface: is the mesh with these points (n, dim) of the piece no worse than the input? And what to say of
        the better one. All ranks call it."""
        every, told = brought(self.whole, points, piece, comm), None
        if self.state is not None and every is not None:
            before, target, topology = self.state.before, options.target, self.state.protection.base
            mesh = self.state.mesh.with_points(every)
            after, places = measure(mesh, topology), (self.state.start, near_points(mesh, topology))
            first, last = (totals_of(points, topology.scored) for points in places)
            rank = ranking(options)
            better = rank(after, last) <= rank(before, first)
            final = after if better else before
            judged = Judged(first, last if better else first)
            missed = len(target.missed_in(final)) if target else None
            worst = places_of(final, unmet(final, target))
            told = better, (final.totals, missed, greatest_angle(final, options), judged, worst)
        found: tuple[bool, Figures] = comm.bcast(told)
        return found

    def note(
        self, points: Floats, moved: Flags, where: Floats | None, options: SmoothOptions, piece: Piece, comm: Any
    ) -> list[str]:
        """What to say of nodes that have slid. points, moved: of the piece; where: (n,) likewise, see ``where_on``. All
        ranks call it."""
        chosen = np.isin(piece.ids, self.along.ids)  # no other node of the boundary moves
        on = np.zeros(len(points)) if where is None else where
        parcels, told = comm.gather((piece.ids[chosen], points[chosen], moved[chosen], on[chosen])), None
        if parcels is not None and self.whole is not None and self.base is not None:
            told = list[str]()
            if isinstance(self.sliding, Sliding | SurfaceSliding):
                before, count = self.whole.mesh.points, len(self.whole.ids)
                after, slid, on = before.copy(), np.zeros(count, dtype=bool), np.zeros(count)
                for ids, *values in parcels:
                    at = places_in(self.whole.ids, ids)
                    after[at], slid[at], on[at] = values
                if self.sliding.constraint is not None:
                    put_on(self.sliding.constraint, on[self.base.memory])
                compared = compared_of(self.sliding, before, after)
                told = [self.sliding.note(self.whole.mesh.with_points(after), slid)]
                told += bound_note(compared, options.hausdorff)
        found: list[str] = comm.bcast(told)
        return found


def found_on_first(whole: Whole | None, smoother: Smoother, options: SmoothOptions, comm: Any) -> Found:
    """What nodes slide on. whole: on the first rank. All ranks call it; InputError on all for what cannot be."""
    state, told, wrong = None, None, ""
    if whole is not None:
        try:
            state = first_state(whole.mesh, whole.fixed, smoother, replace(options, preserve="none"), serial)
        except GmsnetError as error:
            wrong = str(error)
    raise_everywhere(comm, wrong)
    if whole is not None and state is not None:
        topology = state.protection.base
        why = ""
        if isinstance(topology, Shell) and not Winding.of(topology).reads(forth=True):
            why = "cells are wound in both directions"
        elif isinstance(topology, Shell) and state.untangling:
            why = "the surface is folded over, and mended as a whole"
        told = Along.of(topology, state.sliding, whole.ids), state.before.totals, state.remarks, why
    found = Found(*comm.bcast(told))
    if state is None:
        return found
    return replace(found, whole=whole, base=state.protection.base, sliding=state.sliding, state=state)
