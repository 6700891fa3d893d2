"""smooth() and quality() over ranks: what codes call whose mesh is spread over a cluster."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.distributed.agreement import agreed, everywhere
from gmsnet.distributed.by_rank import by_rank
from gmsnet.distributed.library import mpi
from gmsnet.distributed.piece import Cells, Piece
from gmsnet.distributed.quality import measured
from gmsnet.distributed.result import RankResult
from gmsnet.distributed.smoothing import smoothed
from gmsnet.errors import InputError
from gmsnet.measure.overview import Overview
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.arrays import whole_numbers
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.selection import fixed_mask
from gmsnet.run.options import SmoothOptions

SAME = "all ranks have given the same cells: each cell of the mesh belongs to one rank, so give each its own part"
ONE_RANK = "each cell of the mesh belongs to one rank, so leave out ghost cells, or give all cells numbers"


def smooth(
    mesh: Any, ids: Any, method: str = "auto", *, numbers: Any = None, fixed: Any = None, comm: Any = None,
    **options: Any,
) -> RankResult:  # fmt: skip
    """Smooths a mesh that is spread over the ranks of a communicator; all ranks call it.

    The result has the same bits as ``gmsnet.smooth`` of the whole mesh, for any number of ranks and any partition.

    mesh: the cells of this rank, each cell of the mesh on one rank, and their nodes: anything that ``gmsnet.smooth``
    takes. ids: (n,) the global id of each of its nodes. numbers: for each kind of cells, (C,) the place of each cell
    among all of that kind; without, those of rank 0 come first. Places decide between cells at one node, and so may
    change bits. fixed: nodes of this rank to be held, as for ``gmsnet.smooth``; a node is held if any rank says so.
    comm: an mpi4py communicator (default: all ranks). method, options: as for ``gmsnet.smooth``, the same on all ranks.

    What is not shared out is done by the first rank, which needs memory for the whole mesh then; ``gathered`` of the
    result says why. Raises InputError on all ranks where pieces do not fit together, and MissingExtraError without
    mpi4py.
    """
    comm = mpi().COMM_WORLD if comm is None else comm
    asked = everywhere(comm, lambda: SmoothOptions(method=method, **options))
    agreed(comm, asked.asked, "the options")
    return smoothed(_own_piece(mesh, ids, numbers, fixed, comm), asked, comm)


def quality(mesh: Any, ids: Any, *, numbers: Any = None, threshold: float | None = None, comm: Any = None) -> Overview:
    """How good the cells of a mesh are that is spread over the ranks of a communicator; all ranks call it.

    mesh, ids, numbers, comm: as of ``smooth``. threshold: of 1/q, or η; cells below it are counted, and the worst of
    them named. Figures, and the numbers of the worst cells, are those of ``gmsnet.quality`` of the whole mesh. What is
    not shared out the first rank measures, and ``gathered`` says why. Raises as ``smooth``.
    """
    comm = mpi().COMM_WORLD if comm is None else comm
    threshold = agreed(comm, everywhere(comm, lambda: _threshold(threshold)), "the threshold")
    return measured(_own_piece(mesh, ids, numbers, None, comm), comm, threshold)


def _own_piece(mesh: Any, ids: Any, numbers: Any, fixed: Any, comm: Any) -> Piece:
    """What a rank gives, checked on all of them. Raises InputError on all alike."""
    given = everywhere(comm, lambda: _given(mesh, ids, fixed))
    numbered, counted = _numbered(comm, given[0], numbers)
    return _checked(everywhere(comm, lambda: _piece(*given, numbered)), counted, comm)


def _given(mesh: Any, ids: Any, fixed: Any) -> tuple[Mesh, Any, Any]:
    """The mesh, its ids and a mask of its fixed nodes."""
    found = to_mesh(mesh)[0]
    return found, whole_numbers(ids, "the global ids of nodes"), fixed_mask(found, fixed)


Numbered = Sequence[tuple[str, int, Any]]


def _numbered(comm: Any, mesh: Mesh, numbers: Any) -> tuple[Numbered, set[str]]:
    """The kinds of cells over all ranks, how many nodes each has, and the numbers of those that are here.

    And which kinds have been given no numbers, but are counted.
    """
    own: dict[str, int] = {}
    for block in mesh.cells:
        own[block.kind] = own.get(block.kind, 0) + len(block.nodes)
    width = {block.kind: block.nodes.shape[1] for block in mesh.cells}
    kinds: dict[str, int] = {}
    for each in comm.allgather(width):
        kinds |= each
    found, counted = [], set[str]()
    given = numbers if isinstance(numbers, Mapping) else {} if numbers is None else dict.fromkeys(own, numbers)
    for kind, nodes in kinds.items():
        count = own.get(kind, 0)
        first = comm.exscan(count) or 0
        some = comm.allreduce(kind in given and count > 0, mpi().LOR)
        found.append((kind, nodes, given.get(kind, np.empty(0, dtype=np.int64)) if some else first + np.arange(count)))
        counted |= set() if some else {kind}
    return found, counted


def _piece(mesh: Mesh, ids: Any, fixed: Any, numbered: Numbered) -> Piece:
    """From the arrays of one rank."""
    if len(ids) != len(mesh.points):
        raise InputError(f"{len(mesh.points):,} nodes need one global id each, got {len(ids):,}")
    blocks = []
    for kind, width, numbers in numbered:
        parts = [block for block in mesh.cells if block.kind == kind]
        nodes = np.concatenate([*(ids[block.nodes] for block in parts), np.empty((0, width), dtype=np.int64)])
        regions = np.concatenate([*(block.regions for block in parts), np.empty(0, dtype=np.int64)])
        places = whole_numbers(numbers, f"the numbers of {kind} cells")
        if places.shape != (len(nodes),):
            raise InputError(f"{len(nodes):,} {kind} cells need one number each, got shape {places.shape}")
        blocks.append(Cells(kind, nodes, regions, places))
    return Piece(ids, mesh.points, fixed, tuple(blocks), mesh.single, rounding=mesh.rounding)


def _threshold(given: Any) -> float | None:
    """Raises InputError for what is none."""
    if given is None:
        return None
    if type(given) is bool or not (isinstance(given, Real) and -1.0 <= float(given) <= 1.0):
        raise InputError(f"threshold is a value of 1/q and must lie between -1 and 1, got {given!r}")
    return float(given)


def _checked(piece: Piece, counted: set[str], comm: Any) -> Piece:
    """Raises InputError on all ranks where all have given the same cells, as of a mesh that is not spread.

    So it does where several have given one cell of the highest dimension. counted: the kinds without numbers.
    """
    told = [(len(block.nodes), int(_marks(block.nodes).sum())) for block in piece.blocks]
    every = comm.allgather(told)
    if comm.size > 1 and all(each == every[0] for each in every) and any(len(block.nodes) for block in piece.blocks):
        raise InputError(SAME)
    highest = max((CELLS[block.kind].dimension for block in piece.blocks if block.kind in CELLS), default=0)
    for block in piece.blocks:
        uncertain = comm.size > 1 and block.kind in counted and block.kind in CELLS
        if uncertain and CELLS[block.kind].dimension == highest and (wrong := _brought_twice(block, comm)):
            raise InputError(wrong)
    return piece


def _brought_twice(block: Cells, comm: Any) -> str:
    """What to say of cells that several ranks have given, the same on all; "" of none."""
    nodes = np.sort(block.nodes, axis=1)
    marks = _marks(nodes)
    own = np.unique(marks)
    came = comm.alltoall([own[rows] for rows in by_rank((own % np.uint64(comm.size)).astype(np.int64), comm.size)])
    names, number = np.unique(np.concatenate(came), return_counts=True)
    doubtful = np.concatenate(comm.allgather(names[number > 1]))
    given = comm.allgather(np.unique(nodes[np.isin(marks, doubtful)], axis=0))  # marks may be alike by chance
    cells, back, number = np.unique(np.concatenate(given), axis=0, return_inverse=True, return_counts=True)
    twice = int((number > 1).sum())
    if not twice:
        return ""
    first = back.ravel() == np.argmax(number > 1)
    owner = np.repeat(np.arange(comm.size), [len(each) for each in given])
    ranks = " and ".join(map(str, owner[first]))
    named = ", ".join(map(str, cells[np.argmax(number > 1)]))
    others = "" if twice == 1 else f", and {twice - 1:,} more are given twice"
    return f"ranks {ranks} have given the same {block.kind} of the nodes {named}{others}: {ONE_RANK}"


def _marks(nodes: NDArray[np.int64]) -> NDArray[np.uint64]:
    """(C,) for each cell (C, k) a number that others share by chance alone."""
    marks = np.zeros(len(nodes), dtype=np.uint64)
    for column in nodes.T:
        marks = (marks ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        marks ^= marks >> np.uint64(29)
    return marks
