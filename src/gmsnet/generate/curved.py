"""Second-order meshes from first-order ones: middle nodes on a curved boundary, and curved edges inside."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.generate.random import generator
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Projection = Callable[[Floats], Floats]
KINDS: dict[str, tuple[str, ...]] = {"triangle": ("triangle6",), "quad": ("quad8", "quad9"), "line": ("line3",)}
CORNERS = {"triangle": 3, "quad": 4, "line": 2}


def second_order(
    mesh: Mesh,
    *,
    quads: str = "quad9",
    project: Projection | None = None,
    bend: float = 0.0,
    seed: int = 0,
) -> Mesh:
    """The mesh with a node in the middle of each edge, and in the centre of each quad.

    mesh: planar (N × 2), of triangles, quads and line cells of the first order. quads: "quad8" or "quad9". project:
    where points (n × 2) on edges of the boundary belong, such as on the circle that its nodes are on; None: straight
    edges. bend: middles of inner edges are thrown by a random distance of at most ``bend`` edge lengths, and centres by
    that of their cell's edges. Corners keep their numbers; what belongs to cells and points as data is left out.

    Raises InputError for other cells, points that are not planar, and numbers out of range.
    """
    if quads not in KINDS["quad"]:
        raise InputError(f"quads must be 'quad8' or 'quad9', got {quads!r}")
    if not (np.isfinite(bend) and bend >= 0):
        raise InputError(f"the bend of edges must be 0 or more, got {bend!r}")
    if mesh.points.shape[1] != 2:
        raise InputError(f"a second-order mesh is made of points (N × 2), got shape {mesh.points.shape}")
    wrong = [block.kind for block in mesh.cells if block.kind not in KINDS]
    if wrong:
        raise InputError(f"only triangles, quads and lines can be given middle nodes, got {wrong[0]!r} cells")
    rng = generator(seed)
    sides = [_sides(block.nodes, CORNERS[block.kind]) for block in mesh.cells]
    edges, number = np.unique(np.concatenate([side.reshape(-1, 2) for side in sides]), axis=0, return_inverse=True)
    of_block = np.split(number.reshape(-1), np.cumsum([side.shape[0] * side.shape[1] for side in sides])[:-1])
    uses = np.zeros(len(edges), dtype=np.int64)
    for block, index in zip(mesh.cells, of_block, strict=True):
        uses += np.bincount(index, minlength=len(edges)) * (block.kind != "line")
    start, end = mesh.points[edges[:, 0]], mesh.points[edges[:, 1]]
    middles = (start + end) / 2
    inner = uses == 2
    if project is not None:
        middles[~inner] = project(middles[~inner])
    length = np.linalg.norm(end - start, axis=1)
    middles[inner] += (bend * length[inner])[:, None] * _in_disc(rng, int(inner.sum()))
    points, cells = [mesh.points, middles], []
    total = len(mesh.points) + len(middles)
    for block, index in zip(mesh.cells, of_block, strict=True):
        columns = [block.nodes, len(mesh.points) + index.reshape(len(block.nodes), -1)]
        kind = quads if block.kind == "quad" else KINDS[block.kind][0]
        if kind == "quad9":
            around, nearby = middles[index.reshape(-1, 4)], length[index.reshape(-1, 4)].min(axis=1)
            centres = around.sum(axis=1) / 2 - mesh.points[block.nodes].sum(axis=1) / 4
            points.append(centres + (bend * nearby)[:, None] * _in_disc(rng, len(centres)))
            columns.append(total + np.arange(len(centres))[:, None])
            total += len(centres)
        nodes = np.concatenate(columns, axis=1)
        cells.append(CellBlock(kind, nodes, block.regions))
    return Mesh(np.concatenate(points), tuple(cells), mesh.region_names)


def on_circle(radius: float, centre: tuple[float, float] = (0.0, 0.0)) -> Projection:
    """The projection onto a circle, for ``second_order``."""

    def project(points: Floats) -> Floats:
        away = points - centre
        return np.asarray(centre + radius * away / np.linalg.norm(away, axis=1)[:, None])

    return project


def disc_of_quads(rings: int, sectors: int = 8) -> Mesh:
    """A disc of radius 1 of quads: a square of (sectors/4)² cells, and ``rings`` layers between it and the circle.

    sectors: cells around the circle, a multiple of 4. Raises InputError for numbers out of range.
    """
    if rings < 1 or sectors < 4 or sectors % 4:
        raise InputError(f"a disc needs at least 1 ring and a multiple of 4 sectors, got {rings} and {sectors}")
    n = sectors // 4
    across = np.linspace(-0.5, 0.5, n + 1)
    square = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    grid = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    cells = [np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1).reshape(-1, 4)]
    rim = np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])
    angle = -0.75 * np.pi + 2 * np.pi * np.arange(sectors) / sectors
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    points, last = [square], rim
    for ring in range(1, rings + 1):
        points.append(square[rim] + (circle - square[rim]) * ring / rings)
        new = len(square) + (ring - 1) * sectors + np.arange(sectors)
        cells.append(np.stack([last, new, np.roll(new, -1), np.roll(last, -1)], axis=-1))
        last = new
    nodes = np.concatenate(cells)
    lines = np.stack([last, np.roll(last, -1)], axis=-1)
    blocks = (
        CellBlock("quad", nodes, np.zeros(len(nodes), dtype=np.int64)),
        CellBlock("line", lines, np.ones(len(lines), dtype=np.int64)),
    )
    return Mesh(np.concatenate(points), blocks, {(1, 1): "circle"})


def waved(mesh: Mesh, amount: float) -> Mesh:
    """The mesh with all nodes moved along smooth waves, edges of second-order cells with them.

    A point (x, y) goes to (x + amount·sin(2πy), y + amount·sin(2πx)) in units of the mesh's extent, a map without folds
    below an amount of 1/2π. Raises InputError for an amount that is not between 0 and that.
    """
    if not 0 <= amount < 1 / (2 * np.pi):
        raise InputError(f"waves must have an amount from 0 to below 1/2π, got {amount!r}")
    low, extent = mesh.points.min(axis=0), np.ptp(mesh.points, axis=0).max()
    place = (mesh.points - low) / extent
    return mesh.with_points(low + extent * (place + amount * np.sin(2 * np.pi * place[:, ::-1])))


def throw(mesh: Mesh, *, middles: float, corners: float = 0.0, seed: int = 0) -> Mesh:
    """A second-order mesh with its inner nodes thrown out of place, often into invalid cells.

    middles, corners: the largest distance, in edge lengths (corners: of the shortest edge at the node). Nodes of the
    boundary and of line cells stay. Middles are thrown from where they are, not from where corners were thrown.

    Raises InputError where the mesh has no second-order cells, and for negative distances.
    """
    if not (np.isfinite([middles, corners]).all() and min(middles, corners) >= 0):
        raise InputError(f"distances must be 0 or more, got {middles!r} and {corners!r}")
    rng = generator(seed)
    counts = {"triangle6": 3, "quad8": 4, "quad9": 4}
    blocks = [block for block in mesh.cells if block.kind in counts]
    if not blocks:
        raise InputError("the mesh has no second-order triangles or quads")
    rows = []
    for block in blocks:
        k = counts[block.kind]
        rows.append(np.concatenate([_sides(block.nodes[:, :k], k), block.nodes[:, k : 2 * k, None]], axis=2))
    edges, uses = np.unique(np.concatenate([row.reshape(-1, 3) for row in rows]), axis=0, return_counts=True)
    held = np.zeros(len(mesh.points), dtype=bool)
    held[edges[uses != 2]] = True
    for block in mesh.cells:
        if block.dimension in (0, 1):
            held[block.nodes] = True
    length = np.linalg.norm(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]], axis=1)
    reach = np.full(len(mesh.points), np.inf)
    for column in range(2):
        np.minimum.at(reach, edges[:, column], corners * length)
    np.minimum.at(reach, edges[:, 2], middles * length)
    for block in blocks:
        if block.kind == "quad9":
            reach[block.nodes[:, 8]] = reach[block.nodes[:, 4:8]].min(axis=1)
    reach[held | ~np.isfinite(reach)] = 0.0
    return mesh.with_points(mesh.points + reach[:, None] * _in_disc(rng, len(reach)))


def _sides(nodes: Ints, corners: int) -> Ints:
    """(cells, sides, 2) the sides of cells, the smaller number first; a line is its only side."""
    pairs = [nodes[:, [k, (k + 1) % corners]] for k in range(1 if corners == 2 else corners)]
    return np.sort(np.stack(pairs, axis=1), axis=2)


def _in_disc(rng: np.random.Generator, count: int) -> Floats:
    """(count, 2) random points of the unit disc."""
    radius, angle = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.asarray(radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
