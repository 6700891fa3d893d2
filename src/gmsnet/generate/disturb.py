"""Throws the nodes of a mesh out of place, for tests of what mends them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gmsnet.errors import InputError
from gmsnet.generate.arguments import one_of
from gmsnet.generate.random import generator
from gmsnet.kernels.simplex.predicates import signs
from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

EDGES = ("mean", "shortest")


def disturb(
    mesh: Mesh, free: ArrayLike, amount: float, *, seed: int = 0, keep_valid: bool = True, edge: str = "mean"
) -> Mesh:
    """The mesh with each free node thrown to a random place around it.

    free: mask (N,) or ids of the nodes that may move. amount: radius of the disc in which they land, in lengths of the
    node's edges. edge: which length, the "mean" of the node's edges or that of the "shortest". keep_valid: halve the
    throws until no corner of a face changes its orientation (a corner whose orientation is not certain stands still);
    otherwise inverted cells are to be expected.

    Raises InputError if the mesh is not planar, for nodes that do not exist, for a negative amount, and for
    another ``edge``.
    """
    if not (np.isfinite(amount) and amount >= 0):
        raise InputError(f"the amount of a disturbance must be 0 or more, got {amount!r}")
    one_of(edge, "edge", EDGES)
    if mesh.plane is None:
        raise InputError("only planar meshes can be disturbed; this one varies along all three axes")
    axes = list(mesh.plane)
    old = np.ascontiguousarray(mesh.points[:, axes])
    rings = [block.nodes[:, : block.corners] for block in mesh.cells if block.dimension == 2]
    rng = generator(seed)
    radius, angle = np.sqrt(rng.random(len(old))), 2 * np.pi * rng.random(len(old))
    throw = radius * _edge_lengths(old, rings, edge) * amount * _mask(free, len(old))
    shift = throw[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    if keep_valid:
        keep_orientation(old, shift, corner_triangles(rings), single=mesh.single)
    points = mesh.points.copy()
    points[:, axes] = _landed(old, shift, single=mesh.single)
    return mesh.with_points(points)


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
    """Halves shifts (N × 2, in place) until every corner (T × 3) has its old orientation."""
    sign = orientations(old, corners)
    shift[np.unique(corners[sign == 0])] = 0.0
    halvings = 0
    while (broken := orientations(_landed(old, shift, single=single), corners) != sign).any():
        shift[np.unique(corners[broken])] *= 0.5 if halvings < 60 else 0.0
        halvings += 1


def corner_triangles(rings: Sequence[Ints]) -> Ints:
    """(T × 3) the triangle at each corner of each face; a triangle has only one, the same at all of its corners."""
    triangles = [np.empty((0, 3), dtype=np.int64)]
    for ring in rings:
        count = ring.shape[1]
        triangles += [ring[:, [k, (k + 1) % count, (k + 2) % count]] for k in range(1 if count == 3 else count)]
    return np.concatenate(triangles)


def _edge_lengths(points: Floats, rings: Sequence[Ints], which: str) -> Floats:
    """(N,) mean or shortest length of the edges at each node; 0 where it has none."""
    pairs = [np.empty((0, 2), dtype=np.int64)]
    pairs += [np.stack([ring, np.roll(ring, -1, axis=1)], axis=2).reshape(-1, 2) for ring in rings]
    edges = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    if which == "shortest":
        shortest = np.full(len(points), np.inf)
        np.minimum.at(shortest, edges.ravel(), np.repeat(length, 2))
        return np.where(np.isfinite(shortest), shortest, 0.0)
    count = np.bincount(edges.ravel(), minlength=len(points))
    total = np.bincount(edges.ravel(), weights=np.repeat(length, 2), minlength=len(points))
    return np.asarray(total / np.maximum(count, 1))


def orientations(points: Floats, triangles: Ints) -> NDArray[np.int8]:
    """(T,) +1 counter-clockwise, −1 clockwise, 0 where float64 cannot tell for certain."""
    sign = np.empty(len(triangles), dtype=np.int8)
    signs(points, triangles, np.ones(len(triangles), dtype=np.int8), 0.0, sign)
    return sign
