"""What all ranks know together of their parts: which nodes are held, which cells miss a target or are not measured."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from typing import Any

import numpy as np

from gmsnet.distributed.library import mpi
from gmsnet.distributed.part import Part
from gmsnet.distributed.piece import Piece
from gmsnet.kernels.topology.connectivity import CHOSEN
from gmsnet.measure.report import QualityReport
from gmsnet.measure.worst import NAMED, Place, places_of, unmet
from gmsnet.mesh.known_cells import unmoved
from gmsnet.run.options import SmoothOptions
from gmsnet.run.remarks import NOT_MEASURED, held_anyway_note, inside_out_note, repeating, without_effect
from gmsnet.topology.held import REASONS
from gmsnet.topology.mixed_volume import MixedVolume
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume


def counts_of(piece: Piece, comm: Any) -> dict[str, int]:
    """Kind → how many cells the mesh has, of kinds with any."""
    found: dict[str, int] = {}
    for block in piece.blocks:
        found[block.kind] = found.get(block.kind, 0) + int(comm.allreduce(len(block.nodes)))
    return {kind: count for kind, count in found.items() if count}


def held(part: Part, topology: Topology | Volume) -> dict[str, int]:
    """Reason → how many nodes of the mesh, the first reason that applies to each."""
    own = part.around.nodes.owner == part.comm.rank
    mine = {reason: int(np.count_nonzero(own[ids])) for reason, ids in topology.held.items()}
    found: dict[str, int] = {}
    for each in part.comm.allgather(mine):
        for reason, number in each.items():
            found[reason] = found.get(reason, 0) + number
    return {reason: number for reason, number in found.items() if number}


def remarks(part: Part, counts: Mapping[str, int], options: SmoothOptions) -> list[str]:
    """What there is to say before a run. counts: kind → how many cells the mesh has."""
    nodes, topology, comm = part.around.nodes, part.topology, part.comm
    asked = int(comm.allreduce(int(np.count_nonzero(nodes.fixed & (nodes.owner == comm.rank)))))
    said = [] if REASONS[CHOSEN] in held(part, topology) else held_anyway_note(asked, "", options.slides)
    if isinstance(topology, Volume):
        others = [unmoved(counts)]
        if isinstance(topology, MixedVolume):
            own = part.own_cells[topology.cell]
            others.append(repeating(counts, int(comm.allreduce(int(np.count_nonzero(own))))))
            said += inside_out_note(comm.allreduce(topology.inside_out(own)))
        left_out = ", ".join(filter(None, others))
        said += [NOT_MEASURED + left_out] if left_out else []
    return [*said, *without_effect(options, isinstance(topology, Volume))]


def worst_of(part: Part, report: QualityReport, options: SmoothOptions) -> tuple[Place, ...]:
    """Of the cells of all ranks that are inverted or miss the target the worst ones. report: of the part."""
    rows = unmet(report, options.target)
    places = places_of(report, rows[part.own_cells[report.cell[rows]]])
    own = [each._replace(cell=int(part.around.numbers[each.cell])) for each in places]
    return tuple(sorted(chain(*part.comm.allgather(own)))[:NAMED])


def missing(part: Part, report: QualityReport, options: SmoothOptions) -> tuple[int, float]:
    """How many cells of all ranks miss the target, and the least 1/q among them. report: of the part."""
    rows, shape = options.target.missed_with_shapes(report)
    own = part.own_cells[report.cell[rows]]
    count = int(part.comm.allreduce(int(np.count_nonzero(own))))
    return count, float(part.comm.allreduce(float(shape[own].min(initial=np.inf)), mpi().MIN))
