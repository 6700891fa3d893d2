"""Delaunay triangulations of uniform random points in a square, a disc or a polygon with holes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from gmsnet.errors import InputError
from gmsnet.generate.delaunay import labelled, triangulate
from gmsnet.generate.outline import SHAPES, area, divide, polygon, uniform_inside
from gmsnet.mesh.mesh import Mesh


def random_mesh(
    nodes: int,
    shape: str | Sequence[ArrayLike] = "square",
    *,
    size: float = 1.0,
    boundary: str = "even",
    boundary_spacing: float = 1.0,
    seed: int = 0,
) -> Mesh:
    """The Delaunay triangulation of uniform random points in a shape (mean 1/q about 0.69 in a square).

    nodes: how many points lie inside; on the boundary come as many as the mean spacing √(area/nodes) asks for, which
    makes round(√nodes) on each side of a square, and more where an edge of the boundary would not be an edge of the
    triangulation. shape: "square", "circle", "plate" (a square with a round hole), "lshape", or the rings of a polygon,
    the outer one first and then its holes, each (k × 2). size: side of the square around a named shape; the coordinates
    of rings are multiplied by it. boundary: "even" or "random" spacing of the nodes on the boundary. boundary_spacing:
    how far apart those are, in mean spacings inside. seed: the same arguments give the same mesh.

    Returns counter-clockwise triangles of the region "domain", and the boundary as line cells by marker: the sides of
    the named shapes ("bottom", "circle", "hole", …); for rings "outer", "hole_1", "hole_2", …

    Raises InputError for numbers out of range, an unknown shape, and rings that cross or are no polygon.
    """
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer) or nodes < 1:
        raise InputError(f"a random mesh needs a whole number of nodes, at least 1, got {nodes!r}")
    if not (np.isfinite(size) and size > 0):
        raise InputError(f"the size of a random mesh must be a positive number, got {size!r}")
    if boundary not in ("even", "random"):
        raise InputError(f"boundary must be 'even' or 'random', got {boundary!r}")
    if not (np.isfinite(boundary_spacing) and boundary_spacing > 0):
        raise InputError(f"the spacing on the boundary must be a positive number, got {boundary_spacing!r}")
    rng = generator(seed)
    spread = rng if boundary == "random" else None
    if isinstance(shape, str):
        if shape not in SHAPES:
            raise InputError(f"unknown shape {shape!r}; there are {', '.join(SHAPES)}")
        whole, outline = SHAPES[shape]
        spacing = float(np.sqrt(whole / nodes))
        rings = outline(spacing * boundary_spacing, spread)
    else:
        rings = polygon(shape)
        spacing = float(np.sqrt(sum(area(ring.corners) for ring in rings) / nodes))
    inner = uniform_inside(int(nodes), rings, rng)
    mesh = triangulate(*divide(rings, spacing * boundary_spacing, spread), inner)
    return labelled(mesh, [name for ring in rings for name in ring.markers], scale=size)


def generator(seed: int) -> np.random.Generator:
    """NumPy's generator for a seed. Raises InputError if it is not a whole number of at least 0."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError(f"a seed must be a whole number of at least 0, got {seed!r}")
    return np.random.default_rng(seed)
