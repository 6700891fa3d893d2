"""What the first rank smooths for all: cells of all ranks around some nodes, or all cells, and where the nodes go then.

What follows one another, as the visits to the worst cells do, goes by global ids. So it comes to the same wherever the
cells are, if the stars are whole.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.along import Rail, put_on, where_on
from gmsnet.distributed.part import Known, Part, connected
from gmsnet.distributed.piece import Ids
from gmsnet.distributed.winding import Winding
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods.base import Field
from gmsnet.topology.solids import KINDS
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

PLANAR = "triangle", "quad"
SHARE = 0.5  # of the free nodes: where they would be more, all cells are gathered


class Parcel(NamedTuple):
    """Nodes and cells of one rank. ids: (n,). places: (n, dim) in the input, by which they are ordered. points: as they
    are, (n, 2), of volumes (n, 4). moves: (n,) bool, which are free. starred: (n,) bool, which have a star in the whole
    mesh. colours: (n,). where: (n,) on the rail, of those that slide. cells: for each block, of those that are
    meant the nodes by their ids, the numbers and the regions.
    """

    ids: Ids
    places: Floats
    points: Floats
    moves: Flags
    starred: Flags
    colours: NDArray[np.int32]
    where: Floats
    cells: list[tuple[Ids, Ids, Ids]]


class Loan(NamedTuple):
    """ids: (n,) those that this rank has sent. field: what was gathered, on the first rank; all: the ids of its nodes.

    sent: on the first rank, the ids of each rank.
    """

    ids: Ids
    field: Field | None = None
    all: Ids | None = None
    sent: list[Ids] | None = None

    def at_nodes(self, part: Part, values: Floats) -> Floats:
        """Values (n,) of a rank, in memory order, in that of the gathered field; none but on the first rank."""
        came = part.comm.gather(values[self._places(part)])
        found = np.empty(0 if self.all is None else len(self.all))
        if came is None or self.field is None or self.all is None or self.sent is None:
            return found
        for ids, some in zip(self.sent, came, strict=True):
            found[np.searchsorted(self.all, ids)] = some
        in_memory: Floats = found[self.field.topology.memory]
        return in_memory

    def cells(self, part: Part, corners: NDArray[np.int32]) -> NDArray[np.int32]:
        """Cells (K, k) of all ranks, by places in memory, in that of the gathered field, each once.

        None but on the first rank.
        """
        came = part.comm.gather(part.around.nodes.ids[part.topology.memory[corners]])
        if came is None or self.field is None or self.all is None:
            return corners[:0]
        ids = np.concatenate(came)
        _, once = np.unique(np.sort(ids, axis=1), axis=0, return_index=True)
        found: NDArray[np.int32] = self.field.topology.places[np.searchsorted(self.all, ids[once])]
        return found

    def cells_back(self, part: Part, corners: NDArray[np.int32]) -> NDArray[np.int32]:
        """Cells (K, k) of the gathered field, by places in memory there: those of them that this rank has, in its."""
        ids = None
        if self.field is not None and self.all is not None:
            ids = self.all[self.field.topology.memory[corners]]
        ids, known = part.comm.bcast(ids), part.around.nodes.ids
        here = ids[np.isin(ids, known).all(axis=1)]
        found: NDArray[np.int32] = part.topology.places[np.searchsorted(known, here)]
        return found

    def _places(self, part: Part) -> NDArray[np.int32]:
        """In memory, of the nodes that were sent."""
        return part.topology.places[np.searchsorted(part.around.nodes.ids, self.ids)]

    def give_back(self, part: Part, points: Floats) -> None:
        """The points of the gathered field go to the ranks. points: (n, …) of a rank, in memory order."""
        parcels: list[Floats] | None = None
        if self.field is not None and self.all is not None and self.sent is not None:
            found = np.empty_like(self.field.points)
            found[self.field.topology.memory] = self.field.points
            parcels = [found[np.searchsorted(self.all, ids)] for ids in self.sent]
        points[self._places(part)] = part.comm.scatter(parcels)
        for axis in range(points.shape[1]):  # to those, too, that have sent no cell of a node
            points[:, axis] = part.halo.spread(points[:, axis])
        if part.rail is not None:
            self._slid_back(part, part.rail)

    def _slid_back(self, part: Part, rail: Rail) -> None:
        """So do the places on the rail, of the nodes that were free to move: of others only their rank knows them."""
        parcels: list[Floats] | None = None
        if self.field is not None and self.all is not None and self.sent is not None:
            assert self.field.constraint is not None
            found = np.where(self.field.topology.near_free, where_on(self.field.constraint), np.nan)
            found = found[self.field.topology.places]
            parcels = [found[np.searchsorted(self.all, ids)] for ids in self.sent]
        came, now, places = part.comm.scatter(parcels), where_on(rail), self._places(part)
        known = ~np.isnan(came)
        now[places[known]] = came[known]
        put_on(rail, part.halo.spread(now))


def gathered_field(part: Part, field: Field, active: Flags | None) -> Loan:
    """What is smoothed, with all cells at the active nodes of all ranks, which alone are free. All ranks call it.

    active: (N,) by places in memory, of the nodes that are free here; None for the whole mesh.
    """
    parcel = _parcel(part, field, active)
    came = part.comm.gather(parcel)
    if came is None:
        return Loan(parcel.ids)
    ids, first = np.unique(np.concatenate([each.ids for each in came]), return_index=True)
    places, points = (np.concatenate([each[k] for each in came])[first] for k in (1, 2))
    moves = np.zeros(len(ids), dtype=bool)
    for each in came:
        moves[np.searchsorted(ids, each.ids[each.moves])] = True
    blocks, all_numbers = [], [ids[:0]]
    starts = np.cumsum([0, *part.around.sizes])
    for kind, cells in zip(_lent(part), zip(*(each.cells for each in came), strict=True), strict=True):
        nodes, numbers, regions = (np.concatenate(each) for each in zip(*cells, strict=True))
        _, once = np.unique(numbers, return_index=True)
        all_numbers.append(starts[kind[0]] + numbers[once])
        nodes = np.searchsorted(ids, nodes[once])
        blocks.append(CellBlock(kind[1], nodes, regions[once]))
    whole = part.mesh
    assert whole.box is not None
    mesh = Mesh(places, tuple(blocks), single=whole.single).as_part(
        whole.plane, whole.kinds_there, whole.exponent, whole.box
    )
    topology = connected(mesh, ~moves, ids, np.concatenate(all_numbers), part.along)
    starred, colours = (
        np.concatenate([each[k] for each in came])[first][topology.memory] for k in (4, 5)
    )  # fmt: skip
    known = topology.colouring
    colouring = Known(known.places, known.start, known.ring, colours, fewest=part.topology.colouring.fewest)
    topology, points = replace(topology, colouring=colouring, starred=starred), points[topology.memory]
    rail = None if part.along is None else part.along.at(topology, ids, moves[topology.memory])
    if rail is not None:
        where = np.concatenate([each.where for each in came])[first]
        for each in came:  # who moves a node knows where it is
            where[np.searchsorted(ids, each.ids[each.moves])] = each.where[each.moves]
        put_on(rail, where[topology.memory])
    lent = Field(points, topology, field.precision, field.level, constraint=rail)
    return Loan(parcel.ids, lent, ids, [each.ids for each in came])


def read_alike(part: Part, field: Field, active: Flags | None) -> Loan:
    """The same, with all cells read as in the whole mesh.

    Where cells of the input are inverted, some that are cut off from others may be read the other way round: then the
    whole mesh is gathered.
    """
    loan = gathered_field(part, field, active)
    if active is None or part.comm.bcast(loan.field is None or Winding.of(loan.field.topology).reads(forth=part.forth)):
        return loan
    return gathered_field(part, field, None)


def _lent(part: Part) -> list[tuple[int, str]]:
    """Which blocks have cells that move, or lines, on which nodes slide inside of a region; and their kinds."""
    kinds = enumerate(block.kind for block in part.around.blocks)
    return [(k, kind) for k, kind in kinds if kind in (KINDS if part.mesh.has_volumes else (*PLANAR, "line"))]


def _parcel(part: Part, field: Field, active: Flags | None) -> Parcel:
    """What this rank brings: all cells at the active nodes; of the whole mesh, its own."""
    topology, ids = field.topology, part.around.nodes.ids
    moves = np.zeros(len(ids), dtype=bool)
    moves[topology.memory] = topology.near_free if active is None else active
    used, cells = moves.copy(), []
    for k, _ in _lent(part):
        block, nodes = part.around.blocks[k], part.mesh.cells[k].nodes
        chosen = part.around.own[k] if active is None else moves[nodes].any(axis=1)
        used[nodes[chosen]] = True
        cells.append((block.nodes[chosen], block.numbers[chosen], block.regions[chosen]))
    near = topology.places[np.flatnonzero(used)]
    starred, colours = part.halo.spread(topology.near_ringed)[near], topology.colouring.colours[near]
    where = np.zeros(len(near)) if part.rail is None else where_on(part.rail)[near]
    return Parcel(ids[used], part.mesh.points[used], field.points[near], moves[used], starred, colours, where, cells)


def around(part: Part, topology: Topology | Volume, chosen: Flags, rings: int) -> Flags:
    """(n,) by places in memory: the free nodes of this rank within so many rings of the chosen ones of all ranks."""
    chosen = chosen.copy()
    for _ in range(rings):
        chosen = part.halo.spread(chosen)
        chosen[topology.near[topology.rows_at(chosen)]] = True
    return part.halo.spread(chosen) & topology.near_free
