"""Files in pieces (``.pvtu``, ``.pvtp``): each rank reads its own, and all of them are one mesh."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.agreement import everywhere
from gmsnet.distributed.joining import Joined, joined, orphans
from gmsnet.distributed.piece import Cells, Piece
from gmsnet.errors import FormatError, InputError
from gmsnet.io.contents import Data
from gmsnet.io.files import loaded
from gmsnet.io.formats import FORMATS, check_contents
from gmsnet.io.merge import Part
from gmsnet.io.pieces import Pieces
from gmsnet.io.stamps import Stamp, Stamps
from gmsnet.io.vtk_ghosts import ghosts
from gmsnet.io.vtk_links import Link, kind_of
from gmsnet.io.vtk_pieces import part_in

KINDS = {"pvtu": "PUnstructuredGrid", "pvtp": "PPolyData"}  # format → type of the file
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FilePieces:
    """What one rank has of a file in pieces. index: the naming file. links: the files of all ranks. opened: path →
    (name, bytes, stamp) of those of this rank. parts: of these that have cells, and paths, their names in the index.
    joined: their points as nodes; piece: the mesh of them."""

    index: tuple[str, Data, Stamp | None]
    links: Sequence[str]
    opened: Mapping[str, tuple[str, Data, Stamp | None]]
    parts: Sequence[Part]
    paths: Sequence[str]
    joined: Joined
    piece: Piece

    @property
    def stamps(self) -> Stamps:
        """Of all files that this rank has read."""
        return Stamps.of([self.index, *self.opened.values()])

    def spliced(self, points: NDArray[np.float64], moved: bool) -> dict[str, Pieces]:
        """Path → each file of this rank with new points (n, dim) of the piece. moved: whether any rank moved a node."""
        files = {path: _as_it_is(data) for path, (_, data, _) in self.opened.items()}
        cuts = np.cumsum([len(part.parsed.points) for part in self.parts])[:-1]
        at = np.searchsorted(self.piece.ids, self.joined.node)
        for part, path, rows in zip(self.parts, self.paths, np.split(at, cuts), strict=True) if self.parts else ():
            if moved:
                files[path] = _replaced(part, self.opened[path][1], self.piece.points[rows], points[rows])
        return files


def _as_it_is(data: Data) -> Pieces:
    return Pieces(lambda: [memoryview(data)])


def _replaced(part: Part, data: Data, old: NDArray[np.float64], new: NDArray[np.float64]) -> Pieces:
    return Pieces(lambda: part.parsed.slots.replace(data, old, new))


def read_pieces(name: str, format: str, comm: Any) -> FilePieces:
    """All ranks call it; each reads as many pieces as the others, one after another in the file.

    The mesh is that of ``gmsnet.read``. Raises InputError, on all ranks, with what it says.
    """
    told = everywhere(comm, lambda: _index(name, format) if comm.rank == 0 else None)
    index, links = comm.bcast(told)
    first, last = (len(links) * rank // comm.size for rank in (comm.rank, comm.rank + 1))
    opened, found = everywhere(comm, lambda: _opened(name, links[first:last]))
    parts = [part for part, _ in found]
    if not comm.allreduce(len(parts)):
        raise FormatError(f"{name}: no piece has cells: there is nothing to smooth")
    before = comm.exscan(len(parts)) or 0
    dims = [each for each in comm.allgather([part.parsed.points.shape[1] for part in parts]) if each]
    nodes = joined(comm, parts, before, dims[0][0])
    piece = _piece(comm, parts, nodes)
    return FilePieces(index, [link.path for link in links], opened, parts, [link.path for _, link in found], nodes,
                      piece)  # fmt: skip


def _index(name: str, format: str) -> tuple[tuple[str, bytes, Stamp | None], list[Link]]:
    """The naming file and what it names."""
    path, data, stamp = loaded(name)
    try:
        check_contents(data, format)
        kind, links = kind_of(data)
        if kind != KINDS[format]:
            raise FormatError(f"a VTKFile of type {kind} is not {FORMATS[format].title}: rename the file")
    except InputError as error:
        raise FormatError(f"{name}: {error}") from None
    return (path, bytes(data[:]), stamp), links


def _opened(
    name: str, links: Sequence[Link]
) -> tuple[dict[str, tuple[str, Data, Stamp | None]], list[tuple[Part, Link]]]:
    """The files of a rank, and what those hold that have cells."""
    opened = {}
    try:
        for link in links:
            try:
                opened[link.path] = loaded(os.path.join(os.path.dirname(name), link.path))
            except InputError as error:
                raise type(error)(f"{name}: the file that it names cannot be read: {error}") from None
        data = {path: data for path, (_, data, _) in opened.items()}
        return opened, [found for link in links if (found := part_in(link, data)) is not None]
    except FormatError as error:
        text = str(error)
        raise FormatError(text if text.startswith(name) else f"{name}: {text}") from None
    except MemoryError:
        raise InputError(f"{name}: there is not enough memory for this mesh") from None


def _piece(comm: Any, parts: Sequence[Part], nodes: Joined) -> Piece:
    """The cells of the parts but copies of others, by global ids; nodes whose cells nobody has are held."""
    mine = [(block.kind, block.nodes.shape[1]) for part in parts for block in part.parsed.cells]
    kinds = list(dict.fromkeys(key for each in comm.allgather(mine) for key in each))
    names = [kind for kind, _ in kinds]
    if len(set(names)) < len(names):
        raise InputError("cells of one kind have different numbers of nodes: smooth this file without ranks")
    blocks, held = [], [nodes.node[nodes.unsure]]
    cuts = np.cumsum([0, *(len(part.parsed.points) for part in parts)])
    for kind, width in kinds:
        own, copies = [np.empty((0, width), dtype=np.int64)], [np.empty((0, width), dtype=np.int64)]
        regions = [np.empty(0, dtype=np.int64)]
        for part, start in zip(parts, cuts[:-1], strict=True):
            for block, ghost in zip(part.parsed.cells, ghosts(part.parsed), strict=True):
                if block.kind == kind:
                    here = nodes.node[start + block.nodes]
                    own.append(here[~ghost])
                    copies.append(here[ghost])
                    regions.append(block.regions[~ghost])
        cells, ghost_cells = np.concatenate(own), np.concatenate(copies)
        number = (comm.exscan(len(cells)) or 0) + np.arange(len(cells))
        blocks.append(Cells(kind, cells, np.concatenate(regions), number))
        held.append(ghost_cells[orphans(comm, ghost_cells, cells)].ravel())
    ids, first = np.unique(nodes.node, return_index=True)
    fixed = np.isin(ids, np.concatenate(held))
    single = any(comm.allgather(any(part.parsed.single for part in parts)))
    return everywhere(comm, lambda: Piece(ids, nodes.points[first], fixed, tuple(blocks), single))
