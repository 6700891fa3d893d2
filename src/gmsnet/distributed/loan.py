"""What ranks smooth for others: cells around some nodes, or all cells on the first rank, and where the nodes go then.

What follows one another, as the visits to the worst cells do, goes by global ids. So it comes to the same wherever the
cells are, if the stars are whole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.rail import Rail
from gmsnet.distributed.along import put_on, where_on
from gmsnet.distributed.library import mpi
from gmsnet.distributed.part import Known, Part, connected
from gmsnet.distributed.patch_ranks import patch_ranks
from gmsnet.distributed.piece import Ids
from gmsnet.distributed.winding import Winding
from gmsnet.kernels.topology.places import places_in
from gmsnet.kernels.topology.sorted_unique import sorted_unique
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
    """ids: of each rank those that this rank has sent it. field: what came here, None where nothing did; all: the ids
    of its nodes. sent: those of each rank.
    """

    ids: list[Ids]
    field: Field | None = None
    all: Ids | None = None
    sent: list[Ids] | None = None

    def at_nodes(self, part: Part, values: Floats) -> Floats:
        """Values (n,) of a rank, in memory order, in that of the field here; none where there is none."""
        came = part.comm.alltoall([values[places] for places in self._places(part)])
        found = np.empty(0 if self.all is None else len(self.all))
        if self.field is None or self.all is None or self.sent is None:
            return found
        for ids, some in zip(self.sent, came, strict=True):
            found[places_in(self.all, ids)] = some
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
        found: NDArray[np.int32] = self.field.topology.places[places_in(self.all, ids[once])]
        return found

    def cells_back(self, part: Part, corners: NDArray[np.int32]) -> NDArray[np.int32]:
        """Cells (K, k) of the gathered field, by places in memory there: those of them that this rank has, in its."""
        ids = None
        if self.field is not None and self.all is not None:
            ids = self.all[self.field.topology.memory[corners]]
        ids, known = part.comm.bcast(ids), part.around.nodes.ids
        here = ids[np.isin(ids, known).all(axis=1)]
        found: NDArray[np.int32] = part.topology.places[places_in(known, here)]
        return found

    def _places(self, part: Part) -> list[NDArray[np.int32]]:
        """In memory, of the nodes that were sent to each rank."""
        return [part.topology.places[places_in(part.around.nodes.ids, ids)] for ids in self.ids]

    def _back(self, part: Part, values: Floats | None) -> list[Floats]:
        """Values of the nodes of the field, by id, to the ranks that have sent them: what comes from each rank."""
        parcels: list[Any] = [()] * part.comm.size
        if values is not None and self.all is not None and self.sent is not None:
            parcels = [values[places_in(self.all, ids)] for ids in self.sent]
        came: list[Floats] = part.comm.alltoall(parcels)
        return came

    def give_back(self, part: Part, points: Floats) -> None:
        """The points of what came to each rank go back. points: (n, …) of a rank, in memory order."""
        found = None if self.field is None else self.field.points[self.field.topology.places]
        for places, came in zip(self._places(part), self._back(part, found), strict=True):
            if len(places):
                points[places] = came
        for axis in range(points.shape[1]):  # to those, too, that have sent no cell of a node
            points[:, axis] = part.halo.spread(points[:, axis])
        if part.rail is not None:
            self._slid_back(part, part.rail)

    def _slid_back(self, part: Part, rail: Rail) -> None:
        """So do the places on the rail, of the nodes that were free to move: of others only their rank knows them."""
        found = None
        if self.field is not None:
            assert self.field.constraint is not None
            topology = self.field.topology
            found = np.where(topology.near_free, where_on(self.field.constraint), np.nan)[topology.places]
        now = where_on(rail)
        for places, came in zip(self._places(part), self._back(part, found), strict=True):
            known = ~np.isnan(np.asarray(came, dtype=np.float64))
            now[places[known]] = np.asarray(came)[known]
        put_on(rail, part.halo.spread(now))


def gathered_field(part: Part, field: Field, active: Flags | None) -> Loan:
    """What is smoothed, with all cells at the active nodes of all ranks, which alone are free, on the first rank.

    All ranks call it. active: (N,) by places in memory, of the nodes that are free here; None for the whole mesh.
    """
    return _exchanged(part, field, {0: active})


def dealt_field(part: Part, field: Field, active: Flags) -> Loan:
    """The same, dealt out: nodes that hang together go to one rank, with all cells at them."""
    ranks = patch_ranks(part, field.topology, active)
    return _exchanged(part, field, {rank: ranks == rank for rank in sorted_unique(ranks[active]).tolist()})


def _exchanged(part: Part, field: Field, active: Mapping[int, Flags | None]) -> Loan:
    """active: rank → the nodes that this rank sends it, with all cells at them; None for the whole mesh."""
    starred = part.halo.spread(field.topology.near_ringed)
    parcels = [_parcel(part, field, active[k], starred) if k in active else None for k in range(part.comm.size)]
    sent = [part.around.nodes.ids[:0] if parcel is None else parcel.ids for parcel in parcels]
    found = part.comm.alltoall(parcels)
    came = [parcel for parcel in found if parcel is not None]
    if not came:
        return Loan(sent)
    ids, first = np.unique(np.concatenate([each.ids for each in came]), return_index=True)
    places, points = (np.concatenate([each[k] for each in came])[first] for k in (1, 2))
    moves = np.zeros(len(ids), dtype=bool)
    for each in came:
        moves[places_in(ids, each.ids[each.moves])] = True
    blocks, all_numbers = [], [ids[:0]]
    starts = np.cumsum([0, *part.around.sizes])
    for kind, cells in zip(_lent(part), zip(*(each.cells for each in came), strict=True), strict=True):
        nodes, numbers, regions = (np.concatenate(each) for each in zip(*cells, strict=True))
        _, once = np.unique(numbers, return_index=True)
        all_numbers.append(starts[kind[0]] + numbers[once])
        nodes = places_in(ids, nodes[once])
        blocks.append(CellBlock(kind[1], nodes, regions[once]))
    whole = part.mesh
    assert whole.box is not None
    mesh = Mesh(places, tuple(blocks), single=whole.single).as_part(
        whole.plane, whole.kinds_there, whole.exponent, whole.exact, whole.box
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
            where[places_in(ids, each.ids[each.moves])] = each.where[each.moves]
        put_on(rail, where[topology.memory])
    lent = Field(points, topology, field.precision, field.level, constraint=rail)
    return Loan(sent, lent, ids, [ids[:0] if parcel is None else parcel.ids for parcel in found])


def read_alike(part: Part, field: Field, active: Flags | None, *, dealt: bool = False) -> Loan:
    """The same, gathered or dealt out, with all cells read as in the whole mesh.

    Where cells of the input are inverted, some that are cut off from others may be read the other way round: then the
    whole mesh is gathered.
    """
    if active is None:
        return gathered_field(part, field, None)
    loan = dealt_field(part, field, active) if dealt else gathered_field(part, field, active)
    otherwise = loan.field is not None and not Winding.of(loan.field.topology).reads(forth=part.forth)
    return gathered_field(part, field, None) if part.comm.allreduce(bool(otherwise), mpi().LOR) else loan


def _lent(part: Part) -> list[tuple[int, str]]:
    """Which blocks have cells that move, or lines, on which nodes slide inside of a region; and their kinds."""
    kinds = enumerate(block.kind for block in part.around.blocks)
    return [(k, kind) for k, kind in kinds if kind in (KINDS if part.mesh.has_volumes else (*PLANAR, "line"))]


def _parcel(part: Part, field: Field, active: Flags | None, starred: Flags) -> Parcel:
    """What this rank brings: all cells at the active nodes; of the whole mesh, its own. starred: (n,), as of Parcel."""
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
    colours = topology.colouring.colours[near]
    where = np.zeros(len(near)) if part.rail is None else where_on(part.rail)[near]
    return Parcel(
        ids[used], part.mesh.points[used], field.points[near], moves[used], starred[near], colours, where, cells
    )


def around(part: Part, topology: Topology | Volume, chosen: Flags, rings: int) -> Flags:
    """(n,) by places in memory: the free nodes of this rank within so many rings of the chosen ones of all ranks."""
    chosen = chosen.copy()
    for _ in range(rings):
        chosen = part.halo.spread(chosen)
        chosen[topology.near[topology.rows_at(chosen)]] = True
    return part.halo.spread(chosen) & topology.near_free
