"""Which rank gets which cells of a mesh: as few edges cut as METIS finds, or by halving along coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.distributed.frame import box_of
from gmsnet.distributed.library import metis
from gmsnet.kernels.topology.layout import morton_codes
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import extents

Ranks = NDArray[np.int32]
Floats = NDArray[np.float64]
SAMPLES = 256  # of each rank, for each of all ranks


def partition(mesh: Mesh, ranks: int) -> list[Ranks]:
    """For each block of a mesh the rank of each of its cells: those of a cell's first node.

    Nodes are shared out by METIS where pymetis is installed, else by ``bisection``.
    """
    if ranks == 1:
        return [np.zeros(len(block.nodes), dtype=np.int32) for block in mesh.cells]
    library = metis()
    of_node = bisection(mesh.points, ranks) if library is None else _by_metis(library, mesh, ranks)
    return [of_node[block.nodes[:, 0]] for block in mesh.cells]


def bisection(points: Floats, parts: int) -> Ranks:
    """(N,) the part of each point (N, dim): halves, by number, along the longest extent, again and again.

    Points of one coordinate are told apart by their index, so that the parts are the same everywhere.
    """
    found = np.zeros(len(points), dtype=np.int32)
    stack = [(np.arange(len(points)), 0, parts)]
    while stack:
        chosen, first, count = stack.pop()
        if count == 1 or not len(chosen):
            found[chosen] = first
            continue
        axis = int(np.argmax(extents(points[chosen])))
        order = chosen[np.argsort(points[chosen, axis], kind="stable")]
        left = count // 2
        middle = len(order) * left // count
        stack += [(order[:middle], first, left), (order[middle:], first + left, count - left)]
    return found


def along_curve(comm: Any, points: Floats) -> Ranks:
    """(n,) the rank for each point (n, dim) of this rank: each rank gets about as many, near one another.

    All ranks call it. Points are shared out along a Morton curve over the box of all, by samples of each rank.
    """
    box = box_of(comm, 0.25 * points)  # a quarter, lest differences overflow
    codes = np.zeros(len(points), dtype=np.uint32)
    if len(points) and np.isfinite(box).all():
        morton_codes(np.ascontiguousarray(0.25 * points), box, codes)
    ordered = np.sort(codes)
    sample = ordered[np.linspace(0, len(codes) - 1, min(len(codes), SAMPLES * comm.size)).astype(np.int64)]
    given = [each for each in comm.allgather((sample, len(codes))) if each[1]]
    values = np.concatenate([sample[:0], *(each for each, _ in given)])
    weights = np.concatenate([np.zeros(0), *(np.full(len(each), count / len(each)) for each, count in given)])
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weights[order])
    cuts = np.searchsorted(reached, reached[-1:] * np.arange(1, comm.size) / comm.size) if len(values) else []
    return np.searchsorted(values[order][cuts], codes, side="right").astype(np.int32)


def _by_metis(library: object, mesh: Mesh, ranks: int) -> Ranks:
    """(N,) the part of each node, of the graph whose edges join the nodes that follow each other in a cell."""
    ends = [
        np.stack([block.nodes, np.roll(block.nodes, 1, axis=1)], axis=2).reshape(-1, 2)
        for block in mesh.cells
        if block.nodes.shape[1] > 1
    ]
    nodes = len(mesh.points)
    pairs = np.concatenate([*ends, np.empty((0, 2), dtype=np.int64)])
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    keys = sorted_unique(np.concatenate([pairs[:, 0] * nodes + pairs[:, 1], pairs[:, 1] * nodes + pairs[:, 0]]))
    start = np.zeros(nodes + 1, dtype=np.int64)
    np.cumsum(np.bincount(keys // nodes, minlength=nodes), out=start[1:])
    graph = library.CSRAdjacency(start, keys % nodes)  # type: ignore[attr-defined]
    _, parts = library.part_graph(ranks, adjacency=graph)  # type: ignore[attr-defined]
    return np.asarray(parts, dtype=np.int32)
