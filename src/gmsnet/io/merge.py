"""Pieces of a mesh put together: the points at which they meet become one node each, copies of cells are left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.document import Parsed
from gmsnet.io.splice import Share, Untouched
from gmsnet.io.vtk_ghosts import LEVELS, TYPES, ghosts, with_vertices
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock

Ints = NDArray[np.int64]

HELD = "coincident points and ghost cells"  # the region of vertices that hold them


@dataclass(frozen=True)
class Part:
    """A piece. ids: (n,) numbers of its points over all pieces, None where it has none."""

    parsed: Parsed
    ids: NDArray[Any] | None = None

    def in_region(self, number: int, name: str) -> Part:
        """The same with all cells in one region. name: of the region, "" for none."""
        cells = [CellBlock(b.kind, b.nodes, np.full(len(b.nodes), number)) for b in self.parsed.cells]
        names = {(b.dimension, number): name for b in cells if name and b.dimension is not None}
        return replace(self, parsed=replace(self.parsed, cells=cells, region_names=names))


class Merged(NamedTuple):
    """parsed: the whole, without slots. nodes: for each part, the node of each of its points. held: nodes that must not
    move, as they stand at the place of others of the same part, or in a ghost cell that no part owns.
    """

    parsed: Parsed
    nodes: list[Ints]
    held: Ints


def merged(parts: Sequence[Part]) -> Merged:
    """One mesh of all parts.

    Points of different parts are one node where their coordinates are equal, and their ids where all parts have some.
    Without ids, only points of cells count. Where one part has several points at a place, such as the two sides of a
    crack, none of them is taken together with another one: which belong together is not known.
    """
    first, unsure = _joined(parts)
    numbers, node = np.unique(first, return_inverse=True)
    cuts = np.cumsum([len(part.parsed.points) for part in parts])[:-1]
    nodes = [each.astype(np.int64) for each in np.split(node.reshape(-1), cuts)]
    points = np.concatenate([part.parsed.points for part in parts])[numbers]
    cells, cell_data, orphans = _cells(parts, nodes)
    shared, lost = _common([part.parsed.point_data for part in parts])
    point_data = {name: np.concatenate(arrays)[numbers] for name, arrays in shared.items()}
    names = {key: name for part in parts for key, name in part.parsed.region_names.items()}
    unread = [text for part in parts for text in part.parsed.unread] + [f"the point data {name!r}" for name in lost]
    single = any(part.parsed.single for part in parts)
    images = sorted_unique(np.concatenate([node[part.parsed.images] for part, node in zip(parts, nodes, strict=True)]))
    parsed = Parsed(points, cells, Untouched(), names, point_data, cell_data, single, unread, images=images)
    return Merged(parsed, nodes, sorted_unique(np.concatenate([node.reshape(-1)[unsure], orphans])))


def one_mesh(parts: Mapping[str, Part], files: int) -> Parsed:
    """The mesh of parts that each have a file with their coordinates, whose key is that of the part.

    files: how many there are. Raises FormatError where no part has cells.
    """
    if not parts:
        raise FormatError("no piece has cells: there is nothing to smooth")
    whole = merged(list(parts.values()))
    shares = {key: Share(part.parsed.slots, node) for (key, part), node in zip(parts.items(), whole.nodes, strict=True)}
    unread = dict.fromkeys([f"the division into {files} files", *whole.parsed.unread])
    parsed = replace(whole.parsed, shares=shares, unread=list(unread))
    return with_vertices(parsed, whole.held, HELD)


def _joined(parts: Sequence[Part]) -> tuple[Ints, NDArray[np.bool_]]:
    """For each point of all parts the first one that is the same node, and whether several of its part are there."""
    points = np.concatenate([part.parsed.points for part in parts])
    ids = None
    if all(part.ids is not None for part in parts):
        ids = np.concatenate([part.ids for part in parts if part.ids is not None])
    piece = np.repeat(np.arange(len(parts)), [len(part.parsed.points) for part in parts])
    rows = np.flatnonzero(used_points(parts)) if ids is None else np.arange(len(points))
    first, unsure = np.arange(len(points)), np.zeros(len(points), dtype=bool)
    given = points[rows], None if ids is None else ids[rows], piece[rows]
    first[rows], unsure[rows] = same_points(*given, rows)
    return first, unsure


def used_points(parts: Sequence[Part]) -> NDArray[np.bool_]:
    """Which points of all parts, one part after another, are points of cells."""
    found = [np.zeros(len(part.parsed.points), dtype=bool) for part in parts]
    for part, used in zip(parts, found, strict=True):
        for block in part.parsed.cells:
            used[block.nodes.ravel()] = True
    return np.concatenate([*found, np.empty(0, dtype=bool)])


def same_points(
    points: NDArray[np.float64], ids: Ints | None, piece: Ints, numbers: Ints
) -> tuple[Ints, NDArray[np.bool_]]:
    """For each point (n, dim) the number of the first one that is the same node, and whether several of one
    piece are there. ids: (n,), None where they do not count. piece: (n,) of each. numbers: (n,) over all pieces.
    """
    if not len(points):
        return numbers.copy(), np.zeros(0, dtype=bool)
    keys = list(points.T[::-1]) + ([] if ids is None else [ids])
    order = np.lexsort([numbers, *keys])
    new = np.ones(len(order), dtype=bool)
    new[1:] = np.logical_or.reduce([key[order[1:]] != key[order[:-1]] for key in keys])
    group = np.cumsum(new) - 1
    twice = ~new
    twice[1:] &= piece[order[1:]] == piece[order[:-1]]
    several = np.zeros(int(group[-1]) + 1, dtype=bool)
    several[group[twice]] = True
    first, unsure, sequence = np.empty_like(numbers), np.zeros(len(points), dtype=bool), numbers[order]
    first[order] = np.where(several[group], sequence, sequence[np.flatnonzero(new)[group]])
    unsure[order] = several[group]
    return first, unsure


def _cells(parts: Sequence[Part], nodes: Sequence[Ints]) -> tuple[list[CellBlock], dict[str, tuple[Any, ...]], Ints]:
    """The cells by kind, without copies; their data; and the nodes of ghost cells that are no copies."""
    shared, _ = _common([part.parsed.cell_data for part in parts])
    shared = {name: arrays for name, arrays in shared.items() if name not in (TYPES, LEVELS)}
    rows: dict[tuple[str, int], list[tuple[Ints, Ints, list[Any]]]] = {}
    copies: dict[tuple[str, int], list[Ints]] = {}
    for number, (part, node) in enumerate(zip(parts, nodes, strict=True)):
        for k, (block, ghost) in enumerate(zip(part.parsed.cells, ghosts(part.parsed), strict=True)):
            key, here = (block.kind, block.nodes.shape[1]), node[block.nodes]
            own = ~ghost
            data = [arrays[number][k][own] for arrays in shared.values()]
            rows.setdefault(key, []).append((here[own], block.regions[own], data))
            copies.setdefault(key, []).append(here[ghost])
    cells, cell_data = [], dict[str, tuple[Any, ...]]((name, ()) for name in shared)
    orphans = [np.empty(0, dtype=np.int64)]
    for key, found in rows.items():
        whole = np.concatenate([each[0] for each in found])
        cells.append(CellBlock(key[0], whole, np.concatenate([each[1] for each in found])))
        for j, name in enumerate(shared):
            cell_data[name] += (np.concatenate([each[2][j] for each in found]),)
        copy = np.concatenate(copies[key])
        orphans.append(copy[~among(copy, whole)].ravel())
    return cells, cell_data, np.concatenate(orphans)


def among(some: Ints, all_of: Ints) -> NDArray[np.bool_]:
    """(n,) which of the cells (n, k) are also in the other list (m, k), whatever the order of their nodes."""
    if not len(some):
        return np.zeros(0, dtype=bool)
    both = np.sort(np.concatenate([all_of, some]), axis=1)
    number = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
    return np.isin(number[len(all_of) :], number[: len(all_of)])


def _common(data: Sequence[Any]) -> tuple[dict[str, list[Any]], list[str]]:
    """The data that all parts have in the same shape, with the arrays of all parts, and the names of the others."""
    names = dict.fromkeys(name for each in data for name in each)
    shared, others = {}, []
    for name in names:
        arrays = [each[name] for each in data if name in each]
        first = [array[0] if isinstance(array, tuple) else array for array in arrays]
        if len(arrays) == len(data) and len({(each.shape[1:], each.dtype.kind) for each in first}) == 1:
            shared[name] = arrays
        else:
            others.append(name)
    return shared, others
