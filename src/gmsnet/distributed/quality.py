"""How good the cells of a mesh are that is spread over ranks: the figures of one process, formed by all of them."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS as TABLE
from gmsnet.distributed.agreement import raise_everywhere
from gmsnet.distributed.executor import Ranks
from gmsnet.distributed.frame import framed
from gmsnet.distributed.gathered import gathered
from gmsnet.distributed.ghosts import surrounded
from gmsnet.distributed.library import mpi
from gmsnet.distributed.part import Part
from gmsnet.distributed.piece import Piece
from gmsnet.distributed.readied import not_plain
from gmsnet.distributed.told import counts_of
from gmsnet.errors import GmsnetError
from gmsnet.measure.defects import DEFECTS, UNMATCHED, defects_of, in_words
from gmsnet.measure.overview import Overview
from gmsnet.measure.report import QualityReport, measure
from gmsnet.measure.solids import PLURAL, MeasuredSolids
from gmsnet.measure.summary import measures_of, of_solids, qhats
from gmsnet.measure.totals import Totals, totals_of
from gmsnet.measure.worst import NAMED, WORST, described
from gmsnet.mesh.cell_block import counted_in_words
from gmsnet.mesh.display import amount
from gmsnet.methods.base import CELLS
from gmsnet.topology.solids import KINDS

Floats = NDArray[np.float64]

SURFACE = "surfaces are measured whole"
NOTHING = "there are no cells to measure"
REPEATED = "cells that name a node twice are measured whole"
TURNED = "cells are inside out in the file"


def measured(piece: Piece, comm: Any, threshold: float | None = None) -> Overview:
    """What ``Overview.of`` says of the mesh of all pieces; called by all ranks alike. threshold: of 1/q or η.

    What is not shared out the first rank measures. Raises InputError on all ranks alike.
    """
    around, counts = surrounded(piece, comm), counts_of(piece, comm)
    others = sorted({*counts} - {*CELLS, *KINDS, "line", "vertex"})
    if others:
        return _on_first(piece, comm, threshold, f"cells of the kind {', '.join(others)} are not shared out")
    mesh = framed(comm, around.mesh(piece))
    if mesh.plane is None and not mesh.has_volumes:
        return _on_first(piece, comm, threshold, SURFACE)
    part = Part.of(around, mesh, comm, None)
    try:
        before = totals_of(part.points, part.simplices, Ranks(part))
        if before is None:
            return _on_first(piece, comm, threshold, NOTHING)
        own, kinds = _Own(part, before), KINDS if mesh.has_volumes else CELLS
        why = not_plain(part, before) or own.not_plain(sum(counts[kind] for kind in counts if kind in kinds))
        return _on_first(piece, comm, threshold, why) if why else _of_parts(own, counts, before, threshold)
    finally:
        part.halo.free()


def _on_first(piece: Piece, comm: Any, threshold: float | None, why: str) -> Overview:
    whole, wrong, found = gathered(piece, comm), "", None
    if whole is not None:
        try:
            found = Overview.of(whole.mesh, measure(whole.mesh), threshold, why)
        except GmsnetError as error:
            wrong = str(error)
    raise_everywhere(comm, wrong)
    told: Overview = comm.bcast(found)
    return told


class _Own:
    """The measures of a rank's own cells."""

    def __init__(self, part: Part, totals: Totals) -> None:
        self.part, self.comm = part, part.comm
        self.report: QualityReport = measure(part.mesh, part.topology, part.points, totals=totals)
        self.rows = np.flatnonzero(part.own_cells[self.report.cell])

    def not_plain(self, cells: int) -> str:
        """Why the cells cannot be measured part by part, "" if they can. cells: how many there are of the mesh."""
        if self.comm.allreduce(len(self.rows)) != cells:
            return REPEATED
        found = self.report.cells
        turned = isinstance(found, MeasuredSolids) and bool(found.turned)
        return TURNED if self.comm.allreduce(turned, mpi().LOR) else ""

    def column(self, name: str) -> Floats:
        """(C,) by its name."""
        found: Floats = getattr(self.report, name)[self.rows]
        return found

    def number(self, flags: NDArray[np.bool_]) -> int:
        """How many of the cells of all ranks are flagged."""
        return int(self.comm.allreduce(int(np.count_nonzero(flags))))

    def worst(self, count: int) -> list[dict[str, Any]]:
        """See ``worst_cells``."""
        rows = self.rows[np.argsort(self.column("shape"), kind="stable")[:count]]
        mine = described(self.part.mesh, self.report, rows)
        for cell in mine:
            cell["cell"] = int(self.part.around.numbers[cell["cell"]])
        every = sorted(chain(*self.comm.allgather(mine)), key=lambda cell: (cell["shape"], cell["cell"]))
        return every[:count]

    def named(self, cells: NDArray[np.int64]) -> tuple[int, list[int]]:
        """How many cells of all ranks, and the lowest of their numbers. cells: of the part, others among them."""
        mine = np.sort(self.part.around.numbers[cells[self.part.own_cells[cells]]])
        came = self.comm.allgather((len(mine), mine[:NAMED].tolist()))
        return sum(count for count, _ in came), sorted(chain(*(numbers for _, numbers in came)))[:NAMED]


