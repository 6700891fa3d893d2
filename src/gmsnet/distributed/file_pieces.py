"""A mesh in several files: each rank reads its own, and all of them are one mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.agreement import everywhere
from gmsnet.distributed.joining import Joined, joined, orphans
from gmsnet.distributed.layouts import Layout, Opened, layout_of
from gmsnet.distributed.piece import Cells, Piece
from gmsnet.distributed.together import replace_together
from gmsnet.distributed.zones import Names, named_here, with_vertices
from gmsnet.errors import FormatError, InputError
from gmsnet.io.contents import Data
from gmsnet.io.merge import HELD, Part
from gmsnet.io.packed import is_packed, packed
from gmsnet.io.pieces import Pieces
from gmsnet.io.rows import share
from gmsnet.io.stamps import Stamps
from gmsnet.io.vtk_ghosts import ghosts
from gmsnet.kernels.topology.places import places_in
from gmsnet.mesh.selection import held_by_data

Ids = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class FilePieces:
    """What one rank has of a mesh in several files. layout: of all ranks. opened: key → files of this rank. parts: what
    those hold that have cells, by the key of their coordinates. joined: their points as nodes; piece: the mesh of them.
    """

    layout: Layout
    opened: Mapping[str, Opened]
    parts: Mapping[str, Part]
    joined: Joined
    piece: Piece

    @property
    def stamps(self) -> Stamps:
        """Of all files that this rank has read."""
        index = [] if self.layout.index is None else [self.layout.index]
        return Stamps.of([*index, *self.opened.values()])

    def write(self, target: str, points: NDArray[np.float64], comm: Any) -> None:
        """All ranks call it: the same files with new points (n, dim) of the piece, by another name or in place.

        Raises InputError, on all ranks, where they cannot be written; then none is.
        """
        moved = bool(comm.allreduce(int((points != self.piece.points).any())))
        known = {path: stamp for each in comm.allgather(self.stamps.known) for path, stamp in each.items()}
        targets = self.layout.targets(target, known)
        files: dict[str, Any] = {
            targets[key]: file for key, file in self.spliced(points, moved).items() if key in targets
        }
        if comm.rank == 0:
            files |= self.layout.renamed(target)
        files = {path: packed(file) if is_packed(path) else file for path, file in files.items()}
        replace_together(comm, target, files, list(targets.values()), Stamps(known.items()))

    def spliced(self, points: NDArray[np.float64], moved: bool) -> dict[str, Pieces]:
        """Key → each file of this rank with new points (n, dim) of the piece. moved: whether any rank moved a node."""
        files = {key: _as_it_is(data) for key, (_, data, _) in self.opened.items()}
        cuts = np.cumsum([len(part.parsed.points) for part in self.parts.values()])[:-1]
        at = places_in(self.piece.ids, self.joined.node)
        for (key, part), rows in zip(self.parts.items(), np.split(at, cuts), strict=True) if self.parts else ():
            if moved:
                files[key] = _replaced(part, self.opened[key][1], self.piece.points[rows], points[rows])
        return files


def _as_it_is(data: Data) -> Pieces:
    return Pieces(lambda: [memoryview(data)])


def _replaced(part: Part, data: Data, old: NDArray[np.float64], new: NDArray[np.float64]) -> Pieces:
    return Pieces(lambda: part.parsed.slots.replace(data, old, new))


def read_pieces(name: str, format: str, comm: Any) -> FilePieces:
    """All ranks call it; each reads as many parts as the others, one after another in the order of the mesh.

    The mesh is that of ``gmsnet.read``. Raises InputError, on all ranks, with what it says.
    """
    layout = comm.bcast(everywhere(comm, lambda: layout_of(name, format) if comm.rank == 0 else None))
    first, last = share(len(layout.parts), comm.rank, comm.size)
    opened, found, told = everywhere(comm, lambda: _opened(name, layout, layout.parts[first:last]))
    everyone = [each for some in comm.allgather(told) for each in some]
    everywhere(comm, lambda: _checked(name, layout, everyone))
    parts = list(found.values())
    before = comm.exscan(len(parts)) or 0
    dims = [each for each in comm.allgather([part.parsed.points.shape[1] for part in parts]) if each]
    nodes = joined(comm, parts, before, dims[0][0])
    return FilePieces(layout, opened, found, nodes, _piece(comm, parts, nodes))


def _opened(
    name: str, layout: Layout, some: Sequence[tuple[str, ...]]
) -> tuple[dict[str, Opened], dict[str, Part], list[Any]]:
    """The files of a rank, what those parts hold that have cells, by the first key of each, and what they tell."""
    opened = {key: layout.load(key) for keys in some for key in keys}
    data = {key: data for key, (_, data, _) in opened.items()}
    try:
        found = {keys[0]: there for keys in some if (there := layout.part_in(keys, data)) is not None}
    except InputError as error:
        raise FormatError(f"{name}: {error}") from None
    except MemoryError:
        raise InputError(f"{name}: there is not enough memory for this mesh") from None
    return opened, {key: part for key, (part, _) in found.items()}, [told for _, told in found.values()]


def _checked(name: str, layout: Layout, told: Sequence[Any]) -> None:
    if not told:
        raise FormatError(f"{name}: no piece has cells: there is nothing to smooth")
    try:
        layout.check(told)
    except InputError as error:
        raise FormatError(f"{name}: {error}") from None


def _piece(comm: Any, parts: Sequence[Part], nodes: Joined) -> Piece:
    """The cells of the parts but copies of others, by global ids, with vertices at nodes that are held."""
    mine = [(block.kind, block.nodes.shape[1]) for part in parts for block in part.parsed.cells]
    kinds = list(dict.fromkeys(key for each in comm.allgather(mine) for key in each))
    cuts = np.cumsum([0, *(len(part.parsed.points) for part in parts)])
    images = [nodes.node[start + part.parsed.images] for part, start in zip(parts, cuts[:-1], strict=True)]
    blocks, stay = list[Cells](), [nodes.node[nodes.unsure]]
    for kind, width in kinds:
        own, copies = [np.empty((0, width), dtype=np.int64)], [np.empty((0, width), dtype=np.int64)]
        regions = [np.empty(0, dtype=np.int64)]
        for part, start in zip(parts, cuts[:-1], strict=True):
            for block, ghost in zip(part.parsed.cells, ghosts(part.parsed), strict=True):
                if (block.kind, block.nodes.shape[1]) == (kind, width):
                    here = nodes.node[start + block.nodes]
                    own.append(here[~ghost])
                    copies.append(here[ghost])
                    regions.append(block.regions[~ghost])
        cells, ghost_cells = np.concatenate(own), np.concatenate(copies)
        number = (comm.exscan(len(cells)) or 0) + np.arange(len(cells))
        blocks.append(Cells(kind, cells, np.concatenate(regions), number))
        stay.append(ghost_cells[orphans(comm, ghost_cells, cells)].ravel())
    ids, first = np.unique(nodes.node, return_index=True)
    own = (ids >= nodes.starts[comm.rank]) & (ids < nodes.starts[comm.rank + 1])  # of others the points are copies
    fixed = np.isin(ids, np.concatenate([nodes.node[:0], *images])) | (own & _fixed(comm, parts)[first])
    single = any(comm.allgather(any(part.parsed.single for part in parts)))
    told = {key: name for part in parts for key, name in part.parsed.region_names.items()}
    called: Names = {key: name for each in comm.allgather(told) for key, name in each.items()}
    here = named_here(comm, nodes.starts, np.concatenate(stay))
    every, called = with_vertices(comm, blocks, called, here, HELD)
    return everywhere(comm, lambda: Piece(ids, nodes.points[first], fixed, tuple(every), single, called))


def _fixed(comm: Any, parts: Sequence[Part]) -> Flags:
    """(n,) bool: the points of this rank whose point data ``fixed`` hold them, if all parts have such."""
    data = [part.parsed.point_data.get("fixed") for part in parts]
    told = [None if each is None else (each.shape[1:], each.dtype.kind) for each in data]
    common = {each for some in comm.allgather(told) for each in some}
    if len(common) != 1 or None in common:
        return np.zeros(sum(len(part.parsed.points) for part in parts), dtype=bool)
    masks = everywhere(comm, lambda: [held_by_data(each) for each in data if each is not None])
    return np.concatenate([np.zeros(0, dtype=bool), *masks])
