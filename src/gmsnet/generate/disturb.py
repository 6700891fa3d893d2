"""Throws the nodes of a mesh out of place, for tests of what mends them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.errors import InputError
from gmsnet.generate.arguments import one_of
from gmsnet.generate.random import generator
from gmsnet.kernels.simplex import orientation3
from gmsnet.kernels.simplex.predicates import signs
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

EDGES = ("mean", "shortest")


def disturb(
    mesh: Mesh, free: ArrayLike, amount: float, *, seed: int = 0, keep_valid: bool = True, edge: str = "mean"
) -> Mesh:
    """The mesh with each free node thrown to a random place around it.

    free: mask (N,) or ids of the nodes that may move. amount: radius of the disc, or ball, in which they land, in
    lengths of the node's edges. edge: which length, the "mean" of the node's edges or that of the "shortest".
    keep_valid: halve the throws until no corner of a cell changes its orientation (a corner whose orientation is not
    certain stands still); otherwise inverted cells are to be expected.

    Raises InputError for a surface in space, for nodes that do not exist, for a negative amount, and for
    another ``edge``.
    """
    if not (np.isfinite(amount) and amount >= 0):
        raise InputError(f"the amount of a disturbance must be 0 or more, got {amount!r}")
    one_of(edge, "edge", EDGES)
    if mesh.plane is None and not mesh.has_volumes:
        raise InputError("only planar meshes and volumes can be disturbed; this is a surface in space")
    dimension = 3 if mesh.has_volumes else 2
    axes = [0, 1, 2] if mesh.has_volumes else list(mesh.plane or ())
    old = np.ascontiguousarray(mesh.points[:, axes])
    blocks = [block for block in mesh.cells if block.dimension == dimension]
    edges = np.concatenate([np.empty((0, 2), dtype=np.int64), *map(edges_of, blocks)])
    throw = random_directions(len(old), dimension, generator(seed))
    shift = throw * (edge_lengths(old, edges, edge) * amount * _mask(free, len(old)))[:, None]
    if keep_valid:
        keep_orientation(old, shift, _corners(blocks), single=mesh.single)
    points = mesh.points.copy()
    points[:, axes] = _landed(old, shift, single=mesh.single)
    return mesh.with_points(points)


def random_directions(count: int, dimension: int, rng: np.random.Generator) -> Floats:
    """(count × dimension) random points in the unit disc or ball."""
    share = rng.random(count)
    radius, angle = np.cbrt(share) if dimension == 3 else np.sqrt(share), 2 * np.pi * rng.random(count)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    if dimension == 3:
        height = 2.0 * rng.random(count) - 1.0
        circle = np.column_stack([circle * np.sqrt(1.0 - height**2)[:, None], height])
    found: Floats = radius[:, None] * circle
    return found


def _mask(free: ArrayLike, nodes: int) -> NDArray[np.bool_]:
    given = np.asarray(free)
    if given.dtype == bool:
        if given.shape != (nodes,):
            raise InputError(f"the mask of free nodes must have the shape ({nodes},), got {given.shape}")
        return given
    if given.ndim != 1 or (given.size and not np.issubdtype(given.dtype, np.integer)):
        raise InputError("free nodes must be a mask or a list of whole numbers")
    if given.size and (given.min() < 0 or given.max() >= nodes):
        raise InputError(f"free nodes must lie between 0 and {nodes - 1}")
    mask = np.zeros(nodes, dtype=bool)
    mask[given.astype(np.int64)] = True
    return mask


def _landed(old: Floats, shift: Floats, *, single: bool) -> Floats:
    """Where the nodes land, as float32 can hold it if the mesh is kept in single precision."""
    new = old + shift
    return np.where(shift != 0, new.astype(np.float32).astype(np.float64) if single else new, old)


def keep_orientation(old: Floats, shift: Floats, corners: Ints, *, single: bool) -> None:
    """Halves shifts (N × D, in place) until every corner simplex (T × (D + 1)) has its old orientation."""
    sign = orientations(old, corners)
    shift[sorted_unique(corners[sign == 0])] = 0.0
    halvings = 0
    while (broken := orientations(_landed(old, shift, single=single), corners) != sign).any():
        shift[sorted_unique(corners[broken])] *= 0.5 if halvings < 60 else 0.0
        halvings += 1


def corner_triangles(rings: Sequence[Ints]) -> Ints:
    """(T × 3) the triangle at each corner of each face; a triangle has only one, the same at all of its corners."""
    triangles = [np.empty((0, 3), dtype=np.int64)]
    for ring in rings:
        count = ring.shape[1]
        triangles += [ring[:, [k, (k + 1) % count, (k + 2) % count]] for k in range(1 if count == 3 else count)]
    return np.concatenate(triangles)


def _corners(blocks: Sequence[CellBlock]) -> Ints:
    """(T × (D + 1)) the simplices at the corners of faces, or of volumes."""
    if not blocks or blocks[0].dimension == 2:
        return corner_triangles([block.nodes[:, : block.corners] for block in blocks])
    return np.concatenate([block.nodes[:, block.cell.simplices].reshape(-1, 4) for block in blocks])


def edges_of(block: CellBlock) -> Ints:
    """(E × 2) the edges of all cells, those between two of them twice."""
    ring = block.nodes[:, : block.corners]
    if block.dimension == 3:
        return ring[:, [edge[:2] for edge in block.cell.edges]].reshape(-1, 2)
    return np.stack([ring, np.roll(ring, -1, axis=1)], axis=2).reshape(-1, 2)


def edge_lengths(points: Floats, edges: Ints, which: str) -> Floats:
    """(N,) mean or shortest length of the edges at each node; 0 where it has none."""
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    if which == "shortest":
        shortest = np.full(len(points), np.inf)
        np.minimum.at(shortest, edges.ravel(), np.repeat(length, 2))
        return np.where(np.isfinite(shortest), shortest, 0.0)
    count = np.bincount(edges.ravel(), minlength=len(points))
    total = np.bincount(edges.ravel(), weights=np.repeat(length, 2), minlength=len(points))
    return np.asarray(total / np.maximum(count, 1))


def orientations(points: Floats, simplices: Ints) -> NDArray[np.int8]:
    """(T,) +1 counter-clockwise or of positive volume, −1 the opposite, 0 where float64 cannot tell for certain."""
    sign, ones = np.empty(len(simplices), dtype=np.int8), np.ones(len(simplices), dtype=np.int8)
    if simplices.shape[1] == 4:
        orientation3.signs(points, simplices.astype(np.int32), ones, 0.0, sign)
    else:
        signs(points, simplices, ones, 0.0, sign)
    return sign