def _of_parts(own: _Own, counts: dict[str, int], totals: Totals, threshold: float | None) -> Overview:
    """counts: kind → how many cells the mesh has."""
    part, comm = own.part, own.comm
    cells, shape = own.report.cells, own.column("shape")
    measured = [kind for kind in counts if kind in (KINDS if part.mesh.has_volumes else CELLS)]
    triangles = not part.mesh.has_volumes and "quad" not in measured
    figures: dict[str, Any] = {} if part.mesh.has_volumes else {"triangles": 0}
    for kind in measured:
        figures[f"{kind}s" if kind in CELLS else PLURAL[TABLE[kind].corners or 0]] = counts[kind]
    figures["inverted"] = own.number(~own.report.valid[own.rows])
    remarks, solids = list[str](), bool(set(measured) - {"tetra", *CELLS})
    known = None if solids else totals
    figures |= measures_of(cells.names, known, own.column, triangles=triangles, over=Ranks(part))
    if solids:
        of_all = _of_solids(own)
        figures |= of_all
        remarks = in_words({what: (found["count"], found["cells"]) for what, found in of_all["defects"].items()})
    few = 0 if threshold is None else own.number(shape < threshold)
    below = [cell["cell"] for cell in own.worst(min(few, NAMED))] if few else []
    nodes = int(comm.allreduce(int(part.moves.sum())))
    told = ", ".join([amount(nodes, "node"), *counted_in_words(counts)])
    return Overview(
        nodes=nodes, planar=part.mesh.plane is not None, volumes=part.mesh.has_volumes,
        told=told, cells=sum(counts[kind] for kind in measured),
        figures={**figures, **qhats(totals)} if triangles else figures, worst=own.worst(WORST), below=(few, below),
        remarks=tuple(remarks),
    )  # fmt: skip


def _of_solids(own: _Own) -> dict[str, Any]:
    """See ``of_solids``: here no cell is read inside out, and no facets do not match."""
    cells, nothing = own.report.cells, np.empty(0, dtype=np.int64)
    solids = isinstance(cells, MeasuredSolids)  # a rank may have tetrahedra alone
    undecided = own.number((own.report.sign == 0)[own.rows] & solids)
    inside = own.number(np.isin(own.rows, cells.invalid_inside if isinstance(cells, MeasuredSolids) else nothing))
    mine = defects_of(cells) if isinstance(cells, MeasuredSolids) else {}
    defects = {what: own.named(mine.get(what, nothing)) for what in DEFECTS if what != UNMATCHED}
    return of_solids(undecided, inside, {}, {what: found for what, found in defects.items() if found[0]})
