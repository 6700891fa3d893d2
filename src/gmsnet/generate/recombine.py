"""Triangles joined to quads, and all cells split into quads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.errors import InputError
from gmsnet.generate.arguments import number_between, one_of, whole_number
from gmsnet.generate.disturb import corner_triangles, orientations
from gmsnet.generate.good import apart
from gmsnet.generate.random import random_mesh
from gmsnet.generate.settle import settle
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NODES_PER_NODE = 4.4  # of a recombined mesh once it is split into quads: its nodes, edges and cells, over its nodes


def random_quad_mesh(
    nodes: int,
    shape: str | Sequence[ArrayLike] = "square",
    *,
    cells: str = "quad",
    settled: int = 0,
    size: float = 1.0,
    boundary: str = "even",
    seed: int = 0,
) -> Mesh:
    """Quads, or quads and triangles, out of a ``random_mesh``: their nodes have three, four, five or more edges.

    nodes: about how many lie inside. cells: "mixed" pairs triangles and leaves some over; "quad" splits the cells of a
    coarser such mesh into quads. settled: sweeps of ``settle`` on the triangles before. The other arguments, the
    markers and the region are those of ``random_mesh``. The same arguments give the same mesh.

    Raises InputError as ``random_mesh`` does, for other cells, and for a negative number of sweeps.
    """
    one_of(cells, "cells", ("quad", "mixed"))
    whole_number(settled, "the number of sweeps", 0)
    count = whole_number(nodes, "the number of nodes", 1)
    coarse = count if cells == "mixed" else max(1, round(count / NODES_PER_NODE))
    triangles = random_mesh(coarse, shape, size=size, boundary=boundary, seed=seed)
    mixed = recombine(settle(triangles, settled))
    return mixed if cells == "mixed" else split_into_quads(mixed)


def recombine(mesh: Mesh, *, least: float = 0.0) -> Mesh:
    """The mesh with pairs of its triangles joined to quads, the best quad first; triangles without a partner stay.

    A quad's quality is the least of 2·det/(|e₁|² + |e₂|²) over its four corners. Only convex quads are made, whose
    corners float64 tells from flat ones. Triangles of different regions, or with a line cell between them, are not
    joined. least: quads of a quality below it are not made, 0 to 1.

    The triangles must be the mesh's first cells, wound alike; what belongs to cells and points as data is left out.
    Raises InputError for other cells, for a mesh that is not planar, and for a bound out of range.
    """
    number_between(least, "the least quality of a quad", 0.0, 1.0)
    block = mesh.cells[0]
    if block.kind != "triangle" or mesh.plane is None:
        raise InputError(f"only triangles in a plane can be joined to quads, got {block.kind!r} cells")
    points = np.ascontiguousarray(mesh.points[:, list(mesh.plane)])
    pairs, quads = _candidates(block, [lines.nodes for lines in mesh.cells if lines.kind == "line"])
    wanted = orientations(points, block.nodes)[pairs[:, 0]]
    corners = orientations(points, corner_triangles([quads])).reshape(4, -1)
    convex = (wanted != 0) & (corners == wanted).all(axis=0)
    quality = corner_quality(points, quads) * wanted
    allowed = np.flatnonzero(convex & (quality >= least))
    chosen = apart(pairs, allowed[np.argsort(-quality[allowed], kind="stable")], len(block.nodes))
    single = np.ones(len(block.nodes), dtype=bool)
    single[pairs[chosen]] = False
    cells = (
        CellBlock("quad", quads[chosen], block.regions[pairs[chosen, 0]]),
        CellBlock("triangle", block.nodes[single], block.regions[single]),
    )
    kept = tuple(cell for cell in cells if len(cell.nodes))
    return Mesh(mesh.points, kept + mesh.cells[1:], mesh.region_names, single=mesh.single)


def split_into_quads(mesh: Mesh) -> Mesh:
    """The mesh with each triangle split into three quads and each quad into four, by its centre and mid-edges.

    Line cells are split in two. What belongs to cells and points as data is left out. Convex cells give convex cells.
    Raises InputError for other faces and for volumes, and where rounding makes a corner flat.
    """
    for block in mesh.cells:
        if block.kind not in ("triangle", "quad", "line", "vertex"):
            raise InputError(f"only triangles and quads can be split into quads, got {block.kind!r} cells")
    rings = [block.nodes for block in mesh.cells if block.dimension in (1, 2)]
    edges = np.unique(np.sort(np.concatenate([_edges(ring) for ring in rings]), axis=1), axis=0)
    keys = edges @ [len(mesh.points), 1]
    points = [mesh.points, mesh.points[edges].mean(axis=1)]
    count = len(mesh.points) + len(edges)
    quads, regions, others = [np.empty((0, 4), dtype=np.int64)], [np.empty(0, dtype=np.int64)], []
    for block in mesh.cells:
        if block.dimension == 0:
            others.append(block)
            continue
        sides = np.sort(_edges(block.nodes), axis=1) @ [len(mesh.points), 1]
        middle = len(mesh.points) + np.searchsorted(keys, sides).reshape(len(block.nodes), -1)
        if block.dimension == 1:
            halves = np.stack([block.nodes[:, [0]], middle[:, [0]], middle[:, [0]], block.nodes[:, [1]]], axis=-1)
            others.append(CellBlock("line", halves.reshape(-1, 2), np.repeat(block.regions, 2)))
            continue
        centre = np.broadcast_to(count + np.arange(len(block.nodes))[:, None], block.nodes.shape)
        points.append(mesh.points[block.nodes].mean(axis=1))
        count += len(block.nodes)
        quads.append(np.stack([block.nodes, middle, centre, np.roll(middle, 1, axis=1)], axis=-1).reshape(-1, 4))
        regions.append(np.repeat(block.regions, block.nodes.shape[1]))
    cells = (CellBlock("quad", np.concatenate(quads), np.concatenate(regions)), *others)
    fine = Mesh(np.concatenate(points), cells, mesh.region_names)
    if fine.plane is not None:
        signs = orientations(np.ascontiguousarray(fine.points[:, list(fine.plane)]), corner_triangles([cells[0].nodes]))
        if (signs == 0).any():
            raise InputError("a cell is too flat to be split: rounding leaves a quad with a corner of no area")
    return fine


def corner_quality(points: Floats, quads: Ints) -> Floats:
    """(Q,) the least 2·det/(|e₁|² + |e₂|²) over the corners of each quad; 0 for a corner without edges."""
    worst = np.full(len(quads), np.inf)
    for k in range(4):
        corner = points[quads[:, k]]
        (ax, ay), (bx, by) = (points[quads[:, k - 3]] - corner).T, (points[quads[:, k - 1]] - corner).T
        squares = ax * ax + ay * ay + bx * bx + by * by
        worst = np.minimum(worst, 2.0 * (ax * by - ay * bx) / np.where(squares > 0.0, squares, 1.0))
    return worst


def _candidates(block: CellBlock, lines: Sequence[Ints]) -> tuple[Ints, Ints]:
    """(E × 2) the triangles on both sides of each edge that may go, and (E × 4) the quads that they would make."""
    triangles, nodes = block.nodes, int(block.nodes.max(initial=0)) + 1
    start, end, far = (np.roll(triangles, -k, axis=1).ravel() for k in range(3))
    owner = np.repeat(np.arange(len(triangles)), 3)
    marked = [np.empty(0, dtype=np.int64), *(np.sort(line, axis=1) @ [nodes, 1] for line in lines)]
    key = np.minimum(start, end) * nodes + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    key, count = np.unique(key, return_counts=True)
    last = np.cumsum(count)
    twice = (count == 2) & ~np.isin(key, np.concatenate(marked))
    one, two = order[last[twice] - 2], order[last[twice] - 1]
    fit = (start[one] == end[two]) & (block.regions[owner[one]] == block.regions[owner[two]])
    one, two = one[fit], two[fit]
    pairs = np.column_stack([owner[one], owner[two]])
    return pairs, np.column_stack([far[one], start[one], far[two], end[one]])


def _edges(ring: Ints) -> Ints:
    """The edges of cells, those of one cell after those of another; a line has one."""
    if ring.shape[1] == 2:
        return ring
    return np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1).reshape(-1, 2)
