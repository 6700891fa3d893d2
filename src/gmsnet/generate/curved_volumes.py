"""Second-order volumes from those of the first order: nodes on a curved boundary, and curved edges inside."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import InputError
from gmsnet.generate.random import generator
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.topology.curved_solids import frames

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Projection = Callable[[Floats], Floats]
FULL = {"tetra": "tetra10", "hexahedron": "hexahedron27", "wedge": "wedge18"}
SERENDIPITY = {"tetra": "tetra10", "hexahedron": "hexahedron20", "wedge": "wedge15"}


def second_order_volume(
    mesh: Mesh, *, serendipity: bool = False, project: Projection | None = None, bend: float = 0.0, seed: int = 0
) -> Mesh:
    """The mesh with a node in the middle of each edge, and of four-sided faces and hexahedra.

    mesh: of tetrahedra, hexahedra and wedges of the first order; its faces and lines are left out. serendipity: with
    nodes on edges alone (20 in a hexahedron, 15 in a wedge). project: where points (n × 3) on the boundary belong, of
    all its new nodes; None: straight edges. bend: other new nodes are thrown by a random distance of at most ``bend``
    edge lengths. Corners keep their numbers; data of cells and points are left out.

    Raises InputError for volumes of other kinds, and a bend that is negative.
    """
    if not (np.isfinite(bend) and bend >= 0):
        raise InputError(f"the bend of edges must be 0 or more, got {bend!r}")
    blocks = [block for block in mesh.cells if block.dimension == 3]
    kinds = SERENDIPITY if serendipity else FULL
    wrong = [block.kind for block in blocks if block.kind not in kinds]
    if wrong or not blocks:
        given = wrong[0] if wrong else "no"
        raise InputError(f"only tetrahedra, hexahedra and wedges can be given middle nodes, got {given!r} cells")
    around = [_frames(block, kinds[block.kind]) for block in blocks]
    count = [len(rows) for rows in around]
    groups, number = np.unique(np.concatenate(around), axis=0, return_inverse=True)
    corner = groups >= 0
    middles = np.where(corner[:, :, None], mesh.points[groups], 0.0).sum(axis=1) / corner.sum(axis=1)[:, None]
    outer = _on_boundary(blocks, groups)
    if project is not None and outer.any():
        middles[outer] = project(middles[outer])
    rng = generator(seed)
    span = np.linalg.norm(mesh.points[groups[:, -1]] - mesh.points[groups[:, -2]], axis=1)
    middles[~outer] += (bend * span[~outer])[:, None] * _in_ball(rng, int((~outer).sum()))
    number, cells, first = number.reshape(-1) + len(mesh.points), [], 0
    for block, rows in zip(blocks, count, strict=True):
        new = number[first : first + rows].reshape(-1, len(block.nodes)).T
        nodes = np.empty((len(block.nodes), CELLS[kinds[block.kind]].nodes or 0), dtype=np.int64)
        nodes[:, : block.nodes.shape[1]] = block.nodes
        nodes[:, [node for node, _ in frames(kinds[block.kind])]] = new
        cells.append(CellBlock(kinds[block.kind], nodes, block.regions))
        first += rows
    return Mesh(np.concatenate([mesh.points, middles]), tuple(cells))


def on_sphere(
    radius: float, centre: tuple[float, float, float] = (0.0, 0.0, 0.0), within: float = np.inf
) -> Projection:
    """The projection onto a sphere of what is within a distance of its surface, for ``second_order_volume``."""

    def project(points: Floats) -> Floats:
        away = points - centre
        length = np.linalg.norm(away, axis=1)
        near = np.abs(length - radius) < within
        found = points.copy()
        found[near] = centre + radius * away[near] / length[near, None]
        return found

    return project


def _frames(block: CellBlock, kind: str) -> Ints:
    """(n·C, 8) the corners around each new node, in rising order, behind −1; node after node of the kind."""
    parts = []
    for _, around in frames(kind):
        rows = np.full((len(block.nodes), 8), -1, dtype=np.int64)
        rows[:, 8 - len(around) :] = np.sort(block.nodes[:, list(around)], axis=1)
        parts.append(rows)
    return np.concatenate(parts)


def _on_boundary(blocks: list[CellBlock], groups: Ints) -> NDArray[np.bool_]:
    """Which groups of corners are within a facet of one cell alone."""
    facets = []
    for block in blocks:
        for facet in CELLS[block.kind].facets:
            rows = np.full((len(block.nodes), 4), -1, dtype=np.int64)
            rows[:, 4 - len(facet) :] = np.sort(block.nodes[:, list(facet)], axis=1)
            facets.append(rows)
    found, uses = np.unique(np.concatenate(facets), axis=0, return_counts=True)
    edges, faces = set[tuple[int, ...]](), set[tuple[int, ...]]()
    for row in found[uses == 1].tolist():
        corners = [node for node in row if node >= 0]
        faces.add(tuple(corners))
        edges |= {(a, b) for k, a in enumerate(corners) for b in corners[k + 1 :]}
    chosen = [tuple(node for node in row if node >= 0) for row in groups.tolist()]
    return np.array([group in edges if len(group) == 2 else group in faces for group in chosen], dtype=bool)


def _in_ball(rng: np.random.Generator, count: int) -> Floats:
    """(count, 3) random points of the unit ball."""
    way = rng.normal(size=(count, 3))
    return np.asarray(rng.random((count, 1)) ** (1 / 3) * way / np.linalg.norm(way, axis=1)[:, None])
