"""The part of a mesh that one rank smooths: the connectivity of the serial run, of its own stars and what is around.

Nodes stand in memory in the order that they have in the whole mesh, and colours are those of the whole mesh: greedy, by
global ids. A rank colours its nodes as far as their neighbours of lower ids have colours, and tells others, until all
have one. So each star is judged and moved by the same operations as in the serial run, and every bit is the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.rail import Rail
from gmsnet.distributed.along import Along
from gmsnet.distributed.ghosts import Surrounded, owners_beside
from gmsnet.distributed.halo import Halo
from gmsnet.distributed.library import mpi
from gmsnet.distributed.numbering import Numbers, before
from gmsnet.distributed.winding import Winding
from gmsnet.kernels.jit.compile import LANES
from gmsnet.kernels.simplex.mean_ratio2 import Simplices
from gmsnet.kernels.simplex.mean_ratio3 import Tetrahedra
from gmsnet.kernels.star.constraint import Constraint
from gmsnet.kernels.star.shell_simplices import ShellSimplices
from gmsnet.kernels.topology.layout import morton_codes
from gmsnet.kernels.topology.places import places_in
from gmsnet.kernels.topology.ready import colour_ready, waits_for_others
from gmsnet.measure.report import connectivity_of
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.mixed_volume import volume_of
from gmsnet.topology.ordering import planar_points, space_points, taken
from gmsnet.topology.solids import WoundSolids
from gmsnet.topology.stars import Colouring, Ints
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.topology.wound import Wound

Floats = NDArray[np.float64]
Rows = Simplices | Tetrahedra | ShellSimplices
Flags = NDArray[np.bool_]
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Known(Colouring):
    """Colours that are known. known: (N,) by places in memory, −1 where no node is free."""

    known: Ints

    @property
    def colours(self) -> Ints:
        """See Colouring."""
        return self.known


@dataclass(frozen=True, eq=False)
class Part:
    """What a rank has of the mesh, nodes by ascending global ids.

    mesh: its cells, and those around. topology: with the nodes free that it moves. points: in memory order. codes: (n,)
    places on the curve, in memory order. moves: (n,) by places in memory, the nodes that this rank has to move or hold.
    own_rows: of ``topology.simplices``, those of its own cells: each cell is one rank's.
    forth: the cells of the whole mesh are read forwards. along: what nodes of the mesh slide on, if any do or it is a
    surface in space; rail: the same, and where these nodes are on it.
    """

    comm: Any
    around: Surrounded
    mesh: Mesh
    topology: Topology | Volume
    points: Floats
    halo: Halo
    codes: Ids
    moves: Flags
    own_rows: Ints
    forth: bool
    along: Along | None = None
    rail: Rail | None = None

    @classmethod
    def of(
        cls, around: Surrounded, mesh: Mesh, comm: Any, along: Along | None, wound: Wound | WoundSolids | None = None
    ) -> Part:
        """Of what a rank has and what lies around, ``mesh`` as a part of the mesh of all; wound: its volumes."""
        ids = around.nodes.ids
        moves = around.nodes.owner == comm.rank
        if wound is None:
            topology = connected(mesh, around.nodes.held_on(comm.rank), ids, around.numbers, along)
        else:
            topology = volume_of(wound, None if along is None else along.slides_at(ids))
        near = taken(planar_points(mesh) if mesh.plane else space_points(mesh), topology.memory)
        halo = around.halo(comm, topology.places)
        topology = _coloured(comm, topology, halo)
        if along is not None:
            topology = along.holding_others(topology, ids)
        rail = None if along is None else along.at(topology, ids, moves[topology.memory])
        if isinstance(rail, Constraint):
            halo.sliding(topology.colouring.colours, topology.colouring.fewest, rail.row)
        codes = np.empty(len(near), dtype=np.int64)
        morton_codes(near, mesh.box, codes)
        own = np.concatenate([*around.own, np.empty(0, dtype=bool)])
        rows = np.arange(len(topology.simplices.rows), dtype=np.int32)
        own_rows = rows[own[topology.cells_of(rows.astype(np.intp))]]
        forth = bool(comm.allreduce(bool(Winding.of(topology).forth), mpi().LOR))
        return cls(
            comm, around, mesh, topology, near, halo, codes, moves[topology.memory], own_rows, forth, along, rail
        )  # fmt: skip

    @property
    def own_cells(self) -> Flags:
        """(C,) which cells of ``mesh`` are its own."""
        return np.concatenate([*self.around.own, np.empty(0, dtype=bool)])

    @property
    def simplices(self) -> Rows:
        """Those of its own cells."""
        return self.topology.simplices.take(self.own_rows)

    def numbered(self, chosen: Flags) -> Ids:
        """The places of some nodes that this rank moves, among all that ranks choose, in memory order.

        chosen: (n,) by places in memory.
        """
        own = np.flatnonzero(self.moves)
        ids = self.around.nodes.ids[self.topology.memory]
        found = before(self.comm, self.codes[own], ids[own], chosen[own].astype(np.int64))
        return found[chosen[own]]

    def ready(self, topology: Topology | Volume) -> tuple[Topology | Volume, Numbers]:
        """The connectivity as a run wants it, and the numbers that its cells have in the whole mesh.

        topology: this one, or with more nodes held.
        ``changeable`` stands in the blocks of the whole mesh, as far as their cells have a node that this rank moves;
        the rest of a block are repetitions. ``scored`` are those of its own cells.
        """
        free = self.halo.spread(topology.near_free)
        rows, numbers = self._blocks(topology, free)
        movable = _of_whole_cells(topology.simplices, _with_a_free_node(topology.simplices, free))
        scored = self.own_rows[movable[self.own_rows]]
        found = replace(topology)
        found.__dict__.update(changeable=topology.simplices.take(rows), scored=topology.simplices.take(scored))
        return found, numbers

    def _blocks(self, topology: Topology | Volume, free: Flags) -> tuple[Ints, Numbers]:
        """The rows of ``changeable``, and their numbers.

        free: (n,) by places in memory, the nodes that any rank moves.
        """
        simplices = topology.simplices
        chosen = np.flatnonzero(_with_a_free_node(simplices, free)).astype(np.int32)
        cell = chosen if simplices.cells is None else simplices.cells[chosen]
        _, begin, size = np.unique(cell, return_index=True, return_counts=True)  # rows of a cell stand together
        begin, size = begin.astype(np.int64), size.astype(np.int64)
        lowest = lowest_of(simplices)[chosen[begin]] if len(chosen) else np.empty(0, dtype=np.int64)
        own = np.flatnonzero(self.moves)
        counts = np.bincount(lowest, size, minlength=len(self.codes)).astype(np.int64)
        first = np.zeros(len(self.codes), dtype=np.int64)
        ids = self.around.nodes.ids[topology.memory]
        first[own] = before(self.comm, self.codes[own], ids[own], counts[own])
        within = np.concatenate([[0], np.cumsum(size)])[:-1]
        starts = np.flatnonzero(np.diff(lowest, prepend=-1) != 0)  # cells stand by their first node
        within -= np.repeat(within[starts], np.diff(np.append(starts, len(lowest)))) if len(starts) else 0
        place = first[lowest] + within
        known = answers = self.moves[lowest]
        place, known = self._told(topology, chosen[begin] if len(chosen) else chosen, place, known)
        row_place = np.repeat(place, size) + _counted(size)
        row_known = np.repeat(known, size)
        rows, blocks, at, first_of = _aligned(row_place[row_known])
        counted = np.repeat(answers, size)[row_known][rows] & first_of
        return chosen[row_known][rows], Numbers(blocks, at, counted, int(np.count_nonzero(answers)))

    def _told(self, topology: Topology | Volume, rows: Ints, place: Ids, known: Flags) -> tuple[Ids, Flags]:
        """The places of cells, one row each, whose first node another rank moves: it tells those who move another."""
        number = self.around.numbers[topology.cells_of(rows.astype(np.intp))]
        ranks = self.around.nodes.owner[topology.memory]
        simplices = topology.simplices
        solids = simplices.solids if isinstance(simplices, Tetrahedra) else None
        if solids is not None and simplices.cells is not None:
            nodes = solids.nodes[simplices.cells[rows]]
        elif simplices.cells is not None:  # the corners of a quad: those of its first two rows
            second = np.minimum(rows + 1, len(simplices.rows) - 1)
            same = simplices.cells[second] == simplices.cells[rows]
            nodes = np.hstack([simplices.rows[rows], simplices.rows[np.where(same, second, rows)]])
        else:
            nodes = simplices.rows[rows]
        mine = np.flatnonzero(known)
        parcels = [
            (number[mine[chosen]], place[mine[chosen]]) for chosen in owners_beside(ranks[nodes[mine]], self.comm)
        ]
        came = self.comm.alltoall(parcels)
        told, where = (np.concatenate(each) for each in zip(*came, strict=True))
        if len(told):
            order = np.argsort(told)
            at = np.minimum(places_in(told[order], number), len(told) - 1)
            found = told[order][at] == number
            place, known = np.where(found, where[order][at], place), known | found
        return place, known


def connected(mesh: Mesh, held: Flags, ids: Ids, numbers: Ids, along: Along | None) -> Topology | Volume:
    """The connectivity of some cells. ids, numbers: see ``Along.connectivity``."""
    return connectivity_of(mesh, held) if along is None else along.connectivity(mesh, held, ids, numbers)


def _coloured(comm: Any, topology: Topology | Volume, halo: Halo) -> Topology | Volume:
    """The same with the colours of the whole mesh, as many as there are of them."""
    places, free = topology.colouring.places, halo.spread(topology.near_free)
    colours = np.full(len(free), -1, dtype=np.int32)
    start, ring, own = topology.colouring.start, topology.colouring.ring, np.zeros(len(free), dtype=bool)
    own[places] = True
    given, waits = (start, ring, topology.memory, free), np.empty(len(places), dtype=bool)
    waits_for_others(places, own, *given, waits)
    taken = np.full(int(np.diff(start)[places].max(initial=0)) + 1, -1, dtype=np.int64)
    waiting, found, left = places, np.empty_like(places), len(places)
    while True:
        left -= colour_ready(waiting, own, *given, colours, taken, found)
        halo.renew(colours)
        if not comm.allreduce(left):
            break
        waiting = places[waits] if waiting is places else waiting
        waiting = waiting[colours[waiting] < 0]
    count = int(comm.allreduce(int(colours.max(initial=-1)) + 1, mpi().MAX))
    axes = 2 if isinstance(topology, Topology) and topology.plane is not None else 3
    halo.coloured(colours, count, axes)
    return replace(topology, colouring=Known(places, start, ring, colours, fewest=count))


def _with_a_free_node(simplices: Rows, free: Flags) -> Flags:
    """(S,) bool, the rows that have a free node, in space all rows of a cell that has one."""
    if isinstance(simplices, Tetrahedra) and simplices.solids is not None:
        of_cell: Flags = np.asarray(free[simplices.solids.nodes].any(axis=1))
        return of_cell[simplices.cells]
    found: Flags = np.asarray(free[simplices.rows].any(axis=1))
    return _of_whole_cells(simplices, found) if isinstance(simplices, ShellSimplices) else found


def _of_whole_cells(simplices: Rows, chosen: Flags) -> Flags:
    """(S,) bool, the rows of the cells that have a chosen row."""
    if simplices.cells is None:
        return chosen
    cells = np.zeros(int(simplices.cells.max(initial=-1)) + 1, dtype=bool)
    cells[np.asarray(simplices.cells)[chosen]] = True
    return np.asarray(cells[simplices.cells])


def lowest_of(simplices: Rows) -> Ids:
    """(S,) the lowest place in memory among the nodes of the cell of each row."""
    if isinstance(simplices, Tetrahedra) and simplices.solids is not None:
        found: Ids = simplices.solids.nodes.min(axis=1).astype(np.int64)[simplices.cells]
        return found
    low: Ids = simplices.rows.min(axis=1).astype(np.int64)
    if simplices.cells is None:
        return low
    of_cell = np.full(int(simplices.cells.max(initial=-1)) + 1, np.iinfo(np.int64).max)
    np.minimum.at(of_cell, simplices.cells, low)
    return of_cell[simplices.cells]


def _counted(size: Ids) -> Ids:
    """0, 1, 2, … for each of so many."""
    return np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)


def _aligned(place: Ids) -> tuple[NDArray[np.intp], Ids, Ids, Flags]:
    """Rows at some places in blocks of LANES, where the last of a block stands for those that are not there.

    Returns which row stands where, the numbers of the blocks, the place of each, and which are no repetitions.
    """
    order = np.argsort(place)
    numbers, begin, size = np.unique(place[order] // LANES, return_index=True, return_counts=True)
    lane = np.minimum(np.arange(LANES), size[:, None] - 1)
    rows = order[(begin[:, None] + lane).reshape(-1)]
    return rows, numbers, place[rows], (lane == np.arange(LANES)).reshape(-1)
